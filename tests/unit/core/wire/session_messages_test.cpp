#include "core/wire/session_messages.hpp"

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "tests/support/wire/golden_frames.hpp"
#include "tests/support/wire/messages.hpp"

namespace {

using namespace rig;
using Bytes = std::vector<std::byte>;
using Buffer = std::array<std::byte, kMaxWirePayloadBytes>;

template <class Message>
Bytes payload_of(const Message& message) {
    Buffer buffer;
    const auto size = encode(message, buffer);
    EXPECT_TRUE(size.has_value());
    return Bytes(buffer.begin(), buffer.begin() + static_cast<std::ptrdiff_t>(size.value_or(0)));
}

TEST(SessionMessages, EveryGoldenPayloadIsRefusedAtEveryOtherLength) {
    for (const auto& golden : test::load_golden_frames()) {
        FrameDecoder decoder;
        ByteSpan rest(golden.bytes);
        FrameView frame;
        ASSERT_TRUE(decoder.next(rest, frame));
        Bytes payload(frame.payload.begin(), frame.payload.end());
        for (std::size_t size = 0; size < payload.size(); ++size) {
            const auto again = test::reencoded(frame.head.type, ByteSpan(payload).first(size));
            ASSERT_FALSE(again.has_value()) << golden.name << ' ' << size;
            EXPECT_EQ(again.error(), WireError::kLength) << golden.name << ' ' << size;
        }
        payload.push_back(std::byte{0});
        EXPECT_EQ(test::reencoded(frame.head.type, payload).error(), WireError::kLength) << golden.name;
    }
}

TEST(SessionMessages, HelloRefusesWhatIsOutOfRange) {
    const auto refused = [](auto change) {
        Hello hello;
        change(hello);
        Buffer buffer;
        return encode(hello, buffer).error();
    };
    EXPECT_EQ(refused([](Hello& h) { h.protocol_min = 2; }), WireError::kRange);
    EXPECT_EQ(refused([](Hello& h) { h.shape_count = kMaxShapes + 1; }), WireError::kRange);
    EXPECT_EQ(refused([](Hello& h) { h.marker_count = kMaxMarkers + 1; }), WireError::kRange);
    EXPECT_EQ(refused([](Hello& h) { h.role = static_cast<Role>(2); }), WireError::kRange);
    EXPECT_EQ(refused([](Hello& h) { h.serial.bytes[0] = '\x1B'; }), WireError::kText);
    EXPECT_EQ(refused([](Hello& h) { h.serial.bytes[5] = 'x'; }), WireError::kText) << "bytes behind the end";
}

TEST(SessionMessages, HelloOfAnotherProtocolIsNamedAsThat) {
    Hello hello;
    hello.protocol_min = 2;
    hello.protocol_max = 3;
    EXPECT_EQ(decode_hello(payload_of(hello)).error(), WireError::kVersion);
    hello.protocol_min = 0;
    hello.protocol_max = 200;
    EXPECT_EQ(decode_hello(payload_of(hello)).value(), hello);
}

TEST(SessionMessages, HelloRefusesReservedFlags) {
    Bytes payload = payload_of(Hello{});
    payload[3] = std::byte{4};
    EXPECT_EQ(decode_hello(payload).error(), WireError::kRange);
}

TEST(Names, PagesCoverEveryNameOnceInOrder) {
    std::vector<std::string> names;
    for (std::size_t i = 0; i < kMaxShapes; ++i)
        names.push_back(std::string(1 + (i * 7) % kMaxNameBytes, 'a'));
    const std::vector<std::string_view> all(names.begin(), names.end());
    std::vector<std::string> received;
    std::size_t pages = 0;
    while (received.size() < all.size()) {
        Buffer buffer;
        const auto size =
            encode_names(NameKind::kShapes, all, static_cast<std::uint16_t>(received.size()), buffer);
        ASSERT_TRUE(size.has_value());
        const auto page = decode_names(ByteSpan(buffer).first(*size));
        ASSERT_TRUE(page.has_value());
        ASSERT_EQ(page->first, received.size());
        ASSERT_EQ(page->total, all.size());
        ASSERT_GT(page->count, 0);
        for (std::size_t i = 0; i < page->count; ++i) received.emplace_back(page->names[i]);
        ++pages;
    }
    EXPECT_EQ(received, names);
    EXPECT_LT(pages, 20U);
}

TEST(Names, NoneAtAllIsAPage) {
    Buffer buffer;
    const auto size = encode_names(NameKind::kMarkers, {}, 0, buffer);
    ASSERT_TRUE(size.has_value());
    const auto page = decode_names(ByteSpan(buffer).first(*size));
    ASSERT_TRUE(page.has_value());
    EXPECT_EQ(page->total, 0);
}

TEST(Names, RefusesBadNamesAndBadPages) {
    Buffer buffer;
    const std::string too_long(kMaxNameBytes + 1, 'a');
    for (const std::string_view bad :
         {std::string_view(""), std::string_view(too_long), std::string_view("a\x1B")}) {
        EXPECT_EQ(encode_names(NameKind::kShapes, std::array{bad}, 0, buffer).error(), WireError::kText);
    }
    const std::array<std::string_view, 2> two{"a", "b"};
    EXPECT_EQ(encode_names(NameKind::kShapes, two, 3, buffer).error(), WireError::kRange);
    const std::vector<std::string_view> many(kMaxMarkers + 1, "m");
    EXPECT_EQ(encode_names(NameKind::kMarkers, many, 0, buffer).error(), WireError::kRange);
    ASSERT_EQ(encode_names(NameKind::kShapes, two, 0, buffer).value(), 12U);
    const auto with = [&](std::size_t at, int value) {
        Bytes payload(buffer.begin(), buffer.begin() + 12);
        payload[at] = static_cast<std::byte>(value);
        const auto page = decode_names(payload);
        return page ? std::optional<WireError>() : page.error();
    };
    EXPECT_FALSE(with(0, 0).has_value());
    EXPECT_EQ(with(0, 2), WireError::kRange);
    EXPECT_EQ(with(1, 1), WireError::kRange);
    EXPECT_EQ(with(2, 1), WireError::kRange) << "count beyond the total";
    EXPECT_EQ(with(4, 1), WireError::kRange);
    EXPECT_EQ(with(6, 1), WireError::kLength) << "a name is left over";
    EXPECT_EQ(with(6, 0), WireError::kRange)
        << "an empty page before the end would be asked for again for ever";
    EXPECT_EQ(with(8, 0), WireError::kText);
    EXPECT_EQ(with(8, 9), WireError::kLength);
    EXPECT_EQ(with(9, 7), WireError::kText);
}

TEST(SessionMessages, RangesAreChecked) {
    Buffer buffer;
    EXPECT_EQ(encode(TimeRequest{kMaxWireTime_us + 1}, buffer).error(), WireError::kRange);
    EXPECT_EQ(encode(TimeReply{0, 10, 9}, buffer).error(), WireError::kRange);
    EXPECT_EQ(encode(StartStreams{0, 1, 1, 1}, buffer).error(), WireError::kRange);
    EXPECT_EQ(encode(StartStreams{16, 1, 1, 1}, buffer).error(), WireError::kRange);
    EXPECT_EQ(encode(StartStreams{1, 0, 1, 1}, buffer).error(), WireError::kRange);
    EXPECT_EQ(encode(StartStreams{1, 1, 0, 1}, buffer).error(), WireError::kRange);
    EXPECT_EQ(encode(StartStreams{1, 1, 1, 0}, buffer).error(), WireError::kRange);
    EXPECT_EQ(encode(StopStreams{0}, buffer).error(), WireError::kRange);
    EXPECT_EQ(encode(CommandMessage{static_cast<BoardCommand>(0)}, buffer).error(), WireError::kRange);
    EXPECT_EQ(encode(CommandMessage{static_cast<BoardCommand>(4)}, buffer).error(), WireError::kRange);
    EXPECT_EQ(encode(NakMessage{static_cast<NakReason>(8), 0, 0}, buffer).error(), WireError::kRange);
    EXPECT_EQ(encode(GoodbyeMessage{static_cast<GoodbyeReason>(4)}, buffer).error(), WireError::kRange);
    EXPECT_EQ(encode(NamesRequest{static_cast<NameKind>(2), 0}, buffer).error(), WireError::kRange);
    EventMessage event;
    event.fault = 1;
    EXPECT_EQ(encode(event, buffer).error(), WireError::kRange) << "a log line names no fault";
    event.kind = EventKind::kFaultRaised;
    EXPECT_TRUE(encode(event, buffer).has_value());
    event.fault = 65;
    EXPECT_EQ(encode(event, buffer).error(), WireError::kRange);
    event.fault = 64;
    event.camera = kMaxCameras;
    EXPECT_EQ(encode(event, buffer).error(), WireError::kRange);
}

TEST(SessionMessages, NakReasonsNameTheFault) {
    EXPECT_EQ(nak_reason(WireError::kLength), NakReason::kBadLength);
    EXPECT_EQ(nak_reason(WireError::kVersion), NakReason::kVersion);
    EXPECT_EQ(nak_reason(WireError::kRange), NakReason::kBadValue);
    EXPECT_EQ(nak_reason(WireError::kText), NakReason::kBadValue);
}

}  // namespace
