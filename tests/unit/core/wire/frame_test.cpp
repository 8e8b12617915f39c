#include "core/wire/frame.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "core/wire/crc32c.hpp"
#include "tests/support/wire/messages.hpp"

namespace {

using rig::ByteSpan;
using rig::FrameDecoder;
using rig::FrameHead;
using rig::FrameView;
using rig::MessageType;
using rig::test::framed;
using Bytes = std::vector<std::byte>;

struct Delivered {
    FrameHead head;
    Bytes payload;
};

std::vector<Delivered> feed(FrameDecoder& decoder, ByteSpan bytes) {
    std::vector<Delivered> out;
    FrameView frame;
    while (decoder.next(bytes, frame))
        out.push_back({frame.head, {frame.payload.begin(), frame.payload.end()}});
    EXPECT_TRUE(bytes.empty());
    return out;
}

Bytes ramp(std::size_t size, unsigned start = 1) {
    Bytes bytes(size);
    for (std::size_t i = 0; i < size; ++i) bytes[i] = static_cast<std::byte>(start + i);
    return bytes;
}

Bytes joined(std::initializer_list<Bytes> parts) {
    Bytes all;
    for (const Bytes& part : parts) all.insert(all.end(), part.begin(), part.end());
    return all;
}

// A frame with any head bytes and a right CRC.
Bytes hand_made(Bytes raw) {
    const std::uint32_t crc = rig::crc32c(raw);
    for (int shift = 0; shift < 32; shift += 8) raw.push_back(static_cast<std::byte>(crc >> shift));
    Bytes out{std::byte{0}};
    std::size_t code_at = out.size();
    out.push_back(std::byte{1});
    for (const std::byte byte : raw) {
        if (byte == std::byte{0}) {
            code_at = out.size();
            out.push_back(std::byte{1});
        } else {
            out.push_back(byte);
            out[code_at] = static_cast<std::byte>(std::to_integer<int>(out[code_at]) + 1);
        }
    }
    out.push_back(std::byte{0});
    return out;
}

TEST(Frame, EveryPayloadLengthComesBackWithinTheLimit) {
    for (const bool zeros : {false, true}) {
        for (std::size_t size = 0; size <= rig::kMaxWirePayloadBytes; ++size) {
            const Bytes payload = zeros ? Bytes(size) : Bytes(size, std::byte{0xFF});
            const FrameHead head{MessageType::kStatus, 0x5A, 7, 0xFFFFFFFFU};
            const Bytes bytes = framed(head, payload);
            ASSERT_LE(bytes.size(), rig::kMaxWireFrameBytes);
            ASSERT_EQ(std::count(bytes.begin(), bytes.end(), std::byte{0}), 2);
            FrameDecoder decoder;
            const auto out = feed(decoder, bytes);
            ASSERT_EQ(out.size(), 1U) << size;
            ASSERT_EQ(out[0].payload, payload);
            ASSERT_EQ(out[0].head.type, head.type);
            ASSERT_EQ(out[0].head.flags, head.flags);
            ASSERT_EQ(out[0].head.source, head.source);
            ASSERT_EQ(out[0].head.sequence, head.sequence);
        }
    }
}

TEST(Frame, LargestPayloadWithoutZerosFillsTheLargestFrame) {
    // head fields chosen without zero bytes: 0x0279 as length has none
    const Bytes bytes = framed({MessageType::kStatus, 1, 1, 0x01010101U}, Bytes(633, std::byte{1}));
    EXPECT_LE(bytes.size(), rig::kMaxWireFrameBytes);
    EXPECT_GE(bytes.size(), rig::kMaxWireFrameBytes - 4);
}

TEST(Frame, EncoderRefusesWhatDoesNotFit) {
    std::array<std::byte, rig::kMaxWireFrameBytes> buffer;
    const Bytes too_long(rig::kMaxWirePayloadBytes + 1);
    EXPECT_EQ(rig::encode_frame({}, too_long, buffer).error(), rig::WireError::kLength);
    const Bytes payload = ramp(100);
    const std::size_t size = framed({}, payload).size();
    for (std::size_t room = 0; room < size; ++room) {
        EXPECT_EQ(rig::encode_frame({}, payload, rig::MutableByteSpan(buffer).first(room)).error(),
                  rig::WireError::kSpace);
    }
    EXPECT_EQ(rig::encode_frame({}, payload, rig::MutableByteSpan(buffer).first(size)).value(), size);
}

TEST(FrameDecoder, DeliversTheSameForEveryTwoWaySplitAndByteByByte) {
    Bytes stream;
    for (unsigned i = 0; i < 5; ++i) {
        const Bytes one = framed({MessageType::kEvent, 0, 1, i}, ramp(i * 70, i));
        stream.insert(stream.end(), one.begin(), one.end());
    }
    for (std::size_t cut = 0; cut <= stream.size(); ++cut) {
        FrameDecoder decoder;
        auto out = feed(decoder, ByteSpan(stream).first(cut));
        const auto rest = feed(decoder, ByteSpan(stream).subspan(cut));
        out.insert(out.end(), rest.begin(), rest.end());
        ASSERT_EQ(out.size(), 5U) << cut;
        for (unsigned i = 0; i < 5; ++i) ASSERT_EQ(out[i].payload, ramp(i * 70, i));
        ASSERT_EQ(decoder.counters().bad(), 0U);
    }
    FrameDecoder decoder;
    std::size_t count = 0;
    for (const std::byte& byte : stream) count += feed(decoder, ByteSpan(&byte, 1)).size();
    EXPECT_EQ(count, 5U);
}

TEST(FrameDecoder, StartInMidFrameIsNoFault) {
    const Bytes frame = framed({}, ramp(50));
    for (std::size_t cut = 1; cut < frame.size(); ++cut) {
        FrameDecoder decoder;
        EXPECT_TRUE(feed(decoder, ByteSpan(frame).subspan(cut)).empty());
        EXPECT_EQ(feed(decoder, frame).size(), 1U);
        EXPECT_EQ(decoder.counters().bad(), 0U) << cut;
    }
}

TEST(FrameDecoder, CountsEachKindOfFaultOnce) {
    const Bytes good = framed({}, ramp(20));
    const auto after = [&](const Bytes& damaged) {
        FrameDecoder decoder;
        EXPECT_EQ(feed(decoder, joined({{std::byte{0}}, damaged, good})).size(), 1U);
        EXPECT_EQ(decoder.counters().good, 1U);
        EXPECT_EQ(decoder.counters().bad(), 1U);
        return decoder.counters();
    };
    Bytes flipped = good;
    flipped[20] ^= std::byte{4};
    EXPECT_EQ(after(flipped).bad_crc, 1U);
    EXPECT_EQ(after({std::byte{9}, std::byte{1}}).bad_cobs, 1U);
    EXPECT_EQ(after(Bytes(rig::kMaxCobsBytes + 1, std::byte{1})).too_long, 1U);
    EXPECT_EQ(after(Bytes(5000, std::byte{1})).too_long, 1U);
    EXPECT_EQ(after(Bytes(5, std::byte{1})).bad_length, 1U);
    // version, type, flags, source, sequence, length
    Bytes raw{std::byte{1}, std::byte{2}, std::byte{0}, std::byte{0}, std::byte{9},
              std::byte{0}, std::byte{0}, std::byte{0}, std::byte{0}, std::byte{0}};
    EXPECT_EQ(feed(*std::make_unique<FrameDecoder>(), hand_made(raw)).size(), 1U);
    raw[8] = std::byte{1};
    EXPECT_EQ(after(hand_made(raw)).bad_length, 1U);
    raw[0] = std::byte{2};
    EXPECT_EQ(after(hand_made(raw)).bad_version, 1U);
}

TEST(FrameDecoder, ARunOfTheLongestLengthIsStillTaken) {
    FrameDecoder decoder;
    (void)feed(decoder, joined({{std::byte{0}}, Bytes(rig::kMaxCobsBytes, std::byte{1}), {std::byte{0}}}));
    EXPECT_EQ(decoder.counters().too_long, 0U);
    EXPECT_EQ(decoder.counters().bad_crc, 1U);
}

TEST(FrameDecoder, OneDamagedByteCostsAtMostTwoFramesAndNeverAnotherFramesBytes) {
    const Bytes one = framed({MessageType::kEvent, 0, 1, 1}, ramp(30));
    const Bytes stream = joined({one, one, one, one, one});
    for (std::size_t at = 0; at < stream.size(); ++at) {
        for (int bit = 0; bit < 8; ++bit) {
            Bytes damaged = stream;
            damaged[at] ^= static_cast<std::byte>(1 << bit);
            FrameDecoder decoder;
            const auto out = feed(decoder, damaged);
            ASSERT_GE(out.size(), 4U) << "a damaged byte belongs to one frame";
            for (const Delivered& frame : out) ASSERT_EQ(frame.payload, ramp(30));
        }
        Bytes dropped = stream;
        dropped.erase(dropped.begin() + static_cast<std::ptrdiff_t>(at));
        FrameDecoder decoder;
        ASSERT_GE(feed(decoder, dropped).size(), 4U);
        Bytes inserted = stream;
        inserted.insert(inserted.begin() + static_cast<std::ptrdiff_t>(at), std::byte{0x55});
        FrameDecoder other;
        ASSERT_GE(feed(other, inserted).size(), 4U);
    }
}

TEST(FrameDecoder, ResetForgetsThePartialFrame) {
    const Bytes frame = framed({}, ramp(40));
    FrameDecoder decoder;
    (void)feed(decoder, ByteSpan(frame).first(20));
    decoder.reset();
    EXPECT_TRUE(feed(decoder, ByteSpan(frame).subspan(20)).empty());
    EXPECT_EQ(decoder.counters().bad(), 0U);
    EXPECT_EQ(feed(decoder, frame).size(), 1U);
}

}  // namespace
