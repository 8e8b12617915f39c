// The camera backend against a driver that misbehaves in every way that is known of one.
#include "hal/linux/v4l2/v4l2_frame_source.hpp"

#include <gtest/gtest.h>
#include <linux/videodev2.h>

#include <cerrno>
#include <memory>

#include "tests/contract/hal/fake_camera.hpp"

namespace rig::test {
namespace {

constexpr int kNode = 3;
constexpr std::int64_t kPeriod_us = 10'000;

std::vector<std::uint8_t> flat(std::uint32_t n) {
    return std::vector<std::uint8_t>(8 * 6, static_cast<std::uint8_t>(n));
}

class V4l2Camera : public testing::Test {
  protected:
    sim::ManualClock clock_{5'000'000};
    FakeVideoMachine machine_{clock_};
    std::unique_ptr<V4l2FrameSource> camera_;

    static FakeSensor grey_sensor() {
        FakeSensor sensor;
        sensor.picture = flat;
        return sensor;
    }
    V4l2CameraConfig config() const {
        V4l2CameraConfig wanted;
        wanted.camera = {"usb-1-2", "A17"};
        wanted.width_px = 8;
        wanted.height_px = 6;
        wanted.rate_hz = 100.0;
        wanted.tree = machine_.tree();
        return wanted;
    }
    V4l2FrameSource& plugged(FakeSensor sensor) { return plugged(std::move(sensor), config()); }
    V4l2FrameSource& plugged(FakeSensor sensor, V4l2CameraConfig wanted) {
        machine_.plug_in(kNode, "1-2", "A17", std::move(sensor));
        camera_ = std::make_unique<V4l2FrameSource>(clock_, std::move(wanted));
        return *camera_;
    }
    Result<CameraFrame, FrameError> next() { return camera_->wait_frame(clock_.now_us() + 10 * kPeriod_us); }
    bool says(std::string_view part) const { return camera_->trouble().find(part) != std::string_view::npos; }
};

TEST_F(V4l2Camera, TheLayoutThatNeedsLeastIsTaken) {
    FakeSensor sensor = grey_sensor();
    sensor.layouts = {PixelLayout::kJpeg, PixelLayout::kYuyv, PixelLayout::kGrey};
    ASSERT_TRUE(plugged(sensor).start().has_value());
    EXPECT_EQ(camera_->mode().layout, PixelLayout::kGrey);
    camera_->stop();
    V4l2CameraConfig wanted = config();
    wanted.layout = PixelLayout::kYuyv;
    camera_ = std::make_unique<V4l2FrameSource>(clock_, wanted);
    ASSERT_TRUE(camera_->start().has_value());
    EXPECT_EQ(camera_->mode().layout, PixelLayout::kYuyv);
}

TEST_F(V4l2Camera, HighBytesAreTakenFromSixteenBits) {
    FakeSensor sensor = grey_sensor();
    sensor.layouts = {PixelLayout::kY16};
    sensor.picture = [](std::uint32_t) {
        std::vector<std::uint8_t> bytes;
        for (std::uint8_t i = 0; i < 48; ++i) bytes.insert(bytes.end(), {0xFF, i});
        return bytes;
    };
    ASSERT_TRUE(plugged(sensor).start().has_value());
    const auto frame = next();
    ASSERT_TRUE(frame.has_value());
    for (int y = 0; y < 6; ++y) {
        for (int x = 0; x < 8; ++x) EXPECT_EQ(frame->image.row(y)[x], 8 * y + x);
    }
}

TEST_F(V4l2Camera, WhatItCannotDoIsSaidBeforeItStreams) {
    FakeSensor sensor = grey_sensor();
    sensor.width_px = 16;
    EXPECT_EQ(plugged(sensor).start().error(), FrameError::kRefused);
    EXPECT_TRUE(says("does not give 8 x 6 at 100 Hz") && says("16 x 6")) << camera_->trouble();
    EXPECT_EQ(machine_.open_nodes(), 0);
    sensor.width_px = 8;
    sensor.rate_hz = 25.0;
    machine_.unplug(kNode);
    EXPECT_EQ(plugged(sensor).start().error(), FrameError::kRefused);
    EXPECT_TRUE(says("at 25 Hz")) << camera_->trouble();
    machine_.unplug(kNode);
    sensor.tells_rate = false;
    ASSERT_TRUE(plugged(sensor).start().has_value()) << "many drivers do not tell";
    EXPECT_EQ(camera_->start()->rate_hz, 100.0);
    machine_.unplug(kNode);
    sensor.buffers = 2;
    EXPECT_FALSE(plugged(sensor).start().has_value());
    EXPECT_TRUE(says("does not start")) << camera_->trouble();
}

TEST_F(V4l2Camera, BoardControlsAreSetOrRefusedByName) {
    FakeSensor sensor = grey_sensor();
    sensor.controls = {{0x009a0901, {0, 3}}, {V4L2_CID_AUTOGAIN, {0, 1}}};
    V4l2CameraConfig wanted = config();
    wanted.controls = {{0x009a0901, 2}};
    ASSERT_TRUE(plugged(sensor, wanted).start().has_value()) << camera_->trouble();
    EXPECT_EQ(machine_.control(kNode, 0x009a0901), 2);
    EXPECT_EQ(machine_.control(kNode, V4L2_CID_AUTOGAIN), 0) << "the rig sets the light, not the camera";
    wanted.controls = {{0x009a0902, 1}};
    camera_ = std::make_unique<V4l2FrameSource>(clock_, wanted);
    EXPECT_EQ(camera_->start().error(), FrameError::kRefused);
    EXPECT_TRUE(says("0x009a0902 = 1")) << camera_->trouble();
}

TEST_F(V4l2Camera, BadFramesAreNamedAndTheirBuffersAreNotLost) {
    FakeSensor sensor = grey_sensor();
    sensor.fates = {{1, FrameFate::kDamaged},  {2, FrameFate::kShort},         {3, FrameFate::kEmpty},
                    {4, FrameFate::kOverLong}, {5, FrameFate::kTransferError}, {7, FrameFate::kLost}};
    ASSERT_TRUE(plugged(sensor).start().has_value());
    const auto good = [&](std::uint32_t sequence) {
        const auto frame = next();
        ASSERT_TRUE(frame.has_value()) << sequence;
        EXPECT_EQ(frame->sequence, sequence);
        EXPECT_EQ(frame->image.row(5)[7], sequence);
        camera_->release(frame->token);
    };
    good(0);
    EXPECT_EQ(next().error(), FrameError::kDamaged);
    EXPECT_EQ(next().error(), FrameError::kShort);
    EXPECT_EQ(next().error(), FrameError::kShort);
    EXPECT_EQ(next().error(), FrameError::kShort);
    EXPECT_EQ(next().error(), FrameError::kIo);
    good(6);
    good(8);
    EXPECT_EQ(machine_.queued(kNode), os::CaptureDevice::kBuffers);
}

TEST_F(V4l2Camera, CompressedFramesThatAreNoneAreNamed) {
    FakeSensor sensor = grey_sensor();
    sensor.layouts = {PixelLayout::kJpeg};
    ASSERT_TRUE(plugged(sensor).start().has_value());
    EXPECT_EQ(next().error(), FrameError::kCorrupt);
    EXPECT_EQ(machine_.queued(kNode), os::CaptureDevice::kBuffers);
}

TEST_F(V4l2Camera, CountersMayWrap) {
    FakeSensor sensor = grey_sensor();
    sensor.first_sequence = 0xFFFFFFFEU;
    ASSERT_TRUE(plugged(sensor).start().has_value());
    for (std::uint32_t i = 0; i < 4; ++i) {
        const auto frame = next();
        ASSERT_TRUE(frame.has_value());
        EXPECT_EQ(frame->sequence, 0xFFFFFFFEU + i);
        camera_->release(frame->token);
    }
}

TEST_F(V4l2Camera, StampsMeanTheMiddleOfTheExposure) {
    FakeSensor sensor = grey_sensor();
    sensor.controls = {{V4L2_CID_EXPOSURE_ABSOLUTE, {1, 90}}};
    V4l2CameraConfig wanted = config();
    wanted.readout_us = 700;
    ASSERT_TRUE(plugged(sensor, wanted).start().has_value());
    ASSERT_TRUE(camera_->set_exposure_us(4'020).has_value());
    EXPECT_EQ(machine_.control(kNode, V4L2_CID_EXPOSURE_ABSOLUTE), 40) << "in units of 100 us";
    EXPECT_EQ(next()->capture_us, 5'000'000 + kPeriod_us - 2'000 - 700);
    EXPECT_EQ(camera_->set_exposure_us(9'900).error(), FrameError::kRefused) << "beyond the sensor's range";
    sensor.stamps_start = true;
    machine_.unplug(kNode);
    plugged(sensor, wanted);
    const std::int64_t started_us = clock_.now_us();
    ASSERT_TRUE(camera_->start().has_value());
    ASSERT_TRUE(camera_->set_exposure_us(4'000).has_value());
    EXPECT_EQ(next()->capture_us, started_us + kPeriod_us + 2'000);
}

TEST_F(V4l2Camera, GainByStepsOfDecibelsOrInProportion) {
    FakeSensor sensor = grey_sensor();
    sensor.controls = {{V4L2_CID_GAIN, {16, 255}}};
    ASSERT_TRUE(plugged(sensor).start().has_value());
    EXPECT_EQ(camera_->set_gain_db(6.0F).error(), FrameError::kRefused) << "nobody said what a step is";
    V4l2CameraConfig wanted = config();
    wanted.gain.unity = 16.0;
    camera_ = std::make_unique<V4l2FrameSource>(clock_, wanted);
    ASSERT_TRUE(camera_->start().has_value());
    ASSERT_TRUE(camera_->set_gain_db(6.0206F).has_value());
    EXPECT_EQ(machine_.control(kNode, V4L2_CID_GAIN), 32);
    EXPECT_EQ(camera_->set_gain_db(25.0F).error(), FrameError::kRefused);
    wanted.gain = {.unit_db = 0.5};
    camera_ = std::make_unique<V4l2FrameSource>(clock_, wanted);
    ASSERT_TRUE(camera_->start().has_value());
    ASSERT_TRUE(camera_->set_gain_db(10.0F).has_value());
    EXPECT_EQ(machine_.control(kNode, V4L2_CID_GAIN), 36);
}

TEST_F(V4l2Camera, UnpluggedIsGoneAndNothingIsKept) {
    ASSERT_TRUE(plugged(grey_sensor()).start().has_value());
    const auto held = next();
    ASSERT_TRUE(held.has_value());
    machine_.unplug(kNode);
    EXPECT_EQ(next().error(), FrameError::kGone);
    EXPECT_EQ(held->image.row(0)[0], 0) << "what was borrowed stays readable until stop()";
    camera_->release(held->token);
    camera_->stop();
    EXPECT_EQ(machine_.mappings(), 0);
    EXPECT_EQ(machine_.open_nodes(), 0);
    EXPECT_EQ(camera_->start().error(), FrameError::kGone);
    EXPECT_TRUE(says("no camera is plugged in at usb-1-2 (serial A17)")) << camera_->trouble();
}

TEST_F(V4l2Camera, FiftyTimesUnpluggedAndBackAsAnotherNode) {
    plugged(grey_sensor());
    for (int round = 0; round < 50; ++round) {
        ASSERT_TRUE(camera_->start().has_value()) << camera_->trouble();
        const auto frame = next();
        ASSERT_TRUE(frame.has_value());
        const int node = round == 0 ? kNode : 10 + round % 7;
        machine_.unplug(node);
        EXPECT_EQ(next().error(), FrameError::kGone);
        camera_->stop();
        camera_->release(frame->token);  // of an earlier stream: means nothing
        EXPECT_EQ(machine_.mappings(), 0);
        EXPECT_EQ(machine_.open_nodes(), 0);
        machine_.plug_in(10 + (round + 1) % 7, "1-2", "A17", grey_sensor());
    }
}

TEST_F(V4l2Camera, AnotherCameraInItsPlaceIsRefused) {
    machine_.plug_in(0, "1-2", "B4", grey_sensor());
    camera_ = std::make_unique<V4l2FrameSource>(clock_, config());
    EXPECT_EQ(camera_->start().error(), FrameError::kIdentity);
    EXPECT_TRUE(says("another camera is plugged in at usb-1-2 than the one with serial A17"))
        << camera_->trouble();
}

TEST_F(V4l2Camera, ASecondProgramIsToldSo) {
    ASSERT_TRUE(plugged(grey_sensor()).start().has_value());
    V4l2FrameSource second(clock_, config());
    EXPECT_EQ(second.start().error(), FrameError::kIo);
    EXPECT_NE(second.trouble().find("another program"), std::string_view::npos) << second.trouble();
    EXPECT_TRUE(next().has_value()) << "the first goes on";
}

TEST_F(V4l2Camera, StalledCamerasKeepTheDeadline) {
    FakeSensor sensor = grey_sensor();
    sensor.frame_total = 1;
    ASSERT_TRUE(plugged(sensor).start().has_value());
    ASSERT_TRUE(next().has_value());
    for (const std::int64_t patience_us : {0, 1, 999, 1'000, 1'500, 25'300}) {
        const std::int64_t deadline_us = clock_.now_us() + patience_us;
        EXPECT_EQ(camera_->wait_frame(deadline_us).error(), FrameError::kTimeout);
        EXPECT_LE(clock_.now_us(), deadline_us);
        EXPECT_GT(clock_.now_us(), deadline_us - 1'000) << "given up early";
    }
}

// Every call that the backend makes fails once, with every error that drivers give: an answer of the
// contract, nothing leaks, and afterwards the camera works.
TEST_F(V4l2Camera, AnyCallMayFailOnce) {
    FakeSensor sensor = grey_sensor();
    sensor.controls = {{V4L2_CID_EXPOSURE_ABSOLUTE, {1, 90}}};
    plugged(sensor);
    int failures = 0;
    for (const int error_number : {EIO, ENODEV, EBUSY, EINVAL, EACCES, ENOMEM, EPROTO, EAGAIN, EINTR}) {
        bool hit = true;
        for (std::uint64_t nth = 0; hit; ++nth) {
            SCOPED_TRACE(testing::Message() << "errno " << error_number << " at call " << nth);
            machine_.fail_call(nth, error_number);
            bool whole = camera_->start().has_value();
            if (whole) static_cast<void>(camera_->set_exposure_us(2'000));
            for (int i = 0; whole && i < 2; ++i) {
                const auto frame = next();
                if (frame) camera_->release(frame->token);
                whole = frame.has_value();
            }
            camera_->stop();
            hit = machine_.has_failed();
            failures += whole ? 0 : 1;
            EXPECT_EQ(machine_.mappings(), 0);
            EXPECT_EQ(machine_.open_nodes(), 0);
            machine_.fail_call(~std::uint64_t{0}, 0);
            ASSERT_TRUE(camera_->start().has_value()) << camera_->trouble();
            ASSERT_TRUE(next().has_value());
            camera_->stop();
        }
    }
    EXPECT_GT(failures, 50);
}

}  // namespace
}  // namespace rig::test
