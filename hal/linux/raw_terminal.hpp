// Puts a terminal device into the state of a plain byte pipe. Inside hal/linux only.
#pragma once

namespace rig::os {

inline constexpr int kKeepRate = 0;

// 8 data bits, no parity, no echo, no translation, no flow control, no hang-up on close. `baud` may be any
// rate the driver can divide (BOTHER), 0 keeps the present one. False when the device refuses.
[[nodiscard]] bool make_raw(int descriptor, int baud);

// Drops what was received and not yet read. False when the device refuses.
[[nodiscard]] bool discard_input(int descriptor);

// Received and not yet read; 0 when the device does not say.
[[nodiscard]] int unread_bytes(int descriptor);

}  // namespace rig::os
