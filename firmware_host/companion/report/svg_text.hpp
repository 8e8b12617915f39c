// Elements that every drawn chart has. Text takes the page's colour and is escaped here.
#pragma once

#include <string>
#include <string_view>

namespace rig::host {

// The opening tag, px; label: what the picture shows, for those who cannot see it.
[[nodiscard]] std::string open_svg(double width, double height, std::string_view label);

// anchor: start, middle, end. attributes: further ones of the element, with a space before each.
[[nodiscard]] std::string text_at(double x, double y, std::string_view anchor, std::string_view text,
                                  std::string_view attributes = {});

}  // namespace rig::host
