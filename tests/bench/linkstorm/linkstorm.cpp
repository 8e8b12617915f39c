// Sends frames through a damaged serial line and keeps a ledger of each frame's own bytes. Holds when no
// wrong frame was accepted and every frame whose bytes arrived intact was delivered; exit code 1 otherwise.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <array>
#include <chrono>
#include <vector>

#include "core/wire/frame.hpp"
#include "tests/bench/linkstorm/noisy_channel.hpp"
#include "tests/support/wire/messages.hpp"

namespace {

using namespace rig;
using rig::test::SeededRandom;
using Bytes = std::vector<std::byte>;

struct Storm {
    test::ChannelRates rates{1.0e-4, 1.0e-5, 1.0e-5};
    std::uint32_t frames = 1000000;
    std::uint64_t seed = 1;
};

struct Ledger {
    std::vector<bool> intact;
    std::vector<bool> delivered;
    std::uint64_t wrong = 0;
    std::uint64_t doubled = 0;
};

// Frame number n of a storm, from its number alone, so that the receiver's side needs no copy of what was
// sent.
Bytes frame_of(std::uint64_t seed, std::uint32_t number) {
    SeededRandom random(seed * 0x9E3779B97F4A7C15ULL + number);
    // Most frames are weights of 60 shapes; the rest have any length.
    const std::size_t size = random.chance(0.7) ? 242 : random.below(kMaxWirePayloadBytes + 1);
    std::array<std::byte, kMaxWirePayloadBytes> payload;
    const double zeros = random.chance(0.5) ? 0.3 : 0.0;
    for (std::size_t i = 0; i < size; ++i) {
        payload[i] = random.chance(zeros) ? std::byte{0} : static_cast<std::byte>(random.bits());
    }
    const FrameHead head{static_cast<MessageType>(random.bits()), 0, kSourceBoard, number};
    return test::framed(head, ByteSpan(payload).first(size));
}

void receive(FrameDecoder& decoder, ByteSpan chunk, const Storm& storm, Ledger& ledger) {
    FrameView frame;
    while (decoder.next(chunk, frame)) {
        const std::uint32_t number = frame.head.sequence;
        if (number >= storm.frames ||
            test::framed(frame.head, frame.payload) != frame_of(storm.seed, number)) {
            ++ledger.wrong;
            continue;
        }
        if (ledger.delivered[number]) ++ledger.doubled;
        ledger.delivered[number] = true;
    }
}

void receive_in_chunks(FrameDecoder& decoder, const Bytes& line, SeededRandom& random, const Storm& storm,
                       Ledger& ledger) {
    for (std::size_t at = 0; at < line.size();) {
        const std::size_t size = std::min<std::size_t>(1 + random.below(512), line.size() - at);
        receive(decoder, ByteSpan(line).subspan(at, size), storm, ledger);
        at += size;
    }
}

int report(const Storm& storm, const Ledger& ledger, const test::NoisyChannel& channel,
           const FrameDecoder& decoder, double seconds) {
    std::uint64_t intact = 0;
    std::uint64_t missed = 0;
    std::uint64_t damaged_but_right = 0;
    for (std::size_t i = 0; i < ledger.intact.size(); ++i) {
        if (ledger.intact[i]) ++intact;
        if (ledger.intact[i] && !ledger.delivered[i]) ++missed;
        if (!ledger.intact[i] && ledger.delivered[i]) ++damaged_but_right;
    }
    const test::ChannelCounters& line = channel.counters();
    const FrameCounters& counted = decoder.counters();
    fmt::print("line: {} bytes, {} bits flipped, {} bytes dropped, {} inserted\n", line.bytes,
               line.flipped_bits, line.dropped, line.inserted);
    fmt::print("frames sent {}: intact {}, damaged {}\n", storm.frames, intact, storm.frames - intact);
    fmt::print("decoder: good {}, bad crc {}, bad cobs {}, too long {}, bad length {}, bad version {}\n",
               counted.good, counted.bad_crc, counted.bad_cobs, counted.too_long, counted.bad_length,
               counted.bad_version);
    fmt::print("damaged at a delimiter only, delivered right: {}\n", damaged_but_right);
    fmt::print("intact but not delivered: {}\nwrong accepted: {}\ndelivered twice: {}\n", missed,
               ledger.wrong, ledger.doubled);
    fmt::print("{:.1f} s, {:.0f} frames/s sent, damaged, decoded and checked\n", seconds,
               storm.frames / seconds);
    const bool holds = missed == 0 && ledger.wrong == 0 && ledger.doubled == 0 && intact > 0;
    fmt::print("{}\n", holds ? "holds" : "DOES NOT HOLD");
    return holds ? 0 : 1;
}

int run(const Storm& storm) {
    const auto started = std::chrono::steady_clock::now();
    test::NoisyChannel channel(storm.rates, storm.seed);
    SeededRandom chunks(storm.seed + 1);
    FrameDecoder decoder;
    Ledger ledger;
    ledger.intact.resize(storm.frames);
    ledger.delivered.resize(storm.frames);
    Bytes line;
    for (std::uint32_t number = 0; number < storm.frames; ++number) {
        ledger.intact[number] = channel.send(frame_of(storm.seed, number), line);
        if (line.size() < (std::size_t{1} << 16) && number + 1 < storm.frames) continue;
        receive_in_chunks(decoder, line, chunks, storm, ledger);
        line.clear();
    }
    const std::chrono::duration<double> took = std::chrono::steady_clock::now() - started;
    return report(storm, ledger, channel, decoder, took.count());
}

}  // namespace

int main(int argc, char** argv) {
    CLI::App app{"linkstorm: frames through a damaged serial line, with a ledger of each frame's own bytes"};
    Storm storm;
    app.add_option("--ber", storm.rates.bit_error, "probability of each bit to flip")->capture_default_str();
    app.add_option("--drop", storm.rates.byte_drop, "probability of each byte to be lost")
        ->capture_default_str();
    app.add_option("--insert", storm.rates.byte_insert, "probability of a random byte before each byte")
        ->capture_default_str();
    app.add_option("--frames", storm.frames, "frames to send")->capture_default_str();
    app.add_option("--seed", storm.seed, "of frames and damage")->capture_default_str();
    CLI11_PARSE(app, argc, argv);
    return run(storm);
}
