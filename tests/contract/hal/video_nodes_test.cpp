// Cameras are known by port and serial number, whatever their nodes are called.
#include "hal/linux/v4l2/video_nodes.hpp"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <vector>

#include "tests/contract/hal/fake_camera.hpp"

namespace rig::test {
namespace {

class VideoNodes : public testing::Test {
  protected:
    sim::ManualClock clock_;
    FakeVideoMachine machine_{clock_};

    std::vector<VideoNode> nodes() {
        std::vector<VideoNode> all(16);
        all.resize(list_video_nodes(machine_.tree(), all));
        return all;
    }
    CameraMatch find(const CameraIdentity& wanted, std::string* device = nullptr) {
        const auto all = nodes();
        std::size_t found = 0;
        const CameraMatch match = find_camera(all, wanted, found);
        if (match == CameraMatch::kFound && device != nullptr) *device = all[found].device.view();
        return match;
    }
};

TEST_F(VideoNodes, NothingIsPluggedIn) {
    EXPECT_TRUE(nodes().empty());
    EXPECT_EQ(find({}), CameraMatch::kAbsent);
}

TEST_F(VideoNodes, WhatTheKernelTells) {
    machine_.plug_in(7, "3-1.4", "A17", {}, 5000);
    const auto all = nodes();
    ASSERT_EQ(all.size(), 1U);
    EXPECT_TRUE(all[0].device.view().ends_with("/dev/video7"));
    EXPECT_EQ(all[0].name.view(), "USB Camera: USB Camera");
    EXPECT_EQ(all[0].path.view(), "usb-3-1.4");
    EXPECT_EQ(all[0].serial.view(), "A17");
    EXPECT_EQ(all[0].usb_bus, 3);
    EXPECT_EQ(all[0].usb_mbps, 5000);
}

TEST_F(VideoNodes, TheNumberOfTheNodeDoesNotCount) {
    machine_.plug_in(0, "1-1", "left", {});
    machine_.plug_in(1, "1-2", "right", {});
    std::string device;
    EXPECT_EQ(find({"usb-1-2", "right"}, &device), CameraMatch::kFound);
    EXPECT_TRUE(device.ends_with("video1"));
    machine_.unplug(0);
    machine_.unplug(1);
    machine_.plug_in(0, "1-2", "right", {});
    EXPECT_EQ(find({"usb-1-2", "right"}, &device), CameraMatch::kFound);
    EXPECT_TRUE(device.ends_with("video0"));
    EXPECT_EQ(find({"usb-1-1", "left"}), CameraMatch::kAbsent);
}

TEST_F(VideoNodes, ExchangedCamerasAreNoticed) {
    machine_.plug_in(0, "1-1", "right", {});
    machine_.plug_in(1, "1-2", "left", {});
    EXPECT_EQ(find({"usb-1-1", "left"}), CameraMatch::kOther);
    EXPECT_EQ(find({"", "left"}), CameraMatch::kFound) << "its port was not asked for";
    EXPECT_EQ(find({"usb-1-1", ""}), CameraMatch::kFound) << "its serial was not asked for";
    EXPECT_EQ(find({"", "third"}), CameraMatch::kAbsent);
}

TEST_F(VideoNodes, TheOnlyCameraNeedsNoNameAndOneOfTwoDoes) {
    machine_.plug_in(4, "1-1", "", {});
    EXPECT_EQ(find({}), CameraMatch::kFound);
    machine_.plug_in(5, "1-2", "", {});
    EXPECT_EQ(find({}), CameraMatch::kAmbiguous);
    EXPECT_EQ(find({"usb-1-2", ""}), CameraMatch::kFound);
}

TEST_F(VideoNodes, ANodeWithoutADeviceIsKnownByItsName) {
    const std::filesystem::path entry =
        std::filesystem::path(machine_.tree().sysfs) / "class/video4linux/video9";
    std::filesystem::create_directories(entry);
    std::ofstream(entry / "name") << "loop\n";
    std::string device;
    EXPECT_EQ(find({"loop", ""}, &device), CameraMatch::kFound);
    EXPECT_TRUE(device.ends_with("video9"));
}

TEST_F(VideoNodes, LongTextsAreCutNotOverrun) {
    ShortText<8> text;
    text.set("0123456789");
    EXPECT_EQ(text.view(), "0123456");
    machine_.plug_in(0, "1-1", std::string(500, 's'), {});
    EXPECT_EQ(nodes().at(0).serial.view(), std::string(63, 's'));
}

}  // namespace
}  // namespace rig::test
