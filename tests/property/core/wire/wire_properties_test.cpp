// What holds for every frame and every message, over seeded random ones.
#include <gtest/gtest.h>

#include <vector>

#include "core/wire/health.hpp"
#include "core/wire/session_messages.hpp"
#include "core/wire/state_messages.hpp"
#include "tests/support/random.hpp"
#include "tests/support/wire/golden_frames.hpp"
#include "tests/support/wire/messages.hpp"

namespace {

using namespace rig;
using test::SeededRandom;
using Bytes = std::vector<std::byte>;
using Buffer = std::array<std::byte, kMaxWirePayloadBytes>;

Bytes random_bytes(SeededRandom& random, std::size_t size, double zeros) {
    Bytes bytes(size);
    for (std::byte& byte : bytes)
        byte = random.chance(zeros) ? std::byte{0} : static_cast<std::byte>(random.bits());
    return bytes;
}

FaceState random_state(SeededRandom& random) {
    FaceState state;
    state.sequence = static_cast<std::uint32_t>(random.bits());
    state.capture_us = static_cast<std::int64_t>(random.below(std::uint64_t{1} << 60));
    state.age_us = static_cast<std::int64_t>(random.below(std::uint64_t{1} << 34));
    state.state = static_cast<TrackingState>(random.below(5));
    state.held = random.chance(0.5);
    for (CameraStatus& status : state.cameras) status = static_cast<CameraStatus>(random.below(6));
    state.faults = random.bits();
    for (float& value : state.slip.rotation_rad) value = static_cast<float>(random.uniform(-4.0, 4.0));
    for (float& value : state.slip.translation_mm) value = static_cast<float>(random.uniform(-50.0, 50.0));
    state.shape_count = static_cast<std::uint16_t>(random.below(kMaxShapes + 1));
    for (std::size_t i = 0; i < state.shape_count; ++i) {
        state.weights[i] = static_cast<float>(random.uniform(-2.0, 1.9999));
        state.confidence[i] = static_cast<float>(random.uniform(0.0, 1.0));
    }
    return state;
}

TEST(WireProperties, RandomFramesComeBackThroughEveryTwoWaySplit) {
    SeededRandom random(11);
    for (int round = 0; round < 60; ++round) {
        const Bytes payload =
            random_bytes(random, random.below(kMaxWirePayloadBytes + 1), random.uniform(0.0, 1.0));
        const FrameHead head{
            static_cast<MessageType>(random.bits()), static_cast<std::uint8_t>(random.bits()),
            static_cast<std::uint8_t>(random.bits()), static_cast<std::uint32_t>(random.bits())};
        const Bytes frame = test::framed(head, payload);
        ASSERT_LE(frame.size(), kMaxWireFrameBytes);
        for (std::size_t cut = 0; cut <= frame.size(); ++cut) {
            FrameDecoder decoder;
            FrameView view;
            ByteSpan front = ByteSpan(frame).first(cut);
            ByteSpan back = ByteSpan(frame).subspan(cut);
            bool found = decoder.next(front, view);
            if (!found) found = decoder.next(back, view);
            ASSERT_TRUE(found);
            ASSERT_EQ(Bytes(view.payload.begin(), view.payload.end()), payload);
            ASSERT_EQ(view.head.sequence, head.sequence);
            ASSERT_EQ(decoder.counters().bad(), 0U);
        }
    }
}

TEST(WireProperties, RandomStatesComeBackWithinHalfAStep) {
    SeededRandom random(12);
    for (int round = 0; round < 2000; ++round) {
        const FaceState state = random_state(random);
        StateAssembler assembler;
        bool whole = false;
        for (std::size_t part = 0; part < weights_part_count(state.shape_count); ++part) {
            Buffer buffer;
            const auto size = encode_weights(state, part, buffer);
            ASSERT_TRUE(size.has_value());
            const auto decoded = decode_weights(ByteSpan(buffer).first(*size));
            ASSERT_TRUE(decoded.has_value());
            ASSERT_FALSE(decoded->altered);
            whole = assembler.push(*decoded);
        }
        ASSERT_TRUE(whole);
        const FaceState& got = assembler.state();
        ASSERT_EQ(got.sequence, state.sequence);
        ASSERT_EQ(got.capture_us, state.capture_us);
        ASSERT_EQ(got.age_us, std::min<std::int64_t>(state.age_us, 0xFFFFFFFF));
        ASSERT_EQ(got.state, state.state);
        ASSERT_EQ(got.held, state.held);
        ASSERT_EQ(got.cameras, state.cameras);
        ASSERT_EQ(got.faults, state.faults);
        ASSERT_EQ(got.slip.rotation_rad, state.slip.rotation_rad);
        ASSERT_EQ(got.slip.translation_mm, state.slip.translation_mm);
        ASSERT_EQ(got.shape_count, state.shape_count);
        for (std::size_t i = 0; i < kMaxShapes; ++i) {
            ASSERT_NEAR(got.weights[i], state.weights[i], kWeightStep / 2.0);
            ASSERT_NEAR(got.confidence[i], state.confidence[i], 0.5 / 255.0 + 1e-7);
        }
    }
}

TEST(WireProperties, AnyFloatBitsGiveAPayloadThatTheDecoderTakes) {
    SeededRandom random(13);
    for (int round = 0; round < 3000; ++round) {
        FaceState state = random_state(random);
        const auto any_float = [&] {
            return std::bit_cast<float>(static_cast<std::uint32_t>(random.bits()));
        };
        for (std::size_t i = 0; i < state.shape_count; ++i) {
            state.weights[i] = any_float();
            state.confidence[i] = any_float();
        }
        state.slip.rotation_rad = {any_float(), any_float(), any_float()};
        state.capture_us = static_cast<std::int64_t>(random.bits());
        state.age_us = static_cast<std::int64_t>(random.bits());
        for (std::size_t part = 0; part < weights_part_count(state.shape_count); ++part) {
            Buffer buffer;
            const auto size = encode_weights(state, part, buffer);
            ASSERT_TRUE(size.has_value());
            ASSERT_TRUE(decode_weights(ByteSpan(buffer).first(*size)).has_value());
        }
        MarkerFrame markers;
        markers.marker_count = kMaxMarkers;
        for (MarkerSample& sample : markers.markers)
            sample = {true, 4, {any_float(), any_float(), any_float()}};
        Buffer buffer;
        const auto size = encode_markers(markers, 1, buffer);
        ASSERT_TRUE(size.has_value());
        ASSERT_TRUE(decode_markers(ByteSpan(buffer).first(*size)).has_value());
        HeadPoseMessage head;
        head.head.status = static_cast<HeadStatus>(random.below(7));
        head.head.capture_us = static_cast<std::int64_t>(random.bits());
        head.head.points_used = static_cast<std::uint16_t>(random.bits());
        head.head.rotation_rad = {any_float(), any_float(), any_float()};
        head.head.translation_sigma_mm = {any_float(), any_float(), any_float()};
        head.head.rms_px = any_float();
        const auto head_size = encode(head, buffer);
        ASSERT_TRUE(head_size.has_value());
        ASSERT_TRUE(decode_head_pose(ByteSpan(buffer).first(*head_size)).has_value());
    }
}

// Bytes of a golden payload changed at random: refused, or it encodes to the very bytes that were accepted.
TEST(WireProperties, ChangedPayloadsAreRefusedOrMeanWhatTheySay) {
    SeededRandom random(14);
    std::size_t accepted = 0;
    std::size_t refused = 0;
    for (const auto& golden : test::load_golden_frames()) {
        FrameDecoder decoder;
        ByteSpan rest(golden.bytes);
        FrameView frame;
        ASSERT_TRUE(decoder.next(rest, frame));
        for (int round = 0; round < 4000 && !frame.payload.empty(); ++round) {
            Bytes payload(frame.payload.begin(), frame.payload.end());
            for (std::uint64_t change = 0; change <= random.below(3); ++change) {
                payload[random.below(payload.size())] = static_cast<std::byte>(random.bits());
            }
            const auto again = test::reencoded(frame.head.type, payload);
            if (!again) {
                ++refused;
                continue;
            }
            ++accepted;
            ASSERT_EQ(test::to_hex(*again), test::to_hex(payload)) << golden.name;
        }
    }
    EXPECT_GT(accepted, 1000U);
    EXPECT_GT(refused, 1000U);
}

TEST(WireProperties, RandomBytesAreNeverAFrame) {
    SeededRandom random(15);
    FrameDecoder decoder;
    for (int round = 0; round < 2000; ++round) {
        const Bytes noise = random_bytes(random, 1000, random.uniform(0.0, 0.1));
        ByteSpan rest(noise);
        FrameView frame;
        ASSERT_FALSE(decoder.next(rest, frame));
    }
    EXPECT_GT(decoder.counters().bad(), 10000U);
}

// Bursts of up to 32 bits anywhere in a golden frame are always seen by a 32-bit CRC when COBS keeps its
// blocks; where it does not, the chance of acceptance is 2^-32 a frame.
TEST(WireProperties, BurstsOfUpToThirtyTwoBitsAreRefusedOrDeliveredEqual) {
    SeededRandom random(16);
    for (const auto& golden : test::load_golden_frames()) {
        for (int round = 0; round < 8000; ++round) {
            Bytes damaged = golden.bytes;
            const std::size_t start = random.below(damaged.size() * 8);
            const std::size_t length = 1 + random.below(32);
            for (std::size_t bit = start; bit < start + length && bit < damaged.size() * 8; ++bit) {
                if (random.chance(0.5)) damaged[bit / 8] ^= static_cast<std::byte>(1U << (bit % 8));
            }
            FrameDecoder decoder;
            ByteSpan rest(damaged);
            FrameView frame;
            while (decoder.next(rest, frame))
                ASSERT_EQ(test::framed(frame.head, frame.payload), golden.bytes);
        }
    }
}

}  // namespace
