#include "hal/linux/raw_terminal.hpp"

// The kernel's termios2 takes any bit rate; glibc's <termios.h> knows only a table and cannot share a file
// with it.
#include <asm/termbits.h>
#include <sys/ioctl.h>

#include "hal/linux/system_call.hpp"

namespace rig::os {

bool make_raw(int descriptor, int baud) {
    termios2 settings{};
    if (!system_call([&] { return ioctl(descriptor, TCGETS2, &settings); }).done()) return false;
    settings.c_iflag = IGNBRK | IGNPAR;
    settings.c_oflag = 0;
    settings.c_lflag = 0;
    settings.c_cflag = (settings.c_cflag & CBAUD) | CS8 | CREAD | CLOCAL;
    if (baud != kKeepRate) {
        settings.c_cflag = (settings.c_cflag & ~static_cast<tcflag_t>(CBAUD)) | BOTHER;
        settings.c_ispeed = static_cast<speed_t>(baud);
        settings.c_ospeed = static_cast<speed_t>(baud);
    }
    // With VMIN 1 and O_NONBLOCK, no data is EAGAIN and 0 means hang-up; with VMIN 0 the two look the same.
    settings.c_cc[VMIN] = 1;
    settings.c_cc[VTIME] = 0;
    return system_call([&] { return ioctl(descriptor, TCSETS2, &settings); }).done();
}

bool discard_input(int descriptor) {
    return system_call([&] { return ioctl(descriptor, TCFLSH, TCIFLUSH); }).done();
}

int unread_bytes(int descriptor) {
    int count = 0;
    return system_call([&] { return ioctl(descriptor, FIONREAD, &count); }).done() ? count : 0;
}

}  // namespace rig::os
