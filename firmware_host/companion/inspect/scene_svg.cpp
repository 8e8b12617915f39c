#include <fmt/format.h>

#include <algorithm>

#include "firmware_host/companion/files/image_file.hpp"
#include "firmware_host/companion/inspect/take_charts.hpp"
#include "firmware_host/companion/report/data_uri.hpp"
#include "firmware_host/companion/report/page.hpp"

namespace rig::host {

namespace {

constexpr double kShownWidthPx = 420.0;
constexpr int kJpegQuality = 80;
// Over grey pictures and the dark plate of views without one.
constexpr const char* kNamed = "#5adc6e";
constexpr const char* kGhost = "#ff6ad5";
constexpr const char* kInferred = "#ffb347";
constexpr const char* kElsewhere = "#7fc4ff";
constexpr const char* kPlate = "#23282c";

// Sizes stay the same on screen, however large the view is.
struct Pen {
    double scale;  // px of the view for one on screen
    [[nodiscard]] double operator()(double shown_px) const { return shown_px * scale; }
};

std::string name_at(const Pen& pen, double x, double y, const char* colour, const std::string& name) {
    return fmt::format(
        "<text x=\"{:.1f}\" y=\"{:.1f}\" fill=\"{}\" font-size=\"{:.1f}\" stroke=\"#000\" "
        "stroke-width=\"{:.1f}\" "
        "stroke-opacity=\"0.75\" paint-order=\"stroke\">{}</text>\n",
        x, y, colour, pen(7.5), pen(1.6), escaped(name));
}

std::string drawn(const Pen& pen, const SceneBlob& blob, const std::vector<InspectedMarker>& markers) {
    const double radius = std::max(0.5 * blob.diameter_px, pen(2.5)) + pen(1.5);
    if (blob.marker < 0) {
        return fmt::format(
            "<rect x=\"{:.1f}\" y=\"{:.1f}\" width=\"{:.1f}\" height=\"{:.1f}\" fill=\"none\" stroke=\"{}\" "
            "stroke-width=\"{:.1f}\"/>\n",
            blob.x_px - radius, blob.y_px - radius, 2.0 * radius, 2.0 * radius, kGhost, pen(1.4));
    }
    const std::string& name = markers[static_cast<std::size_t>(blob.marker)].name;
    return fmt::format(
               "<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"{:.1f}\" fill=\"none\" stroke=\"{}\" "
               "stroke-width=\"{:.1f}\"/>\n",
               blob.x_px, blob.y_px, radius, kNamed, pen(1.2)) +
           name_at(pen, blob.x_px + radius + pen(1.0), blob.y_px - pen(2.0), "#fdfdc0", name);
}

std::string drawn(const Pen& pen, const SceneGuess& guess, const std::vector<InspectedMarker>& markers) {
    const double arm = pen(3.5);
    if (guess.seen_elsewhere) {
        return fmt::format(
            "<path d=\"M{:.1f} {:.1f}h{:.1f}m{:.1f} {:.1f}v{:.1f}\" fill=\"none\" stroke=\"{}\" "
            "stroke-width=\"{:.1f}\"/>\n",
            guess.x_px - arm, guess.y_px, 2.0 * arm, -arm, -arm, 2.0 * arm, kElsewhere, pen(1.2));
    }
    return fmt::format(
               "<path d=\"M{:.1f} {:.1f}l{:.1f} {:.1f}l{:.1f} {:.1f}l{:.1f} {:.1f}z\" fill=\"none\" "
               "stroke=\"{}\" "
               "stroke-width=\"{:.1f}\"/>\n",
               guess.x_px - arm, guess.y_px, arm, -arm, arm, arm, -arm, arm, kInferred, pen(1.4)) +
           name_at(pen, guess.x_px + arm + pen(1.0), guess.y_px - pen(2.0), kInferred,
                   markers[static_cast<std::size_t>(guess.marker)].name);
}

}  // namespace

std::string scene_svg(const SceneView& view, const std::vector<InspectedMarker>& markers) {
    const Pen pen{view.width_px / kShownWidthPx};
    std::string out = fmt::format(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"-0.5 -0.5 {:.0f} {:.0f}\" width=\"{:.0f}\" "
        "height=\"{:.0f}\" "
        "role=\"img\" aria-label=\"{}\" font-family=\"DejaVu Sans, sans-serif\">\n",
        view.width_px, view.height_px, kShownWidthPx, view.height_px / pen.scale, escaped(view.title));
    out += fmt::format("<rect x=\"-0.5\" y=\"-0.5\" width=\"{:.0f}\" height=\"{:.0f}\" fill=\"{}\"/>\n",
                       view.width_px, view.height_px, kPlate);
    if (!view.picture.empty()) {
        // Read again: only the few moments that are shown are worth it. A file that went away leaves the
        // plate.
        if (const auto image = read_grey_image(view.picture)) {
            out += fmt::format("<image x=\"-0.5\" y=\"-0.5\" width=\"{}\" height=\"{}\" href=\"{}\"/>\n",
                               image->width_px, image->height_px,
                               data_uri("image/jpeg", encode_jpeg(*image, kJpegQuality)));
        }
    }
    for (const SceneGuess& guess : view.guesses) out += drawn(pen, guess, markers);
    for (const SceneBlob& blob : view.blobs) out += drawn(pen, blob, markers);
    const auto named =
        std::ranges::count_if(view.blobs, [](const SceneBlob& blob) { return blob.marker >= 0; });
    out += name_at(pen, pen(6.0), pen(14.0), "#ffffff",
                   fmt::format("{}: {} named, {} not", view.title, named,
                               static_cast<std::ptrdiff_t>(view.blobs.size()) - named));
    return out + "</svg>\n";
}

}  // namespace rig::host
