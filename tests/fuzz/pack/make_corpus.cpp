// fuzz_pack_corpus FOLDER    writes the seed packs of fuzz_pack: valid ones whose hashes are all zero.
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <string>

#include "firmware_host/companion/train/pack_writer.hpp"
#include "tests/support/pack_samples/sample_pack.hpp"

namespace {

void no_hash(rig::ByteSpan, rig::Hash& digest) {
    digest.fill(std::byte{0});
}

bool save(const std::filesystem::path& path, const rig::test::SamplePackSize& size,
          const rig::host::PackIdentity& identity) {
    const rig::test::SamplePack sample(size);
    const std::vector<std::byte> bytes = rig::host::write_pack(sample.view, identity, no_hash);
    std::ofstream out(path, std::ios::binary);
    out.write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
    return static_cast<bool>(out.flush());
}

}  // namespace

int main(int argc, char** argv) {
    if (argc != 2) {
        std::fputs("usage: fuzz_pack_corpus FOLDER\n", stderr);
        return 2;
    }
    const std::filesystem::path folder = argv[1];
    using enum rig::SolverKind;
    const bool ok =
        save(folder / "boxqp", {}, {}) &&
        save(folder / "no_camera", {.solver = kNonNegative, .cameras = 0}, {}) &&
        save(folder / "rbf", {.solver = kRbf}, {.name = "rbf", .boards = {"sim"}}) &&
        save(folder / "key_shapes", {.solver = kKeyShapes}, {}) &&
        save(folder / "examples", {.markers = 5, .shapes = 3, .solver = kExamples, .cameras = 0}, {}) &&
        save(folder / "marker_sets", {.cameras = 0, .marker_sets = true}, {}) &&
        save(folder / "reference_marks", {.cameras = 2, .reference_marks = 3}, {}) &&
        save(folder / "four_cameras", {.markers = 5, .shapes = 1, .solver = kLeastSquares, .cameras = 4}, {});
    return ok ? 0 : 4;
}
