#include "hal/sim/fault_plan.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <utility>

namespace rig::sim {

namespace {

constexpr std::array<std::pair<std::string_view, FaultKind>, 14> kNames{{
    {"camera_gone", FaultKind::kCameraGone},
    {"camera_io", FaultKind::kCameraIo},
    {"camera_short", FaultKind::kCameraShort},
    {"camera_silent", FaultKind::kCameraSilent},
    {"camera_frozen", FaultKind::kCameraFrozen},
    {"camera_late", FaultKind::kCameraLate},
    {"camera_reorder", FaultKind::kCameraReorder},
    {"exposure_flash", FaultKind::kExposureFlash},
    {"exposure_dark", FaultKind::kExposureDark},
    {"link_stall", FaultKind::kLinkStall},
    {"link_reset", FaultKind::kLinkReset},
    {"link_bit_errors", FaultKind::kLinkBitErrors},
    {"link_byte_loss", FaultKind::kLinkByteLoss},
    {"link_partial", FaultKind::kLinkPartial},
}};

constexpr std::int64_t kLongest_ms = std::int64_t{1} << 40;  // far beyond any take, far below overflow

std::string_view next_word(std::string_view& line) {
    const std::size_t start = line.find_first_not_of(" \t\r");
    if (start == std::string_view::npos) return line = {};
    line.remove_prefix(start);
    const std::size_t end = std::min(line.find_first_of(" \t\r"), line.size());
    const std::string_view word = line.substr(0, end);
    line.remove_prefix(end);
    return word;
}

template <class Number>
bool parse_number(std::string_view word, Number& value) {
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
    return error == std::errc{} && end == word.data() + word.size();
}

bool parse_time(std::string_view word, std::int64_t& time_us) {
    std::int64_t time_ms = 0;
    if (!parse_number(word, time_ms) || time_ms < 0 || time_ms > kLongest_ms) return false;
    time_us = time_ms * 1000;
    return true;
}

bool parse_kind(std::string_view word, FaultKind& kind) {
    for (const auto& [name, value] : kNames) {
        if (name != word) continue;
        kind = value;
        return true;
    }
    return false;
}

// "" when the line is good.
std::string parse_line(std::string_view line, FaultPlan& plan) {
    const std::string_view first = next_word(line);
    if (first == "seed") {
        return parse_number(next_word(line), plan.seed) ? "" : "seed needs a whole number";
    }
    FaultEvent event;
    if (!parse_time(first, event.at_us)) return "the first word must be a time in ms, 0 or later";
    const std::string_view name = next_word(line);
    if (!parse_kind(name, event.what)) return std::string(name).append(" is no fault");
    if (!parse_time(next_word(line), event.for_us)) return "the third word must be a duration in ms";
    if (!parse_number(next_word(line), event.target))
        return "the fourth word must be a camera or link number";
    const std::string_view magnitude = next_word(line);
    if (!magnitude.empty() &&
        (!parse_number(magnitude, event.magnitude) || !std::isfinite(event.magnitude))) {
        return "the fifth word must be a number";
    }
    if (!next_word(line).empty()) return "there are more than five words";
    plan.events.push_back(event);
    return "";
}

}  // namespace

const FaultEvent* FaultPlan::active(FaultKind what, std::uint8_t target, std::int64_t now_us) const {
    for (const FaultEvent& event : events) {
        const bool in_time = now_us >= event.at_us && now_us - event.at_us < event.for_us;
        if (event.what == what && event.target == target && in_time) return &event;
    }
    return nullptr;
}

Result<FaultPlan, FaultPlanError> parse_fault_plan(std::string_view text) {
    FaultPlan plan;
    for (int number = 1; !text.empty(); ++number) {
        const std::size_t end = std::min(text.find('\n'), text.size());
        std::string_view line = text.substr(0, end);
        text.remove_prefix(std::min(end + 1, text.size()));
        line = line.substr(0, std::min(line.find('#'), line.size()));
        if (line.find_first_not_of(" \t\r") == std::string_view::npos) continue;
        if (std::string reason = parse_line(line, plan); !reason.empty()) {
            return failure(FaultPlanError{number, std::move(reason)});
        }
    }
    return plan;
}

}  // namespace rig::sim
