// The verb's certificate of every frame, as --report writes it.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>

#include "firmware_host/companion/commands/verbs.hpp"
#include "firmware_host/companion/files/csv.hpp"
#include "firmware_host/companion/files/npy.hpp"
#include "firmware_host/companion/files/whole_file.hpp"
#include "firmware_host/companion/train/pack_writer.hpp"
#include "firmware_host/companion/train/train.hpp"
#include "tests/support/pack_samples/tiny_rig.hpp"
#include "tests/support/temp_folder.hpp"
#include "tests/unit/firmware_host/companion/commands/verb_run.hpp"

namespace rig::host {
namespace {

constexpr std::size_t kFrames = 120;
constexpr std::size_t kMarkers = 24;
constexpr std::size_t kHidden = 100;  // from here on no marker is seen

// The markers of the take, in the face frame.
NpyArray<float> stream_of(const test::TinyRig& tiny, const TrainedPack& pack) {
    NpyArray<float> out{{kFrames, kMarkers, 3}, {}};
    const std::size_t n = pack.shape_names.size();
    for (std::size_t f = 0; f < kFrames; ++f) {
        for (std::size_t r = 0; r < 3 * kMarkers; ++r) {
            float x = pack.neutral_mm[r];
            for (std::size_t i = 0; i < n; ++i) x += pack.basis_mm[r * n + i] * tiny.take.weights[f * n + i];
            out.values.push_back(f < kHidden ? x : std::numeric_limits<float>::quiet_NaN());
        }
    }
    return out;
}

TEST(SolveVerb, WritesTheCertificateOfEveryFrame) {
    const test::TempFolder folder;
    const test::TinyRig tiny = test::tiny_rig(kMarkers, 5, kFrames);
    const auto pack = train(tiny.rig, tiny.layout, {});
    ASSERT_TRUE(pack) << pack.error().message;
    ASSERT_TRUE(save_pack(folder / "tiny.pack", pack->view(), {}));
    ASSERT_TRUE(write_npy(folder / "m.npy", stream_of(tiny, *pack)));
    const auto outcome = test::run_verb(
        add_solve_verb,
        {"solve", "--pack", (folder / "tiny.pack").string(), "--markers", (folder / "m.npy").string(),
         "--no-stabilise", "--out", (folder / "w.csv").string(), "--report", (folder / "r.csv").string()});
    ASSERT_EQ(outcome.exit_code, kExitOk) << outcome.err;
    const auto text = read_whole_text(folder / "r.csv");
    ASSERT_TRUE(text);
    auto rows = CsvReader::open(*text, "r.csv");
    ASSERT_TRUE(rows) << rows.error().message;
    const auto number = [&](const std::string& column) {
        const auto at = std::ranges::find(rows->columns(), column);
        EXPECT_NE(at, rows->columns().end()) << column;
        if (at == rows->columns().end()) return std::nan("");
        return rows->number(static_cast<std::size_t>(at - rows->columns().begin())).value_or(std::nan(""));
    };
    double changes = 0.0;
    std::size_t frames = 0;
    while (rows->next().value_or(false)) {
        const bool seen = frames < kHidden;
        EXPECT_EQ(number("frame"), static_cast<double>(frames));
        EXPECT_EQ(number("optimal"), seen ? 1.0 : 0.0) << "frame " << frames;
        EXPECT_EQ(number("markers_used"), seen ? 24.0 : 0.0);
        EXPECT_GE(number("kkt"), 0.0);
        EXPECT_LE(number("kkt"), 1e-5);
        EXPECT_GE(number("objective"), 0.0);
        EXPECT_EQ(number("iterations") > 0.0, seen) << "frame " << frames;
        EXPECT_GE(number("working_set_changes"), 0.0);
        changes += number("working_set_changes");
        ++frames;
    }
    EXPECT_EQ(frames, kFrames);
    EXPECT_GT(changes, 0.0);  // shapes come and go in this take
}

}  // namespace
}  // namespace rig::host
