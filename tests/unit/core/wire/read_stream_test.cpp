// scripts/read_stream.py, written from PROTOCOL.md alone, reads what the code writes.
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include "core/wire/state_messages.hpp"
#include "tests/support/wire/golden_frames.hpp"
#include "tests/support/wire/messages.hpp"

namespace {

using namespace rig;
using Bytes = std::vector<std::byte>;

// Lines that the script prints for these bytes; empty when it could not be run.
std::vector<std::string> printed(const Bytes& bytes) {
    const std::string path = testing::TempDir() + "rig_read_stream_" + std::to_string(getpid()) + ".bin";
    std::ofstream(path, std::ios::binary)
        .write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
    FILE* pipe = popen(("python3 scripts/read_stream.py " + path).c_str(), "r");
    std::string text;
    char buffer[4096];
    for (std::size_t got = 0; (got = fread(buffer, 1, sizeof buffer, pipe)) > 0;) text.append(buffer, got);
    pclose(pipe);
    std::remove(path.c_str());
    std::vector<std::string> lines;
    std::istringstream stream(text);
    for (std::string line; std::getline(stream, line);) lines.push_back(line);
    return lines;
}

bool has_python() {
    return std::system("python3 -c '' 2>/dev/null") == 0;
}

TEST(ReadStream, HasAtMostSixtyLines) {
    std::ifstream script("scripts/read_stream.py");
    const std::string text((std::istreambuf_iterator<char>(script)), std::istreambuf_iterator<char>());
    EXPECT_GT(text.size(), 0U);
    EXPECT_LE(std::count(text.begin(), text.end(), '\n'), 60);
}

TEST(ReadStream, PrintsTheGoldenFrames) {
    if (!has_python()) GTEST_SKIP() << "no python3";
    const auto lines = printed(test::golden_stream(test::load_golden_frames()));
    ASSERT_EQ(lines.size(), 20U);
    const auto has = [&](const std::string& wanted) {
        EXPECT_TRUE(std::find(lines.begin(), lines.end(), wanted) != lines.end()) << wanted;
    };
    has("1 2 hello 0.1.0 rig-0001 sim");
    has("0 5 time request 40 42 0f 00 00 00 00 00");
    has("1 8 weights state 1000 capture_us 16666667 age_us 8300 faults 0x4000 partial shapes 0+3/3: 0.0000 "
        "1.0000 -0.2500");
    has("1 10 markers state 1000 capture_us 16666667 markers 2 first 0 count 2");
    has("1 11 status up 60000000 us, ticks 3600 solved 3590 held 10 overruns 2 sent 3599 dropped 1");
    has("1 20 head pose state 1000 capture_us 16666667 status 1 turn 0.0625 -0.1250 0.0000 place 10.50 -3.00 "
        "40.25");
    has("1 12 event camera 1 is gone");
    EXPECT_TRUE(std::any_of(lines.begin(), lines.end(), [](const std::string& line) {
        return line.starts_with("0 19 control 01 01 02");
    }));
}

TEST(ReadStream, ReadsTheLargestFramesAndSkipsDamage) {
    if (!has_python()) GTEST_SKIP() << "no python3";
    FaceState state;
    state.shape_count = kMaxShapes;
    for (std::size_t i = 0; i < kMaxShapes; ++i) state.weights[i] = static_cast<float>(i) / 256.0F;
    Bytes stream{std::byte{7}, std::byte{8}};
    std::uint32_t frames = 0;
    for (std::size_t part = 0; part < kMaxWeightsParts; ++part) {
        std::array<std::byte, kMaxWirePayloadBytes> payload;
        const std::size_t size = encode_weights(state, part, payload).value();
        const FrameHead head{MessageType::kWeights, 0, kSourceBoard, frames++};
        const Bytes good = test::framed(head, ByteSpan(payload).first(size));
        Bytes bad = good;
        bad[30] ^= std::byte{0x10};
        stream.insert(stream.end(), bad.begin(), bad.end());
        stream.insert(stream.end(), good.begin(), good.end());
    }
    const auto lines = printed(stream);
    ASSERT_EQ(lines.size(), 2U);
    EXPECT_NE(lines[0].find("shapes 0+191/256: 0.0000 0.0039"), std::string::npos) << lines[0];
    EXPECT_NE(lines[1].find("shapes 191+65/256: 0.7461"), std::string::npos) << lines[1];
    EXPECT_TRUE(lines[1].ends_with(" 0.9961")) << lines[1];
}

}  // namespace
