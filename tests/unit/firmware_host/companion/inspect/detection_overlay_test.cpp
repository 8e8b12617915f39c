#include "firmware_host/companion/inspect/detection_overlay.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "tests/support/dot_scene/dot_scene.hpp"
#include "tests/support/temp_folder.hpp"

namespace rig::host {
namespace {

namespace fs = std::filesystem;

GreyImage grey(const test::Picture& picture) {
    return {picture.width_px, picture.height_px, picture.pixels};
}

Observation at(double x, double y, double diameter) {
    return {static_cast<float>(x), static_cast<float>(y), static_cast<float>(diameter), 0.4F, 0.9F};
}

TEST(MeasureEllipse, FindsTheAxesOfADot) {
    for (const double paint : {0.2, 1.9}) {
        for (const double angle : {-1.2, 0.0, 0.5, 1.4}) {
            const test::SceneDot dot{40.3, 39.6, 18.0, 11.0, angle, paint, false};
            const BlobEllipse found =
                measure_ellipse(grey(test::render(test::single_dot_scene(80, 110.0, dot))),
                                at(dot.x_px, dot.y_px, std::sqrt(18.0 * 11.0)));
            EXPECT_NEAR(found.major_px, 9.0, 0.7) << paint << " " << angle;
            EXPECT_NEAR(found.minor_px, 5.5, 0.7) << paint << " " << angle;
            const double off = std::remainder(found.angle_rad - angle, std::numbers::pi);
            EXPECT_NEAR(off, 0.0, 0.08) << paint << " " << angle;
        }
    }
}

TEST(MeasureEllipse, IsACircleWhereNothingCanBeMeasured) {
    const GreyImage flat{60, 60, std::vector<std::uint8_t>(3600, 100)};
    for (const Observation& seen : {at(30, 30, 10), at(0, 0, 10), at(59, 30, 10), at(-50, 700, 10)}) {
        const BlobEllipse found = measure_ellipse(flat, seen);
        EXPECT_EQ(found.major_px, 5.0);
        EXPECT_EQ(found.minor_px, 5.0);
    }
    const GreyImage pixel{1, 1, {7}};
    EXPECT_EQ(measure_ellipse(pixel, at(0, 0, 6)).major_px, 3.0);
}

TEST(OverlayPaths, AreOneForEachImage) {
    const test::TempFolder folder;
    const fs::path out = folder / "out.png";
    EXPECT_EQ(overlay_paths(out, {"x/a.pgm"}), (std::vector<fs::path>{out}));
    EXPECT_EQ(overlay_paths(out, {"x/a.pgm", "x/b.png"}),
              (std::vector<fs::path>{folder / "out_a.png", folder / "out_b.png"}));
    EXPECT_EQ(overlay_paths(folder.path(), {"x/a.pgm", "x/b.png"}),
              (std::vector<fs::path>{folder / "a.png", folder / "b.png"}));
    const fs::path fresh = folder / "new/";
    EXPECT_EQ(overlay_paths(fresh, {"x/a.pgm"}), (std::vector<fs::path>{fresh / "a.png"}));
    EXPECT_TRUE(fs::is_directory(fresh));
}

TEST(OverlayPaths, RefuseWhatWouldSurprise) {
    const test::TempFolder folder;
    const auto fault = [](const Result<std::vector<fs::path>, FileError>& result) {
        return result ? std::string("none") : result.error().message;
    };
    EXPECT_NE(fault(overlay_paths(folder / "out.jpg", {"a.pgm"})).find(".png"), std::string::npos);
    EXPECT_NE(fault(overlay_paths(folder / "nowhere", {"a.pgm"})).find("no such folder"), std::string::npos);
    const std::string twice = fault(overlay_paths(folder.path(), {"x/a.pgm", "y/a.pgm"}));
    EXPECT_NE(twice.find("y/a.pgm"), std::string::npos) << twice;
    const GreyImage image{8, 8, std::vector<std::uint8_t>(64, 9)};
    ASSERT_TRUE(write_grey_image(folder / "a.png", image.view()));
    const std::string same = fault(overlay_paths(folder.path(), {folder / "a.png"}));
    EXPECT_NE(same.find("would replace an image"), std::string::npos) << same;
}

TEST(DrawDetections, DrawsOverTheImageAndBelowIt) {
    const test::TempFolder folder;
    const GreyImage image =
        grey(test::render(test::single_dot_scene(80, 110.0, {40, 40, 14, 14, 0, 0.2, false})));
    const std::vector<Observation> seen{at(40, 40, 14)};
    ASSERT_TRUE(draw_detections(folder / "with.png", image, seen));
    ASSERT_TRUE(draw_detections(folder / "without.png", image, {}));
    const auto with = read_grey_image(folder / "with.png");
    const auto without = read_grey_image(folder / "without.png");
    ASSERT_TRUE(with && without);
    EXPECT_EQ(with->width_px, 160);
    EXPECT_GT(with->height_px, 160);
    const auto pixel = [](const GreyImage& picture, int x, int y) {
        return picture.pixels[static_cast<std::size_t>(y * picture.width_px + x)];
    };
    // the cross in the dark middle, the outline a pixel or two outside of the edge, skin untouched
    EXPECT_GT(pixel(*with, 80, 80), pixel(*without, 80, 80) + 40);
    int brightest = 0;
    for (int x = 60; x <= 68; ++x)
        brightest = std::max(brightest, pixel(*with, x, 80) - pixel(*without, x, 80));
    EXPECT_GT(brightest, 30);
    EXPECT_EQ(pixel(*with, 20, 130), pixel(*without, 20, 130));
    const auto nowhere = draw_detections(folder / "no" / "such" / "a.png", image, seen);
    ASSERT_FALSE(nowhere);
}

}  // namespace
}  // namespace rig::host
