// The verb as a script meets it: rows on standard output, errors by file, exit codes.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include "firmware_host/companion/commands/verbs.hpp"
#include "firmware_host/companion/files/image_file.hpp"
#include "tests/support/dot_scene/dot_scene.hpp"
#include "tests/support/temp_folder.hpp"
#include "tests/unit/firmware_host/companion/commands/verb_run.hpp"

namespace {

using namespace rig;
namespace fs = std::filesystem;

test::VerbOutcome run(std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), "detect");
    return test::run_verb(host::add_detect_verb, std::move(arguments));
}

std::vector<std::string> lines_with(const std::string& text, const std::string& start) {
    std::vector<std::string> lines;
    std::istringstream stream(text);
    for (std::string line; std::getline(stream, line);) {
        if (line.starts_with(start)) lines.push_back(line);
    }
    return lines;
}

class DetectVerb : public testing::Test {
  protected:
    fs::path write(const std::string& name, const test::Scene& scene) {
        const fs::path path = folder.path() / name;
        EXPECT_TRUE(host::write_grey_image(path, test::render(scene).view()));
        return path;
    }
    test::TempFolder folder;
};

constexpr const char* kHeader = "image,x_px,y_px,diameter_px,contrast,score";

TEST_F(DetectVerb, RowsHaveTheImagesStemAndSixFields) {
    const fs::path dark = write("dark.pgm", test::lattice_scene(10, 2, false, 1));
    const test::VerbOutcome outcome = run({dark.string()});
    EXPECT_EQ(outcome.exit_code, host::kExitOk) << outcome.err;
    EXPECT_TRUE(outcome.out.starts_with(std::string(kHeader) + "\n"));
    const auto rows = lines_with(outcome.out, "dark,");
    EXPECT_GT(rows.size(), 150U);
    for (const std::string& row : rows) EXPECT_EQ(std::count(row.begin(), row.end(), ','), 5);
}

TEST_F(DetectVerb, AnImageGivesTheSameRowsAloneAndInAnyList) {
    const fs::path dark = write("dark.png", test::lattice_scene(10, 2, false, 1));
    const fs::path bright = write("bright.pgm", test::lattice_scene(10, 2, true, 2));
    const auto alone = lines_with(run({dark.string()}).out, "dark,");
    std::vector<std::string> many(12, bright.string());
    many.push_back(dark.string());
    EXPECT_EQ(lines_with(run(many).out, "dark,"), alone);
    EXPECT_GT(alone.size(), 150U);
}

TEST_F(DetectVerb, BadFilesAreNamedAndTheOthersStillDone) {
    const fs::path good = write("good.pgm", test::lattice_scene(10, 2, false, 1));
    const fs::path cut = folder.path() / "cut.pgm";
    std::ofstream(cut, std::ios::binary) << "P5\n640 480\n255\nonly a few bytes";
    const fs::path text = folder.path() / "text.png";
    std::ofstream(text) << "this is no picture";
    const fs::path missing = folder.path() / "missing.jpg";
    const test::VerbOutcome outcome = run({cut.string(), text.string(), missing.string(), good.string()});
    EXPECT_EQ(outcome.exit_code, host::kExitInput);
    for (const char* name : {"cut.pgm", "text.png", "missing.jpg"})
        EXPECT_NE(outcome.err.find(name), std::string::npos) << outcome.err;
    EXPECT_GT(lines_with(outcome.out, "good,").size(), 150U);
}

TEST_F(DetectVerb, TooLargeAPictureIsAnErrorThatSaysTheLimit) {
    test::Picture large{2000, 8, std::vector<std::uint8_t>(16000, 50)};
    const fs::path path = folder.path() / "large.pgm";
    ASSERT_TRUE(host::write_grey_image(path, large.view()));
    const test::VerbOutcome outcome = run({path.string()});
    EXPECT_EQ(outcome.exit_code, host::kExitInput);
    EXPECT_NE(outcome.err.find("1920"), std::string::npos) << outcome.err;
}

TEST_F(DetectVerb, WrongOptionsAreUsageErrors) {
    const fs::path image = write("a.pgm", test::lattice_scene(10, 2, false, 1));
    EXPECT_EQ(run({image.string(), "--polarity", "green"}).exit_code, host::kExitUsage);
    EXPECT_EQ(run({}).exit_code, host::kExitUsage);
    EXPECT_EQ(run({image.string(), "--max-diameter", "500"}).exit_code, host::kExitUsage);
}

TEST_F(DetectVerb, TheWrongPolarityFindsNothingAndPolaritiesCanBeSaid) {
    const fs::path image = write("a.pgm", test::lattice_scene(10, 2, false, 1));
    EXPECT_GT(lines_with(run({image.string(), "--polarity", "dark"}).out, "a,").size(), 150U);
    EXPECT_LT(lines_with(run({image.string(), "--polarity", "bright"}).out, "a,").size(), 5U);
}

TEST_F(DetectVerb, OverlaysAreWrittenOnePerImage) {
    const fs::path a = write("a.pgm", test::lattice_scene(10, 2, false, 1));
    const fs::path b = write("b.pgm", test::lattice_scene(10, 2, false, 2));
    const fs::path picture = folder.path() / "out.png";
    EXPECT_EQ(run({a.string(), "--overlay", picture.string()}).exit_code, host::kExitOk);
    EXPECT_TRUE(fs::exists(picture));
    EXPECT_EQ(run({a.string(), b.string(), "--overlay", picture.string()}).exit_code, host::kExitOk);
    const auto drawn = host::read_grey_image(folder.path() / "out_b.png");
    ASSERT_TRUE(drawn);
    EXPECT_EQ(drawn->width_px, 960);
    EXPECT_EQ(run({a.string(), "--overlay", (folder.path() / "no" / "such" / "out.png").string()}).exit_code,
              host::kExitOutput);
    const std::string dots = (folder.path() / "dots").string();
    EXPECT_EQ(run({a.string(), b.string(), "--overlay", dots}).exit_code, host::kExitUsage);
    EXPECT_EQ(run({a.string(), b.string(), "--overlay", dots + "/"}).exit_code, host::kExitOk);
    EXPECT_TRUE(fs::exists(folder.path() / "dots" / "a.png"));
    EXPECT_TRUE(fs::exists(folder.path() / "dots" / "b.png"));
}

}  // namespace
