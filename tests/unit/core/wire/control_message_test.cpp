#include "core/wire/control_message.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <limits>

namespace {

using namespace rig;
using Buffer = std::array<std::byte, kMaxWirePayloadBytes>;

ControlEdit of_shapes(ControlKind kind, float value, float high = 0.0F) {
    ControlEdit edit{kind, value, high, 0, 0, {}};
    put_in(edit.shapes, 3);
    put_in(edit.shapes, 255);
    return edit;
}

Result<std::size_t, WireError> encoded(const ControlEdit& edit, Buffer& buffer) {
    ControlMessage message;
    message.edits.resize(1);
    message.edits[0] = edit;
    return encode(message, buffer);
}

TEST(ControlMessage, EveryKindComesBack) {
    ControlMessage message;
    for (const ControlEdit& edit :
         {of_shapes(ControlKind::kSparsity, 0.0F), of_shapes(ControlKind::kRidge, 1e4F),
          of_shapes(ControlKind::kTemporal, 0.5F), of_shapes(ControlKind::kMultiplier, -1.25F),
          of_shapes(ControlKind::kOffset, -1000.0F), of_shapes(ControlKind::kRange, -0.5F, 0.75F),
          ControlEdit{ControlKind::kSymmetry, 3.0F, 0.0F, 0, 255, {}},
          ControlEdit{ControlKind::kCancel, 0.0F, 0.0F, 7, 6, {}}}) {
        ASSERT_TRUE(message.edits.push_back(edit));
    }
    Buffer buffer;
    const auto size = encode(message, buffer);
    ASSERT_TRUE(size.has_value());
    EXPECT_EQ(*size, kControlHeadBytes + 8 * kControlEditBytes);
    const auto back = decode_control(ByteSpan(buffer).first(*size));
    ASSERT_TRUE(back.has_value());
    EXPECT_FALSE(back->neutral_first);
    ASSERT_EQ(back->edits.size(), 8U);
    EXPECT_TRUE(std::equal(back->edits.begin(), back->edits.end(), message.edits.begin()));
}

TEST(ControlMessage, TheLongestFillsAFrame) {
    ControlMessage message;
    while (message.edits.push_back(of_shapes(ControlKind::kOffset, 0.25F))) {
    }
    Buffer buffer;
    const auto size = encode(message, buffer);
    ASSERT_TRUE(size.has_value());
    EXPECT_LE(*size, kMaxWirePayloadBytes);
    EXPECT_GT(*size + kControlEditBytes, kMaxWirePayloadBytes);
    EXPECT_EQ(encode(message, MutableByteSpan(buffer).first(*size - 1)).error(), WireError::kSpace);
}

TEST(ControlMessage, RefusesWhatCannotBe) {
    constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
    constexpr float kInfinity = std::numeric_limits<float>::infinity();
    Buffer buffer;
    for (const ControlKind kind : {ControlKind::kSparsity, ControlKind::kRidge, ControlKind::kTemporal,
                                   ControlKind::kMultiplier, ControlKind::kOffset, ControlKind::kRange}) {
        for (const float value : {kNan, kInfinity, -kInfinity, 1.1e4F, -1.1e4F})
            EXPECT_FALSE(encoded(of_shapes(kind, value, kind == ControlKind::kRange ? value : 0.0F), buffer));
        ControlEdit with_pair = of_shapes(kind, 1.0F, kind == ControlKind::kRange ? 1.0F : 0.0F);
        EXPECT_TRUE(encoded(with_pair, buffer));
        with_pair.second = 1;
        EXPECT_FALSE(encoded(with_pair, buffer));
        if (kind != ControlKind::kRange) {
            EXPECT_FALSE(encoded(of_shapes(kind, 1.0F, 0.5F), buffer));
        }
    }
    EXPECT_FALSE(encoded(of_shapes(ControlKind::kSparsity, -0.5F), buffer));
    EXPECT_FALSE(encoded(of_shapes(ControlKind::kRange, 0.5F, 0.25F), buffer));
    EXPECT_FALSE(encoded(of_shapes(ControlKind::kRange, 0.0F, kNan), buffer));
    for (const ControlKind kind : {ControlKind::kSymmetry, ControlKind::kCancel}) {
        EXPECT_TRUE(encoded({kind, 1.0F, 0.0F, 1, 2, {}}, buffer));
        EXPECT_FALSE(encoded({kind, 1.0F, 0.0F, 2, 2, {}}, buffer));
        EXPECT_FALSE(encoded({kind, 1.0F, 0.0F, 2, 256, {}}, buffer));
        EXPECT_FALSE(encoded({kind, -1.0F, 0.0F, 1, 2, {}}, buffer));
        EXPECT_FALSE(encoded({kind, 1.0F, 1.0F, 1, 2, {}}, buffer));
        EXPECT_FALSE(encoded(of_shapes(kind, 1.0F), buffer));
    }
    EXPECT_FALSE(encoded({ControlKind::kCancel, 0.5F, 0.0F, 1, 2, {}}, buffer));
    EXPECT_FALSE(encoded({static_cast<ControlKind>(6), 1.0F, 0.0F, 0, 0, {}}, buffer));
    EXPECT_FALSE(encoded({static_cast<ControlKind>(18), 1.0F, 0.0F, 1, 2, {}}, buffer));
}

TEST(ControlMessage, ReservedBytesAndOtherLayoutsAreRefused) {
    Buffer buffer;
    const auto size = encoded(of_shapes(ControlKind::kRidge, 2.0F), buffer);
    ASSERT_TRUE(size.has_value());
    const ByteSpan payload = ByteSpan(buffer).first(*size);
    for (const auto& [at, error] : {std::pair{0U, WireError::kVersion},
                                    {1U, WireError::kRange},
                                    {3U, WireError::kRange},
                                    {5U, WireError::kRange},
                                    {10U, WireError::kRange},
                                    {11U, WireError::kRange}}) {
        const std::byte kept = buffer[at];
        buffer[at] = std::byte{2};
        EXPECT_EQ(decode_control(payload).error(), error) << at;
        buffer[at] = kept;
    }
    EXPECT_TRUE(decode_control(payload).has_value());
    buffer[2] = std::byte{14};
    EXPECT_EQ(decode_control(payload).error(), WireError::kRange);
    buffer[2] = std::byte{2};
    EXPECT_EQ(decode_control(payload).error(), WireError::kLength);
}

}  // namespace
