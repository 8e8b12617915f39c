#include "firmware_host/take_log/observation_log.hpp"

#include <gtest/gtest.h>

#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <limits>

#include "core/wire/crc32c.hpp"
#include "tests/support/random.hpp"
#include "tests/support/temp_folder.hpp"

namespace rig::test {
namespace {

ObservationLogHeader header() {
    ObservationLogHeader result;
    result.camera_count = 2;
    result.rate_millihertz = 60'000;
    result.stabilise = false;
    result.camera_on_head = false;
    result.loss_policy = 1;
    result.pack_hash.fill(std::byte{0x5C});
    result.smoothing.delay_frames = 4;
    result.smoothing.shapes[1] = {FilterKind::kNone};
    result.smoothing.shapes[2] = {FilterKind::kSavitzkyGolay, 61};
    return result;
}

std::vector<Observation> dots(std::size_t count, SeededRandom& random) {
    std::vector<Observation> result(count);
    for (Observation& dot : result) {
        dot = {static_cast<float>(random.uniform(0, 640)),
               static_cast<float>(random.uniform(0, 480)),
               8.0F,
               0.5F,
               0.9F,
               0.3F};
    }
    return result;
}

std::string contents(const std::filesystem::path& path) {
    std::ifstream file(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
}

ByteSpan bytes_of(const std::string& text) {
    return std::as_bytes(std::span(text));
}

template <class T>
T number_at(const std::string& text, std::size_t at) {
    T value;
    std::memcpy(&value, text.data() + at, sizeof(T));
    return value;
}

// A log of two cameras as it was written before observations had a sigma_px.
std::string of_second_version(const std::string& text) {
    std::string result = text.substr(0, kObservationLogHeaderBytes);
    result[4] = 2;
    for (std::size_t begin = result.size(); begin < text.size();) {
        const auto length = number_at<std::uint32_t>(text, begin);
        std::size_t at = begin + kObservationRecordHeadBytes;
        std::string record = text.substr(begin, kObservationRecordHeadBytes);
        for (int camera = 0; camera < 2; ++camera) {
            const auto count = number_at<std::uint16_t>(text, at);
            record += text.substr(at, sizeof(count));
            at += sizeof(count);
            for (int i = 0; i < count; ++i, at += kObservationBytes) record += text.substr(at, 20);
        }
        const std::size_t rest = begin + length - sizeof(std::uint32_t) - at;
        record += text.substr(at, rest);
        const auto new_length = static_cast<std::uint32_t>(record.size() + sizeof(std::uint32_t));
        std::memcpy(record.data(), &new_length, sizeof(new_length));
        const std::uint32_t sum = crc32c(std::as_bytes(std::span(record)));
        record.append(reinterpret_cast<const char*>(&sum), sizeof(sum));
        result += record;
        begin += length;
    }
    return result;
}

class ObservationLogTest : public testing::Test {
  protected:
    // Twenty ticks with 0 .. kMaxObservations dots.
    void write(int ticks = 20) {
        controls_.shapes[3] = {2.0F, 3.0F, 0.5F, -1.0F, 0.125F, -0.5F, 0.75F};
        controls_.symmetry.clear();
        controls_.cancel.clear();
        ASSERT_TRUE(controls_.symmetry.push_back({1, 2, 8.0F}) && controls_.cancel.push_back({4, 5}) &&
                    controls_.cancel.push_back({255, 0}));
        auto writer = ObservationLogWriter::create(path_, header());
        ASSERT_TRUE(writer.has_value());
        for (int i = 0; i < ticks; ++i) {
            left_.push_back(dots(random_.below(kMaxObservations + 1), random_));
            right_.push_back(dots(random_.below(60), random_));
            ObservationTick tick;
            tick.number = static_cast<std::uint32_t>(i);
            tick.capture_us = 1'000'000 + 16'667 * i;
            tick.reset_before = i == 7;
            tick.neutral_before = i == 3;
            tick.neutral_forgotten_before = i == 3 || i == 9;
            if (i % 5 == 2) tick.new_controls = &controls_;
            tick.status = {CameraStatus::kGood, CameraStatus::kExposure, CameraStatus::kGone,
                           CameraStatus::kGone};
            tick.cameras = {left_.back(), right_.back()};
            (*writer)->append(tick);
            if (i % 3 == 0) {
                EXPECT_TRUE((*writer)->drain());
            }
        }
        EXPECT_EQ((*writer)->dropped(), 0U);
    }
    TempFolder folder_;
    std::string path_ = folder_ / "take.rgo";
    SeededRandom random_{5};
    ControlSet controls_;
    std::vector<std::vector<Observation>> left_;
    std::vector<std::vector<Observation>> right_;
};

TEST_F(ObservationLogTest, WhatIsWrittenIsRead) {
    write();
    const std::string text = contents(path_);
    auto reader = ObservationLogReader::open(bytes_of(text));
    ASSERT_TRUE(reader.has_value());
    EXPECT_EQ(reader->header(), header());
    for (std::uint32_t i = 0; i < 20; ++i) {
        ASSERT_FALSE(reader->at_end());
        const auto tick = reader->next();
        ASSERT_TRUE(tick.has_value());
        EXPECT_EQ(tick->number, i);
        EXPECT_EQ(tick->capture_us, 1'000'000 + 16'667 * i);
        EXPECT_EQ(tick->reset_before, i == 7);
        EXPECT_EQ(tick->neutral_before, i == 3);
        EXPECT_EQ(tick->neutral_forgotten_before, i == 3 || i == 9);
        ASSERT_EQ(tick->new_controls != nullptr, i % 5 == 2);
        if (tick->new_controls != nullptr) {
            EXPECT_EQ(tick->new_controls->shapes, controls_.shapes);
            ASSERT_EQ(tick->new_controls->symmetry.size(), 1U);
            EXPECT_EQ(tick->new_controls->symmetry[0], controls_.symmetry[0]);
            ASSERT_EQ(tick->new_controls->cancel.size(), 2U);
            EXPECT_EQ(tick->new_controls->cancel[1], controls_.cancel[1]);
        }
        EXPECT_EQ(tick->status[1], CameraStatus::kExposure);
        EXPECT_EQ(tick->status[2], CameraStatus::kUnused);  // beyond the count
        ASSERT_EQ(tick->cameras[0].size(), left_[i].size());
        ASSERT_EQ(tick->cameras[1].size(), right_[i].size());
        for (std::size_t k = 0; k < left_[i].size(); ++k) {
            EXPECT_EQ(tick->cameras[0][k].x_px, left_[i][k].x_px);
            EXPECT_EQ(tick->cameras[0][k].score, left_[i][k].score);
            EXPECT_EQ(tick->cameras[0][k].sigma_px, left_[i][k].sigma_px);
        }
    }
    EXPECT_TRUE(reader->at_end());
}

TEST_F(ObservationLogTest, TheSecondVersionIsRead) {
    write(4);
    const std::string text = of_second_version(contents(path_));
    auto reader = ObservationLogReader::open(bytes_of(text));
    ASSERT_TRUE(reader.has_value());
    for (std::size_t i = 0; i < 4; ++i) {
        const auto tick = reader->next();
        ASSERT_TRUE(tick.has_value());
        ASSERT_EQ(tick->cameras[0].size(), left_[i].size());
        for (std::size_t k = 0; k < left_[i].size(); ++k) {
            EXPECT_EQ(tick->cameras[0][k].score, left_[i][k].score);
            EXPECT_EQ(tick->cameras[0][k].sigma_px, 0.0F);
        }
    }
    EXPECT_TRUE(reader->at_end());
}

// Version 1 ended its header at byte 64 and knew One Euro only.
TEST_F(ObservationLogTest, TheFirstVersionIsRead) {
    write(4);
    std::string text = of_second_version(contents(path_));
    text.erase(64, kMaxShapes);
    text[4] = 1;
    text[48] = 0;
    auto reader = ObservationLogReader::open(bytes_of(text));
    ASSERT_TRUE(reader.has_value());
    EXPECT_EQ(reader->header().smoothing, FilterChoice{});
    int ticks = 0;
    for (; !reader->at_end(); ++ticks) ASSERT_TRUE(reader->next().has_value());
    EXPECT_EQ(ticks, 4);
    text[48] = 4;
    EXPECT_FALSE(ObservationLogReader::open(bytes_of(text)).has_value());
}

TEST_F(ObservationLogTest, ImpossibleSmoothingIsNoLog) {
    write(1);
    for (const auto& [at, value] : {std::pair{48, 61}, {64, 2}, {64, 4}, {300, 62}}) {
        std::string text = contents(path_);
        text[static_cast<std::size_t>(at)] = static_cast<char>(value);
        EXPECT_EQ(ObservationLogReader::open(bytes_of(text)).error(), ObservationLogError::kFormat) << at;
    }
}

TEST_F(ObservationLogTest, EveryTruncationKeepsTheWholeRecordsBeforeIt) {
    write(4);
    const std::string text = contents(path_);
    for (std::size_t size = 0; size < text.size(); ++size) {
        const std::string cut = text.substr(0, size);
        auto reader = ObservationLogReader::open(bytes_of(cut));
        if (size < kObservationLogHeaderBytes) {
            EXPECT_EQ(reader.error(), ObservationLogError::kCut);
            continue;
        }
        ASSERT_TRUE(reader.has_value());
        std::uint32_t good = 0;
        while (!reader->at_end()) {
            const auto tick = reader->next();
            if (!tick) {
                EXPECT_EQ(tick.error(), ObservationLogError::kCut);
                break;
            }
            EXPECT_EQ(tick->number, good++);
        }
        EXPECT_LE(good, 4U);
    }
}

TEST_F(ObservationLogTest, EveryFlippedBitOfARecordIsNoticed) {
    write(1);
    std::string text = contents(path_);
    for (std::size_t at = kObservationLogHeaderBytes; at < text.size(); ++at) {
        for (int bit = 0; bit < 8; bit += 3) {
            text[at] = static_cast<char>(text[at] ^ (1 << bit));
            auto reader = ObservationLogReader::open(bytes_of(text));
            ASSERT_TRUE(reader.has_value());
            EXPECT_FALSE(reader->next().has_value());
            text[at] = static_cast<char>(text[at] ^ (1 << bit));
        }
    }
}

TEST_F(ObservationLogTest, OtherFilesAreRefused) {
    write(1);
    const std::string good = contents(path_);
    const auto with = [&](std::size_t at, char value) {
        std::string text = good;
        text[at] = value;
        return ObservationLogReader::open(bytes_of(text)).has_value();
    };
    EXPECT_FALSE(with(0, 'X'));
    EXPECT_FALSE(with(4, 4));  // version
    EXPECT_FALSE(with(6, 0));  // cameras
    EXPECT_FALSE(with(6, 5));
    EXPECT_FALSE(with(7, 1));     // reserved
    EXPECT_FALSE(with(11, 127));  // rate
    EXPECT_FALSE(with(12, 8));    // loss policy
    EXPECT_FALSE(with(63, 1));    // reserved
}

TEST_F(ObservationLogTest, AFullBufferDropsTicksAndSaysSo) {
    auto writer = ObservationLogWriter::create(path_, header());
    ASSERT_TRUE(writer.has_value());
    const auto many = dots(kMaxObservations, random_);
    ObservationTick tick;
    tick.cameras = {many, many};
    for (; tick.number < 2000; ++tick.number) (*writer)->append(tick);
    const std::uint64_t dropped = (*writer)->dropped();
    EXPECT_GT(dropped, 0U);
    EXPECT_TRUE((*writer)->drain());
    (*writer)->append(tick);  // there is room again
    writer->reset();
    const std::string text = contents(path_);
    auto reader = ObservationLogReader::open(bytes_of(text));
    std::uint64_t read = 0;
    for (; !reader->at_end(); ++read) ASSERT_TRUE(reader->next().has_value());
    EXPECT_EQ(read, 2001 - dropped);
}

TEST_F(ObservationLogTest, AFullDiskEndsTheLogOnly) {
    auto writer = ObservationLogWriter::create("/dev/full", header());
    EXPECT_EQ(writer.error(), ObservationLogError::kOpen);
    EXPECT_EQ(ObservationLogWriter::create(folder_ / "no/such/folder", header()).error(),
              ObservationLogError::kOpen);
}

}  // namespace
}  // namespace rig::test
