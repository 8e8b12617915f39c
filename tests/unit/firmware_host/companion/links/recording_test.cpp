#include "firmware_host/companion/links/recording.hpp"

#include <gtest/gtest.h>

#include <fstream>

#include "core/wire/state_messages.hpp"
#include "firmware_host/companion/files/whole_file.hpp"
#include "tests/support/temp_folder.hpp"
#include "tests/support/wire/golden_frames.hpp"
#include "tests/support/wire/messages.hpp"

namespace {

using namespace rig;
using namespace rig::host;
using Bytes = std::vector<std::byte>;

// The golden frames of PROTOCOL.md, one each millisecond.
Bytes golden_recording(const std::filesystem::path& path) {
    auto writer = RecordingWriter::create(path);
    EXPECT_TRUE(writer.has_value());
    std::int64_t now_us = -1000;
    for (const auto& golden : test::load_golden_frames()) {
        EXPECT_TRUE(writer->add(golden.bytes, now_us).has_value());
        now_us += 1000;
    }
    EXPECT_TRUE(writer->close().has_value());
    return read_whole_file(path).value();
}

TEST(Recording, ComesBackFrameByFrame) {
    const test::TempFolder folder;
    (void)golden_recording(folder / "a.rec");
    auto reader = RecordingReader::open(folder / "a.rec");
    ASSERT_TRUE(reader.has_value());
    std::int64_t now_us = -1000;
    for (const auto& golden : test::load_golden_frames()) {
        const auto entry = reader->next();
        ASSERT_TRUE(entry.has_value());
        EXPECT_EQ(entry->received_us, now_us);
        EXPECT_EQ(Bytes(entry->frame.begin(), entry->frame.end()), golden.bytes);
        now_us += 1000;
    }
    EXPECT_FALSE(reader->next().has_value());
    EXPECT_EQ(reader->unread_bytes(), 0U);
}

TEST(Recording, CutAnywhereItYieldsWhatIsWhole) {
    const test::TempFolder folder;
    const Bytes whole = golden_recording(folder / "a.rec");
    std::size_t most = 0;
    for (std::size_t size = 8; size <= whole.size(); ++size) {
        auto reader = RecordingReader::parse(
            Bytes(whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(size)), "a");
        ASSERT_TRUE(reader.has_value());
        std::size_t frames = 0;
        std::size_t bytes = 8;
        while (const auto entry = reader->next()) {
            ++frames;
            bytes += entry->frame.size() + 14;
        }
        ASSERT_GE(frames, most) << "a longer file never holds less";
        ASSERT_EQ(reader->unread_bytes(), size - bytes);
        most = frames;
    }
    EXPECT_EQ(most, test::load_golden_frames().size());
}

TEST(Recording, EveryFlippedBitEndsTheReadingAtItsEntry) {
    const test::TempFolder folder;
    const Bytes whole = golden_recording(folder / "a.rec");
    for (std::size_t bit = 64; bit < whole.size() * 8; bit += 7) {
        Bytes damaged = whole;
        damaged[bit / 8] ^= static_cast<std::byte>(1U << (bit % 8));
        auto reader = RecordingReader::parse(damaged, "a");
        ASSERT_TRUE(reader.has_value());
        while (reader->next()) {
        }
        ASSERT_GT(reader->unread_bytes(), 0U) << bit;
        ASSERT_GE(damaged.size() - reader->unread_bytes(), 8U);
        ASSERT_LE(damaged.size() - reader->unread_bytes(), bit / 8)
            << "an entry with a damaged byte was read";
    }
}

TEST(Recording, OtherFilesAreRefusedByName) {
    const test::TempFolder folder;
    EXPECT_NE(RecordingReader::open(folder / "none.rec").error().message.find("none.rec"), std::string::npos);
    for (const char* text : {"", "RIGREC0", "RIGREC02", "frame,time_s"}) {
        std::ofstream(folder / "bad.rec") << text;
        const auto reader = RecordingReader::open(folder / "bad.rec");
        ASSERT_FALSE(reader.has_value()) << text;
        EXPECT_NE(reader.error().message.find("bad.rec"), std::string::npos);
    }
    EXPECT_FALSE(RecordingWriter::create(folder / "no" / "a.rec").has_value());
}

TEST(Recording, SummaryCountsStatesAndGapsWhateverTheDivider) {
    const test::TempFolder folder;
    auto writer = RecordingWriter::create(folder / "s.rec");
    ASSERT_TRUE(writer.has_value());
    for (std::uint32_t i = 0; i < 40; ++i) {
        if (i == 10 || i == 11 || i == 30) continue;
        FaceState state;
        state.sequence = i * 3;
        std::array<std::byte, kMaxWirePayloadBytes> payload;
        const auto size = encode_weights(state, 0, payload);
        const FrameHead head{MessageType::kWeights, 0, kSourceBoard, i};
        ASSERT_TRUE(
            writer->add(test::framed(head, ByteSpan(payload).first(*size)), i * 50'000LL).has_value());
    }
    ASSERT_TRUE(writer->add(std::array<std::byte, 4>{}, 3'000'000).has_value());
    ASSERT_TRUE(writer->close().has_value());
    auto reader = RecordingReader::open(folder / "s.rec");
    ASSERT_TRUE(reader.has_value());
    const RecordingSummary summary = summarise(*reader);
    EXPECT_EQ(summary.states, 37U);
    EXPECT_EQ(summary.states_missing, 3U);
    EXPECT_EQ(summary.bad_frames, 1U);
    EXPECT_DOUBLE_EQ(summary.seconds, 3.0);
}

TEST(Recording, SummaryOfTheGoldenFrames) {
    const test::TempFolder folder;
    (void)golden_recording(folder / "a.rec");
    auto reader = RecordingReader::open(folder / "a.rec");
    const RecordingSummary summary = summarise(*reader);
    ASSERT_TRUE(summary.hello.has_value());
    EXPECT_EQ(summary.hello->serial.view(), "rig-0001");
    EXPECT_EQ(summary.frames, test::load_golden_frames().size());
    EXPECT_EQ(summary.states, 1U);
    EXPECT_TRUE(summary.shape_names.empty()) << "the golden page begins at name 10";
}

}  // namespace
