#include "firmware_host/daemon/neutral_text.hpp"

#include <array>
#include <cstdio>

namespace rig {

namespace {

using Line = std::array<char, 200>;

void say_refusal(const NeutralReport& report, int name_bytes, const char* name, Line& line) {
    switch (report.refusal) {
        case NeutralRefusal::kUnseen:
            std::snprintf(line.data(), line.size(),
                          "neutral refused: too little was seen, %.0f %% of the face or of the second",
                          100.0 * report.value);
            return;
        case NeutralRefusal::kMoved:
            std::snprintf(line.data(), line.size(), "neutral refused: the face moved, %.*s by %.2f mm rms",
                          name_bytes, name, report.value);
            return;
        case NeutralRefusal::kExpression:
            std::snprintf(line.data(), line.size(),
                          "neutral refused: the face holds an expression of %.2f mm rms", report.value);
            return;
        case NeutralRefusal::kOffset:
            std::snprintf(line.data(), line.size(),
                          "neutral refused: %.*s is %.1f mm off, too far for a dot that was glued aside",
                          name_bytes, name, report.value);
            return;
        case NeutralRefusal::kNone:
            return;
    }
}

}  // namespace

FixedText<120> neutral_text(const NeutralReport& report, std::string_view marker) {
    constexpr std::size_t kNameBytes = 30;  // of a line of 120
    const std::string_view name = utf8_prefix(marker, kNameBytes);
    const auto name_bytes = static_cast<int>(name.size());
    Line line{};
    if (report.phase == NeutralPhase::kTaken) {
        std::snprintf(line.data(), line.size(),
                      "neutral taken: offsets of %.2f mm rms, largest %.2f mm at %.*s", report.rms_mm,
                      report.value, name_bytes, name.data());
    } else if (report.phase == NeutralPhase::kRefused) {
        say_refusal(report, name_bytes, name.data(), line);
    }
    return FixedText<120>(std::string_view(line.data()));
}

}  // namespace rig
