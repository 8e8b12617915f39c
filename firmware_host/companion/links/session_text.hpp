// What boards say, in words and lines for people. Plain text, no colour, no cursor movement.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "core/base/face_state.hpp"
#include "core/wire/health.hpp"
#include "core/wire/session_messages.hpp"

namespace rig::host {

[[nodiscard]] std::string_view state_word(TrackingState state);
[[nodiscard]] std::string_view camera_word(CameraStatus status);
// "known", or why nobody knows where the head is.
[[nodiscard]] std::string_view head_word(HeadStatus status);

// One fact a line, "label: value".
[[nodiscard]] std::vector<std::string> hello_lines(const Hello& hello);
// Counters, times and cameras; then each fault that is present or has been, with its sentence.
[[nodiscard]] std::vector<std::string> health_lines(const Health& health);
[[nodiscard]] std::vector<std::string> fault_lines(const Health& health);

// "fault raised F01, camera 1, 3 times: camera 1 is gone"
[[nodiscard]] std::string event_line(const EventMessage& event);

}  // namespace rig::host
