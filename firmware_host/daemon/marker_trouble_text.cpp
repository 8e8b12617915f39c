#include "firmware_host/daemon/marker_trouble_text.hpp"

#include <array>
#include <cstdio>
#include <cstring>

namespace rig {

namespace {

constexpr std::size_t kLineBytes = 120;
constexpr std::size_t kRestBytes = 14;  // "; and 255 more"
constexpr std::size_t kNameBytes = 30;

using Phrase = std::array<char, 100>;

void say_one(const FrameReport& report, std::size_t marker, std::string_view name, Phrase& phrase) {
    std::array<char, 16> number{};
    if (name.empty()) {
        std::snprintf(number.data(), number.size(), "%zu", marker);
        name = number.data();
    }
    const std::string_view shown = utf8_prefix(name, kNameBytes);
    const auto bytes = static_cast<int>(shown.size());
    if (report.marker_trouble[marker] == MarkerTrouble::kFallen) {
        std::snprintf(phrase.data(), phrase.size(), "marker %.*s has come off", bytes, shown.data());
    } else {
        std::snprintf(phrase.data(), phrase.size(), "marker %.*s has slid by %.1f mm", bytes, shown.data(),
                      static_cast<double>(report.marker_off_mm[marker]));
    }
}

}  // namespace

FixedText<120> marker_trouble_text(const FrameReport& report, std::span<const std::string_view> names) {
    std::array<char, kLineBytes + 1> line{};
    std::size_t used = 0;
    std::size_t unsaid = 0;
    for (std::size_t m = 0; m < kMaxMarkers; ++m) {
        if (report.marker_trouble[m] == MarkerTrouble::kNone) continue;
        Phrase phrase{};
        say_one(report, m, m < names.size() ? names[m] : std::string_view{}, phrase);
        const std::size_t bytes = std::strlen(phrase.data()) + (used > 0 ? 2 : 0);
        if (unsaid > 0 || used + bytes > kLineBytes - kRestBytes) {
            ++unsaid;
            continue;
        }
        std::snprintf(line.data() + used, line.size() - used, "%s%s", used > 0 ? "; " : "", phrase.data());
        used += bytes;
    }
    if (unsaid > 0) std::snprintf(line.data() + used, line.size() - used, "; and %zu more", unsaid);
    return FixedText<120>(std::string_view(line.data()));
}

}  // namespace rig
