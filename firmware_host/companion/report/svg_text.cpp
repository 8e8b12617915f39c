#include "firmware_host/companion/report/svg_text.hpp"

#include <fmt/format.h>

#include "firmware_host/companion/report/page.hpp"

namespace rig::host {

std::string open_svg(double width, double height, std::string_view label) {
    return fmt::format(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {0:.0f} {1:.0f}\" width=\"{0:.0f}\" "
        "height=\"{1:.0f}\" role=\"img\" aria-label=\"{2}\" font-family=\"DejaVu Sans, sans-serif\" "
        "font-size=\"11\">\n",
        width, height, escaped(label));
}

std::string text_at(double x, double y, std::string_view anchor, std::string_view text,
                    std::string_view attributes) {
    return fmt::format(
        "<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"{}\" fill=\"currentColor\"{}>{}</text>\n", x, y,
        anchor, attributes, escaped(text));
}

}  // namespace rig::host
