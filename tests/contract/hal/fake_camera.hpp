// A video driver in this process: programs that link with --wrap=open,ioctl,poll,close,mmap,munmap meet it
// behind nodes of a folder that looks like sysfs and /dev. Its time is that of a manual clock.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "hal/linux/v4l2/grey_conversion.hpp"
#include "hal/linux/v4l2/video_nodes.hpp"
#include "hal/sim/manual_clock.hpp"
#include "tests/support/temp_folder.hpp"

namespace rig::test {

// What a frame suffers on its way.
enum class FrameFate : std::uint8_t { kGood, kDamaged, kShort, kEmpty, kOverLong, kTransferError, kLost };

struct FakeSensor {
    std::vector<PixelLayout> layouts{PixelLayout::kGrey};
    int width_px = 8;
    int height_px = 6;
    double rate_hz = 100.0;
    std::uint32_t row_bytes = 0;  // 0: rows without padding
    std::uint32_t first_sequence = 0;
    std::int64_t first_stamp_us = 0;  // added to every stamp
    bool stamps_start = false;
    bool tells_rate = true;
    std::uint32_t frame_total = 1000;
    std::uint32_t buffers = 8;  // most that the driver gives
    // Bytes of frame n as they lie in memory, rows padded.
    std::function<std::vector<std::uint8_t>(std::uint32_t n)> picture;
    std::map<std::uint32_t, FrameFate> fates;
    std::map<std::uint32_t, std::pair<std::int32_t, std::int32_t>> controls;  // id: lowest, highest
};

// One machine at a time: the wrapped calls are the program's.
class FakeVideoMachine {
  public:
    explicit FakeVideoMachine(sim::ManualClock& clock);
    ~FakeVideoMachine();
    FakeVideoMachine(const FakeVideoMachine&) = delete;
    FakeVideoMachine& operator=(const FakeVideoMachine&) = delete;

    // `port` as "1-2.1"; node is the number of /dev/videoN.
    void plug_in(int node, const std::string& port, const std::string& serial, FakeSensor sensor,
                 int usb_mbps = 480);
    void unplug(int node);
    [[nodiscard]] DeviceTree tree() const;

    // Call number `nth` on a camera, counted from now, fails once.
    void fail_call(std::uint64_t nth, int error_number);
    [[nodiscard]] bool has_failed() const { return failed_; }
    // Of control `id`, as it was last set.
    [[nodiscard]] std::int32_t control(int node, std::uint32_t id) const;
    [[nodiscard]] int mappings() const { return mappings_; }
    [[nodiscard]] int open_nodes() const { return static_cast<int>(opened_.size()); }
    [[nodiscard]] std::size_t queued(int node) const;

    // What the wrapped calls do; false where the call is none of ours.
    bool open(const std::string& path, int& result);
    bool close(int descriptor);
    bool ioctl(int descriptor, unsigned long request, void* argument, int& result);
    bool poll(int descriptor, short& events, int timeout_ms, int& result);
    void note_mapping(int descriptor, int change);

    [[nodiscard]] static FakeVideoMachine* current();

  private:
    struct Node {
        FakeSensor sensor;
        std::map<std::uint32_t, std::int32_t> values;
        PixelLayout layout = PixelLayout::kGrey;
        bool streaming = false;
        std::int64_t started_us = 0;
        std::uint32_t next_frame = 0;
        std::uint32_t buffer_count = 0;
        std::uint32_t buffer_bytes = 0;
        std::vector<std::uint32_t> queue;  // of buffers that the driver has
        bool present = true;
        int holder = -1;  // descriptor
    };
    [[nodiscard]] bool fails_now(int& result);
    [[nodiscard]] std::int64_t due_us(const Node& node, std::uint32_t frame) const;
    int answer(Node& node, int descriptor, unsigned long request, void* argument);
    int set_format(Node& node, void* argument) const;
    int request_buffers(Node& node, int descriptor, void* argument) const;
    int take_buffer(Node& node, int descriptor, void* argument);
    int set_control(Node& node, void* argument) const;

    sim::ManualClock& clock_;
    TempFolder folder_;
    std::map<int, Node> nodes_;
    std::map<int, int> opened_;  // descriptor: node
    std::uint64_t calls_ = 0;
    std::uint64_t failing_call_ = ~std::uint64_t{0};
    int failing_errno_ = 0;
    bool failed_ = false;
    int mappings_ = 0;
};

}  // namespace rig::test
