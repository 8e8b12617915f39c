// Prints a digest of the weight stream of each run, so that builds can be compared: -O0 and -O3, two
// compilers, two machines must print the same lines.
//
//   replay_digest            the synthetic face, then 300 frames of every stream named below that
//   ../shared/data holds replay_digest --check    the synthetic face only, twice: exit code 1 when the two
//   differ replay_digest FILE.npy   a marker stream (frames, 60, 3) instead
#include <algorithm>
#include <cstdio>
#include <exception>
#include <memory>
#include <string>

#include "tests/replay/replay_streams.hpp"
#include "tests/support/digest.hpp"
#include "tests/support/shared_data.hpp"
#include "tests/support/synthetic_face.hpp"

namespace rig::test {
namespace {

constexpr int kFrames = 300;

void add_tick(const FaceState& state, const FrameReport& report, Digest& digest) {
    digest.add(std::span<const float>(state.weights)).add(std::span<const float>(state.confidence));
    digest.add(std::span<const float>(state.slip.rotation_rad))
        .add(std::span<const float>(state.slip.translation_mm));
    digest.add(state.state).add(report.objective_mm2).add(report.kkt).add(report.iterations);
}

// A shuffled cloud with gaps, smoothed; then two cameras. The input is rounded to float, so that the last bit
// of the test's own libm cannot reach the digest.
std::uint64_t synthetic_points() {
    SyntheticFaceOptions options;
    options.temporal_gamma_mm2 = 1.0;
    options.duplicate_columns = 1;
    const SyntheticFace face(options);
    auto pipeline = std::make_unique<Pipeline>();
    if (!pipeline->configure(face.pack(), {})) return 0;
    SeededRandom random(7);
    FaceState state;
    FrameReport report;
    Digest digest;
    for (int frame = 0; frame < kFrames; ++frame) {
        const double time_s = frame / 60.0;
        std::vector<Vec3> points = moved(creeping_slip(time_s), face.positions(face.weights_at(time_s)));
        add_noise(points, 0.1, random);
        for (Vec3& point : points) point = point.cast<float>().cast<double>();
        random.shuffle(std::span<Vec3>(points));
        points.resize(points.size() - random.below(6));
        if (frame % 97 > 90) {
            pipeline->idle(frame * 16'667, state, report);
        } else {
            pipeline->step(PointFrame{frame * 16'667, points}, state, report);
        }
        add_tick(state, report, digest);
    }
    return digest.value();
}

std::uint64_t synthetic_cameras() {
    SyntheticFaceOptions options;
    options.camera_count = 2;
    const SyntheticFace face(options);
    auto pipeline = std::make_unique<Pipeline>();
    if (!pipeline->configure(face.pack(), {})) return 0;
    SeededRandom random(8);
    FaceState state;
    FrameReport report;
    Digest digest;
    for (int frame = 0; frame < kFrames; ++frame) {
        const double time_s = frame / 60.0;
        const std::vector<Vec3> points =
            moved(creeping_slip(time_s), face.positions(face.weights_at(time_s)));
        std::array<SyntheticFace::View, 2> views;
        ObservationFrame input;
        input.capture_us = frame * 16'667;
        input.camera_count = 2;
        for (std::size_t c = 0; c < 2; ++c) {
            views[c] = face.observe(c, points, 0.1, 0.02, 1, random);
            input.cameras[c] = views[c].observations;
            input.status[c] = CameraStatus::kGood;
        }
        pipeline->step(input, state, report);
        add_tick(state, report, digest);
    }
    return digest.value();
}

void print(const char* name, std::uint64_t digest) {
    std::printf("%-40s %016llx\n", name, static_cast<unsigned long long>(digest));
    std::fflush(stdout);
}

void print_recorded() {
    for (const char* name :
         {"alex_rom_3/60/combined.npy", "alex_rom_3/60/unlabelled.npy", "facegood_3_15/102/combined.npy"}) {
        const std::filesystem::path file = shared_data(std::string("markers/") + name);
        if (file.empty()) continue;
        ReplayStream stream = read_stream(file);
        stream.frames =
            std::min(stream.frames, std::size_t{kFrames});  // an unoptimised build takes 50 times as long
        const int markers = stream.unlabelled ? 60 : static_cast<int>(stream.slots);
        print(name, run_stream(ReplayPack(shared_data(""), markers), stream, {}).digest);
    }
}

int run(int count, char** arguments) {
    if (count == 2 && std::string(arguments[1]) == "--check") {
        const bool equal =
            synthetic_points() == synthetic_points() && synthetic_cameras() == synthetic_cameras();
        std::printf("%s\n", equal ? "two runs agree" : "two runs DIFFER");
        return equal ? 0 : 1;
    }
    if (count == 2) {
        const ReplayStream stream = read_stream(arguments[1]);
        print(arguments[1], run_stream(ReplayPack(shared_data(""), 60), stream, {}).digest);
        return 0;
    }
    print("synthetic points", synthetic_points());
    print("synthetic cameras", synthetic_cameras());
    print_recorded();
    return 0;
}

}  // namespace
}  // namespace rig::test

int main(int count, char** arguments) {
    try {
        return rig::test::run(count, arguments);
    } catch (const std::exception& error) {
        std::fprintf(stderr, "replay_digest: %s\n", error.what());
        return 3;
    }
}
