#include "core/wire/state_messages.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

#include "core/wire/session_messages.hpp"

namespace {

using namespace rig;
using Buffer = std::array<std::byte, kMaxWirePayloadBytes>;

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr float kInf = std::numeric_limits<float>::infinity();

WeightsPart sent(const FaceState& state, std::size_t part = 0) {
    Buffer buffer;
    const auto size = encode_weights(state, part, buffer);
    EXPECT_TRUE(size.has_value());
    const auto decoded = decode_weights(ByteSpan(buffer).first(size.value_or(0)));
    EXPECT_TRUE(decoded.has_value());
    return decoded.value_or(WeightsPart{});
}

FaceState one_weight(float weight, float confidence = 1.0F) {
    FaceState state;
    state.shape_count = 1;
    state.weights[0] = weight;
    state.confidence[0] = confidence;
    return state;
}

FaceState many_shapes(std::uint32_t sequence, std::uint16_t count) {
    FaceState state;
    state.sequence = sequence;
    state.capture_us = sequence * 16667LL;
    state.shape_count = count;
    for (std::size_t i = 0; i < count; ++i) {
        state.weights[i] = static_cast<float>(i) / 256.0F;
        state.confidence[i] = static_cast<float>(i % 256) / 255.0F;
    }
    return state;
}

TEST(Weights, EveryValueOfTheWireComesBackExactly) {
    for (int q = -32768; q <= 32767; ++q) {
        const auto weight = static_cast<float>(q) / 16384.0F;
        const WeightsPart part = sent(one_weight(weight));
        ASSERT_EQ(part.state.weights[0], weight);
        ASSERT_FALSE(part.altered) << q;
    }
}

TEST(Weights, ErrorIsAtMostHalfAStep) {
    for (int i = 0; i <= 30000; ++i) {
        const float weight = -1.0F + static_cast<float>(i) * 1.0e-4F;
        if (weight > kWireWeightHigh) break;
        ASSERT_LE(std::abs(sent(one_weight(weight)).state.weights[0] - weight), kWeightStep / 2.0) << weight;
    }
}

TEST(Weights, WhatCannotBeSentIsMarked) {
    const auto check = [](float weight, float wanted) {
        const WeightsPart part = sent(one_weight(weight));
        EXPECT_TRUE(part.altered) << weight;
        EXPECT_EQ(part.state.weights[0], wanted) << weight;
    };
    check(kNan, 0.0F);
    check(kInf, 0.0F);
    check(-kInf, 0.0F);
    check(5.0F, kWireWeightHigh);
    check(2.0F, kWireWeightHigh);
    check(-2.001F, kWireWeightLow);
    check(std::numeric_limits<float>::max(), kWireWeightHigh);
    EXPECT_EQ(sent(one_weight(kNan, 1.0F)).state.confidence[0], 0.0F);
    FaceState slip = one_weight(0.5F);
    slip.slip.rotation_rad[1] = kNan;
    EXPECT_TRUE(sent(slip).altered);
    EXPECT_EQ(sent(slip).state.slip.rotation_rad[1], 0.0F);
    FaceState time = one_weight(0.5F);
    time.capture_us = std::numeric_limits<std::int64_t>::min();
    EXPECT_TRUE(sent(time).altered);
}

TEST(Weights, ConfidenceAndAgeSaturate) {
    EXPECT_EQ(sent(one_weight(0.0F, kNan)).state.confidence[0], 0.0F);
    EXPECT_EQ(sent(one_weight(0.0F, -1.0F)).state.confidence[0], 0.0F);
    EXPECT_EQ(sent(one_weight(0.0F, 7.0F)).state.confidence[0], 1.0F);
    FaceState state = one_weight(0.0F);
    state.age_us = -5;
    EXPECT_EQ(sent(state).state.age_us, 0);
    state.age_us = std::numeric_limits<std::int64_t>::max();
    EXPECT_EQ(sent(state).state.age_us, 0xFFFFFFFF);
}

TEST(Weights, SplitIntoPartsThatCoverEachShapeOnce) {
    EXPECT_EQ(weights_part_count(0), 1U);
    EXPECT_EQ(weights_part_count(kWeightsPerPart), 1U);
    EXPECT_EQ(weights_part_count(kWeightsPerPart + 1), 2U);
    EXPECT_EQ(weights_part_count(kMaxShapes), kMaxWeightsParts);
    for (std::uint16_t count = 0; count <= kMaxShapes; ++count) {
        const FaceState state = many_shapes(5, count);
        std::size_t next = 0;
        for (std::size_t part = 0; part < weights_part_count(count); ++part) {
            const WeightsPart got = sent(state, part);
            ASSERT_EQ(got.first, next);
            next += got.count;
        }
        ASSERT_EQ(next, count);
        Buffer buffer;
        ASSERT_EQ(encode_weights(state, weights_part_count(count), buffer).error(), WireError::kRange);
    }
}

TEST(Weights, DecoderRefusesOtherSplitsAndBadFields) {
    Buffer buffer;
    const std::size_t size = encode_weights(many_shapes(1, 10), 0, buffer).value();
    const auto with = [&](std::size_t at, int value) {
        std::vector<std::byte> payload(buffer.begin(), buffer.begin() + static_cast<std::ptrdiff_t>(size));
        payload[at] = static_cast<std::byte>(value);
        const auto part = decode_weights(payload);
        return part ? std::optional<WireError>() : part.error();
    };
    EXPECT_FALSE(with(0, 9).has_value());
    EXPECT_EQ(with(11, 0x7F), WireError::kRange) << "time";
    EXPECT_EQ(with(27, 0x7F), WireError::kRange) << "slip beyond 1e6";
    EXPECT_EQ(with(48, 6), WireError::kRange) << "camera status";
    EXPECT_EQ(with(52, 5), WireError::kRange) << "state";
    EXPECT_EQ(with(53, 4), WireError::kRange) << "reserved flag";
    EXPECT_EQ(with(54, 1), WireError::kRange) << "part";
    EXPECT_EQ(with(55, 2), WireError::kRange) << "parts";
    EXPECT_EQ(with(56, 11), WireError::kRange) << "total";
    EXPECT_EQ(with(57, 2), WireError::kRange) << "total over the limit";
    EXPECT_EQ(with(58, 1), WireError::kRange) << "first";
    EXPECT_EQ(with(60, 9), WireError::kRange) << "count";
}

TEST(Weights, EncoderRefusesOurOwnMistakes) {
    Buffer buffer;
    FaceState state = many_shapes(1, 3);
    state.shape_count = kMaxShapes + 1;
    EXPECT_EQ(encode_weights(state, 0, buffer).error(), WireError::kRange);
    state = many_shapes(1, 3);
    state.cameras[2] = static_cast<CameraStatus>(6);
    EXPECT_EQ(encode_weights(state, 0, buffer).error(), WireError::kRange);
    state = many_shapes(1, 3);
    for (std::size_t room = 0; room < 71; ++room) {
        EXPECT_EQ(encode_weights(state, 0, MutableByteSpan(buffer).first(room)).error(), WireError::kSpace);
    }
    EXPECT_EQ(encode_weights(state, 0, MutableByteSpan(buffer).first(71)).value(), 71U);
}

TEST(StateAssembler, ReunitesPartsInAnyOrder) {
    const FaceState state = many_shapes(7, 256);
    StateAssembler assembler;
    EXPECT_FALSE(assembler.push(sent(state, 1)));
    EXPECT_TRUE(assembler.push(sent(state, 0)));
    EXPECT_EQ(assembler.state().weights, state.weights);
    EXPECT_EQ(assembler.state().sequence, 7U);
    EXPECT_FALSE(assembler.push(sent(state, 0))) << "handed out once";
    EXPECT_EQ(assembler.counters().whole, 1U);
    EXPECT_EQ(assembler.counters().stale, 1U);
    EXPECT_EQ(assembler.counters().lost_parts, 0U);
}

TEST(StateAssembler, ReportsLostParts) {
    StateAssembler assembler;
    EXPECT_FALSE(assembler.push(sent(many_shapes(1, 256), 0)));
    EXPECT_FALSE(assembler.push(sent(many_shapes(2, 256), 0)));
    EXPECT_EQ(assembler.counters().abandoned, 1U);
    EXPECT_EQ(assembler.counters().lost_parts, 1U);
    EXPECT_FALSE(assembler.push(sent(many_shapes(1, 256), 1))) << "too late";
    EXPECT_EQ(assembler.counters().stale, 1U);
    EXPECT_TRUE(assembler.push(sent(many_shapes(2, 256), 1)));
}

TEST(StateAssembler, DropsReorderedStatesAndFollowsARestart) {
    StateAssembler assembler;
    EXPECT_TRUE(assembler.push(sent(many_shapes(50000, 4))));
    EXPECT_FALSE(assembler.push(sent(many_shapes(49999, 4))));
    EXPECT_TRUE(assembler.push(sent(many_shapes(50001, 4))));
    EXPECT_TRUE(assembler.push(sent(many_shapes(0, 4)))) << "the board restarted";
    EXPECT_TRUE(assembler.push(sent(many_shapes(1, 4))));
}

TEST(StateAssembler, SequenceWraps) {
    StateAssembler assembler;
    EXPECT_TRUE(assembler.push(sent(many_shapes(0xFFFFFFFFU, 4))));
    EXPECT_TRUE(assembler.push(sent(many_shapes(0, 4))));
    EXPECT_FALSE(assembler.push(sent(many_shapes(0xFFFFFFFFU, 4))));
    EXPECT_EQ(assembler.counters().whole, 2U);
}

TEST(StateAssembler, PartsOfDifferentTotalsDoNotMix) {
    StateAssembler assembler;
    EXPECT_FALSE(assembler.push(sent(many_shapes(3, 192), 0)));
    EXPECT_FALSE(assembler.push(sent(many_shapes(3, 256), 1)));
    EXPECT_TRUE(assembler.push(sent(many_shapes(3, 256), 0)));
    EXPECT_EQ(assembler.state().shape_count, 256);
    EXPECT_EQ(assembler.counters().lost_parts, 1U);
}

MarkerFrame many_markers(std::uint16_t count) {
    MarkerFrame frame;
    frame.sequence = 12;
    frame.capture_us = 99;
    frame.marker_count = count;
    for (std::size_t i = 0; i < count; ++i) {
        if (i % 5 == 3) continue;
        const auto x = static_cast<float>(i);
        frame.markers[i] = {true, static_cast<std::uint8_t>(i % (kMaxCameras + 1)), {x, -x, 0.25F * x}};
    }
    return frame;
}

TEST(Markers, EveryCountComesBackThroughTheAssembler) {
    for (std::uint16_t count = 0; count <= kMaxMarkers; ++count) {
        const MarkerFrame frame = many_markers(count);
        MarkerAssembler assembler;
        bool whole = false;
        for (std::size_t part = 0; part < markers_part_count(count); ++part) {
            ASSERT_FALSE(whole);
            Buffer buffer;
            const auto size = encode_markers(frame, part, buffer);
            ASSERT_TRUE(size.has_value());
            const auto decoded = decode_markers(ByteSpan(buffer).first(*size));
            ASSERT_TRUE(decoded.has_value());
            whole = assembler.push(*decoded);
        }
        ASSERT_TRUE(whole);
        ASSERT_EQ(assembler.frame().markers, frame.markers);
        ASSERT_EQ(assembler.frame().marker_count, count);
    }
}

TEST(Markers, BeyondTheRangeIsNotSeen) {
    MarkerFrame frame;
    frame.marker_count = 4;
    frame.markers[0] = {true, 2, {327.67F, -327.67F, 0.0F}};
    frame.markers[1] = {true, 2, {328.0F, 0.0F, 0.0F}};
    frame.markers[2] = {true, 2, {kNan, 0.0F, 0.0F}};
    frame.markers[3] = {true, 2, {0.0F, 0.0F, -kInf}};
    Buffer buffer;
    const auto part = decode_markers(ByteSpan(buffer).first(encode_markers(frame, 0, buffer).value()));
    ASSERT_TRUE(part.has_value());
    EXPECT_EQ(part->frame.markers[0], frame.markers[0]);
    for (std::size_t i = 1; i < 4; ++i) EXPECT_EQ(part->frame.markers[i], MarkerSample{});
}

TEST(Markers, DecoderRefusesWhatNoEncoderWrites) {
    Buffer buffer;
    const std::size_t size = encode_markers(many_markers(4), 0, buffer).value();
    const auto with = [&](std::size_t at, int value) {
        std::vector<std::byte> payload(buffer.begin(), buffer.begin() + static_cast<std::ptrdiff_t>(size));
        payload[at] = static_cast<std::byte>(value);
        const auto part = decode_markers(payload);
        return part ? std::optional<WireError>() : part.error();
    };
    EXPECT_FALSE(with(0, 1).has_value());
    EXPECT_EQ(with(12, 5), WireError::kRange);
    EXPECT_EQ(with(13, 1), WireError::kRange);
    EXPECT_EQ(with(14, 1), WireError::kRange);
    EXPECT_EQ(with(16, 3), WireError::kRange);
    EXPECT_EQ(with(18, 1), WireError::kRange);
    EXPECT_EQ(with(19, 0), WireError::kRange);
    EXPECT_EQ(with(26, 0x85), WireError::kRange) << "five cameras";
    EXPECT_EQ(with(20 + 3 * 7, 1), WireError::kRange) << "a place for a marker not seen";
    EXPECT_EQ(with(20 + 3 * 7 + 6, 1), WireError::kRange) << "views of a marker not seen";
}

TEST(Markers, ComeFromTracking) {
    NamedMarkers markers;
    markers.capture_us = 77;
    markers.count = 2;
    markers.markers[1].seen = true;
    markers.markers[1].views = 3;
    markers.markers[1].position_mm = {1.0, 2.0, 3.5};
    const MarkerFrame frame = marker_frame(markers, 9);
    EXPECT_EQ(frame.sequence, 9U);
    EXPECT_EQ(frame.capture_us, 77);
    EXPECT_EQ(frame.markers[0], MarkerSample{});
    EXPECT_EQ(frame.markers[1], (MarkerSample{true, 3, {1.0F, 2.0F, 3.5F}}));
}

HeadPoseMessage known_head() {
    HeadPoseMessage message;
    message.sequence = 77;
    message.head.capture_us = 123456789;
    message.head.status = HeadStatus::kKnown;
    message.head.points_used = 96;
    message.head.rotation_rad = {0.1F, -0.0F, 3.0F};
    message.head.translation_mm = {-400.5F, 12.0F, 900.0F};
    message.head.rotation_sigma_rad = {0.01F, 0.02F, 0.03F};
    message.head.translation_sigma_mm = {1.0F, 2.0F, 3.0F};
    message.head.rms_px = 0.4F;
    return message;
}

TEST(HeadPose, WhatIsKnownComesBackAndWhatIsNotIsZero) {
    HeadPoseMessage message = known_head();
    Buffer buffer;
    ASSERT_EQ(encode(message, buffer).value(), kHeadPoseBytes);
    const auto got = decode_head_pose(ByteSpan(buffer).first(kHeadPoseBytes));
    ASSERT_TRUE(got.has_value());
    EXPECT_EQ(got->sequence, 77U);
    EXPECT_EQ(got->head.capture_us, 123456789);
    EXPECT_EQ(got->head.points_used, 96);
    EXPECT_EQ(got->head.rotation_rad, message.head.rotation_rad);
    EXPECT_EQ(got->head.translation_mm, message.head.translation_mm);
    EXPECT_EQ(got->head.rotation_sigma_rad, message.head.rotation_sigma_rad);
    EXPECT_EQ(got->head.translation_sigma_mm, message.head.translation_sigma_mm);
    EXPECT_EQ(got->head.rms_px, 0.4F);
    message.head.status = HeadStatus::kFlat;
    ASSERT_TRUE(encode(message, buffer).has_value());
    const auto flat = decode_head_pose(ByteSpan(buffer).first(kHeadPoseBytes));
    ASSERT_TRUE(flat.has_value());
    EXPECT_EQ(flat->head.status, HeadStatus::kFlat);
    EXPECT_EQ(flat->head.capture_us, 123456789);
    EXPECT_EQ(flat->head.points_used, 0);
    EXPECT_EQ(flat->head.rotation_rad, (std::array<float, 3>{}));
    EXPECT_EQ(flat->head.rms_px, 0.0F);
}

TEST(HeadPose, NumbersThatCannotBeSentMakeItUncertain) {
    const auto status_with = [](const HeadPoseMessage& message) {
        Buffer buffer;
        EXPECT_TRUE(encode(message, buffer).has_value());
        const auto got = decode_head_pose(ByteSpan(buffer).first(kHeadPoseBytes));
        EXPECT_TRUE(got.has_value());
        return got.value_or(HeadPoseMessage{}).head.status;
    };
    for (const float bad : {kNan, kInf, 2e6F, -2e6F}) {
        HeadPoseMessage message = known_head();
        message.head.translation_mm[1] = bad;
        EXPECT_EQ(status_with(message), HeadStatus::kUncertain) << bad;
    }
    HeadPoseMessage negative = known_head();
    negative.head.rms_px = -0.1F;
    EXPECT_EQ(status_with(negative), HeadStatus::kUncertain);
}

TEST(HeadPose, DecodingIsStrict) {
    Buffer good;
    ASSERT_TRUE(encode(known_head(), good).has_value());
    EXPECT_EQ(decode_head_pose(ByteSpan(good).first(kHeadPoseBytes - 1)).error(), WireError::kLength);
    EXPECT_EQ(decode_head_pose(ByteSpan(good).first(kHeadPoseBytes + 1)).error(), WireError::kLength);
    const auto with = [&good](std::size_t at, std::uint8_t value) {
        Buffer bytes = good;
        bytes[at] = std::byte{value};
        return decode_head_pose(ByteSpan(bytes).first(kHeadPoseBytes));
    };
    EXPECT_TRUE(with(12, 1).has_value());
    EXPECT_EQ(with(12, 7).error(), WireError::kRange) << "no such status";
    EXPECT_EQ(with(13, 1).error(), WireError::kRange) << "reserved";
    EXPECT_EQ(with(12, 2).error(), WireError::kRange) << "not known, yet with numbers";
    EXPECT_EQ(with(67, 0xff).error(), WireError::kRange) << "no number of pixels";
    HeadPoseMessage message = known_head();
    EXPECT_EQ(encode(message, MutableByteSpan(good).first(kHeadPoseBytes - 1)).error(), WireError::kSpace);
    message.head.status = static_cast<HeadStatus>(7);
    EXPECT_EQ(encode(message, good).error(), WireError::kRange);
}

}  // namespace
