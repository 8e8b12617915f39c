#include "firmware_host/settings/filter_settings.hpp"

#include <algorithm>
#include <charconv>

namespace rig {

namespace {

constexpr int kDefaultWindow = 15;  // 0.25 s at 60 Hz, the window of [Hybrid16 section 7.2]
constexpr int kSmallestWindow = 3;
constexpr int kLargestWindow = static_cast<int>(kMaxWindowFrames);

bool is_window(int frames) {
    return frames >= kSmallestWindow && frames <= kLargestWindow;
}

// "one-euro", "savitzky-golay:9"
Result<ShapeFilter, std::string> read_shape_filter(std::string_view text, int window_frames) {
    const std::size_t colon = text.find(':');
    const auto kind = filter_kind(text.substr(0, colon));
    if (!kind) {
        return failure("'" + std::string(text) +
                       "' is no filter; there are none, one-euro, savitzky-golay and savitzky-golay:WINDOW");
    }
    int window = window_frames;
    if (colon != std::string_view::npos) {
        const std::string_view number = text.substr(colon + 1);
        const auto [end, error] = std::from_chars(number.data(), number.data() + number.size(), window);
        if (*kind != FilterKind::kSavitzkyGolay || error != std::errc{} ||
            end != number.data() + number.size() || !is_window(window)) {
            return failure("'" + std::string(text) +
                           "': only savitzky-golay has a window, of 3 to 61 frames");
        }
    }
    return ShapeFilter{*kind, static_cast<std::uint8_t>(window)};
}

}  // namespace

std::optional<FilterKind> filter_kind(std::string_view word) {
    if (word == "none") return FilterKind::kNone;
    if (word == "one-euro") return FilterKind::kOneEuro;
    if (word == "savitzky-golay") return FilterKind::kSavitzkyGolay;
    return std::nullopt;
}

FilterSettings merged(const FilterSettings& under, const FilterSettings& over) {
    FilterSettings both = under;
    if (over.kind) {
        // Another filter for the whole face: what was said about the old one does not count any more.
        both = over;
        return both;
    }
    if (over.window_frames) both.window_frames = over.window_frames;
    if (over.delay_frames) both.delay_frames = over.delay_frames;
    both.shapes.insert(both.shapes.end(), over.shapes.begin(), over.shapes.end());
    return both;
}

bool smooths_nothing(const FilterSettings& settings) {
    return settings.kind == FilterKind::kNone && settings.shapes.empty();
}

Result<FilterChoice, std::string> filter_choice(const FilterSettings& settings, ShapeNames names) {
    const FilterKind kind = settings.kind.value_or(FilterKind::kOneEuro);
    const int window = settings.window_frames.value_or(kDefaultWindow);
    if (!is_window(window)) return failure(std::string("the window must be 3 to 61 frames"));
    FilterChoice choice;
    choice.shapes.fill({kind, static_cast<std::uint8_t>(window)});
    for (const auto& [selector, text] : settings.shapes) {
        const auto selected = select_shapes(selector, names);
        if (!selected) return failure(selected.error());
        const auto filter = read_shape_filter(text, window);
        if (!filter) return failure(filter.error());
        for (const std::size_t i : *selected) choice.shapes[i] = *filter;
    }
    int narrowest = kLargestWindow + 1;
    for (std::size_t i = 0; i < names.size(); ++i) {
        if (choice.shapes[i].kind == FilterKind::kSavitzkyGolay)
            narrowest = std::min<int>(narrowest, choice.shapes[i].window_frames);
    }
    const bool any = narrowest <= kLargestWindow;
    if (!any && (settings.window_frames || settings.delay_frames))
        return failure(std::string("a window and a delay belong to savitzky-golay, and no shape has it"));
    const int delay = settings.delay_frames.value_or(any ? std::min(window, narrowest) / 2 : 0);
    if (delay < 0 || delay >= narrowest)
        return failure(std::string("the delay must be below every window: 0 to " +
                                   std::to_string(narrowest - 1) + " frames"));
    choice.delay_frames = static_cast<std::uint8_t>(delay);
    return choice;
}

}  // namespace rig
