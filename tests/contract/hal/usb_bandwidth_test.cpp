// Sets of cameras that fit on a bus and sets that do not, with the sums that people are told.
#include "hal/linux/v4l2/usb_bandwidth.hpp"

#include <gtest/gtest.h>

#include <vector>

namespace rig::test {
namespace {

CameraLoad camera(std::string_view name, PixelLayout layout, double rate_hz, int bus = 1, int mbps = 480) {
    return {name, bus, mbps, layout, 640, 480, rate_hz};
}

TEST(UsbBandwidth, TwoGreyCamerasAtSixtyFitOnOneHighSpeedBus) {
    const std::vector<CameraLoad> loads{camera("left", PixelLayout::kGrey, 60.0),
                                        camera("right", PixelLayout::kGrey, 60.0)};
    EXPECT_NEAR(reserved_bytes_per_s(loads[0]), 640 * 480 * 60 * 1.02, 1.0);
    EXPECT_FALSE(bandwidth_fault(loads).has_value());
}

TEST(UsbBandwidth, AThirdOneDoesNotAndTheSumIsSaid) {
    const std::vector<CameraLoad> loads{camera("left", PixelLayout::kGrey, 60.0),
                                        camera("right", PixelLayout::kGrey, 60.0),
                                        camera("third", PixelLayout::kGrey, 60.0)};
    const auto fault = bandwidth_fault(loads);
    ASSERT_TRUE(fault.has_value());
    EXPECT_TRUE(
        fault->starts_with("left and right and third on USB bus 1 need 56.4 MB/s where 41.0 MB/s fit"))
        << *fault;
    std::vector<CameraLoad> apart = loads;
    apart[2].usb_bus = 2;
    EXPECT_FALSE(bandwidth_fault(apart).has_value());
    apart[2].usb_bus = 0;
    EXPECT_FALSE(bandwidth_fault(apart).has_value()) << "not on USB";
}

TEST(UsbBandwidth, OneCameraAloneMayBeTooMuchForItsEndpoint) {
    const std::vector<CameraLoad> loads{camera("left", PixelLayout::kYuyv, 60.0)};
    const auto fault = bandwidth_fault(loads);
    ASSERT_TRUE(fault.has_value());
    EXPECT_TRUE(fault->starts_with("left needs 37.6 MB/s where 24.6 MB/s fit")) << *fault;
    EXPECT_FALSE(bandwidth_fault(std::vector{camera("left", PixelLayout::kYuyv, 60.0, 2, 5000)}).has_value());
    EXPECT_FALSE(bandwidth_fault(std::vector{camera("left", PixelLayout::kJpeg, 60.0)}).has_value());
    EXPECT_TRUE(bandwidth_fault(std::vector{camera("left", PixelLayout::kGrey, 30.0, 1, 12)}).has_value());
}

TEST(UsbBandwidth, NothingIsNoFault) {
    EXPECT_FALSE(bandwidth_fault({}).has_value());
}

}  // namespace
}  // namespace rig::test
