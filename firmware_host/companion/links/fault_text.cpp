#include "firmware_host/companion/links/fault_text.hpp"

#include <fmt/format.h>

#include <array>

namespace rig::host {

namespace {

constexpr std::array<std::string_view, kLastFault> kTexts = {
    "A camera is unplugged or closed; the others go on.",
    "A camera is in the wrong socket or is not the one that the pack was made for.",
    "A camera reports transfer errors and is being restarted.",
    "A camera marked a frame as damaged; that frame was left out.",
    "A camera delivered a frame of the wrong length; that frame was left out.",
    "A compressed frame could not be decoded; that frame was left out.",
    "A camera sends images of another size or format than was agreed.",
    "A camera repeats the same image; it counts as missing until the image changes.",
    "Frames are missing between two that a camera delivered.",
    "A frame came too late or out of order and was left out.",
    "A camera's frame counter or clock started anew; nothing is lost.",
    "The cameras no longer expose at the same moment.",
    "The light changed at once, or the image is too dark or too bright.",
    "More bright or dark spots than markers: look for reflections or sun.",
    "Some markers are not seen; the shapes that hang on them follow the others.",
    "No marker is seen; the last good face is held.",
    "Two markers were mistaken for each other and are being told apart again.",
    "A marker has slid or fallen off: press it back, replace it or run headrig neutral.",
    "The markers seen do not fix the face well; weights are damped.",
    "The headset has slipped on the head further than the solver can take out.",
    "Noise on the line: damaged frames were dropped.",
    "The line lost or gained bytes; check its rate and its cable.",
    "Reception began in the middle of a frame; nothing is wrong.",
    "The host does not read fast enough; old frames are replaced by new ones.",
    "The line took a part of a frame; the rest follows or the frame is dropped.",
    "The cable was pulled or the port was reset.",
    "The host has suspended the port.",
    "The network lost, doubled or reordered datagrams.",
    "A command was malformed or unknown and was refused.",
    "Commands arrive faster than they may; some were dropped.",
    "Host and board speak different versions of the protocol: update the older one.",
    "Another host owns the session; this one can only look.",
    "The wall clock jumped; the rig does not use it.",
    "The time between two frames made no sense and was corrected.",
    "A frame took longer to solve than there was time; work is being shed.",
    "The processor is hot and slows down; let air at the board.",
    "The solver hung and the program was restarted.",
    "Memory could not be had at the start.",
    "The recording stopped: the disk is full, slow or failing. The stream goes on.",
    "A recording ends early because the power failed; all whole chunks are readable.",
    "Settings out of range or contradictory were refused; the running ones stay.",
    "The stored settings are damaged; a copy or the defaults are in use.",
    "The pack in use is damaged on the board; flash it again.",
    "Power failed while flashing; the old pack runs and flashing can be repeated.",
    "The new pack is cut off or too long and was refused.",
    "The new pack is damaged and was refused.",
    "The new pack's signature is wrong and it was refused.",
    "The new pack is well formed but its numbers cannot be right; it was refused.",
    "The new pack is for another board, camera set or version of the solver.",
    "This session has no right to flash.",
    "The new pack is older than this rig accepts.",
    "The new pack solved badly on trial; the old one is back.",
    "The host went away while flashing; the old pack runs.",
    "The board's flash memory has a bad place; the old pack runs.",
    "No slot holds a usable pack; flash one.",
};

}  // namespace

std::string_view fault_text(int number) {
    if (number < 1 || number > kLastFault)
        return "A fault that this program does not know; the board is newer: update.";
    return kTexts[static_cast<std::size_t>(number - 1)];
}

std::string fault_code(int number) {
    return fmt::format("F{:02d}", number);
}

std::vector<int> faults_of(FaultMap map) {
    std::vector<int> numbers;
    for (int bit = 0; bit < 64; ++bit) {
        if (((map >> bit) & 1U) != 0) numbers.push_back(bit + 1);
    }
    return numbers;
}

}  // namespace rig::host
