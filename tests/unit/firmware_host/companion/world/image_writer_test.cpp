#include "firmware_host/companion/world/image_writer.hpp"

#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "firmware_host/companion/files/csv.hpp"
#include "firmware_host/companion/files/image_file.hpp"
#include "firmware_host/companion/files/npy.hpp"
#include "tests/support/temp_folder.hpp"
#include "tests/unit/firmware_host/companion/world/test_head.hpp"

namespace rig::host {
namespace {

WorldConfig two_cameras() {
    WorldConfig config;
    config.cameras = {rig::test::straight_camera(-0.1, 0.01), rig::test::straight_camera()};
    config.cameras[1].name = "b";
    config.cameras[1].centre_mm[0] = 35.0;
    config.slip = SlipKind::kHard;
    config.frame_count = 12;
    return config;
}

std::string text_of(const std::filesystem::path& path) {
    std::ifstream file(path);
    std::stringstream text;
    text << file.rdbuf();
    return text.str();
}

TEST(ImageWriter, CamerasAndTruthAgreeByThePublishedFormula) {
    const rig::test::TempFolder folder;
    const auto world = rig::test::make_world(rig::test::flat_head(), two_cameras());
    TruthRecorder truth(*world);
    const auto written =
        write_world_images(*world, folder.path(), {.step = 4, .threads = 2, .layout = "9"}, &truth, {});
    ASSERT_TRUE(written) << written.error().message;
    EXPECT_EQ(*written, 6U);
    const auto json = nlohmann::json::parse(text_of(folder / "cameras.json"));
    EXPECT_EQ(json.at("cameras").size(), 2U);
    EXPECT_EQ(json.at("layout"), 9);
    const std::string table = text_of(folder / "truth.csv");
    auto rows = CsvReader::open(table, "truth.csv");
    ASSERT_TRUE(rows);
    for (const auto& entry : json.at("images")) {
        const std::string name = entry.at("image");
        const auto image = read_grey_image(folder / name);
        ASSERT_TRUE(image) << image.error().message;
        EXPECT_EQ(image->width_px, 256);
        for (int m = 0; m < 9; ++m) {
            ASSERT_TRUE(*rows->next());
            EXPECT_EQ(std::string(rows->fields()[0]) + ".pgm", name);
            double p[3];
            for (int i = 0; i < 3; ++i) {
                p[i] = 0.0;
                for (int k = 0; k < 3; ++k) {
                    p[i] += entry.at("R").at(i).at(k).get<double>() *
                            (*rows->number(static_cast<std::size_t>(10 + k)) -
                             entry.at("centre_mm").at(k).get<double>());
                }
            }
            const double u = p[0] / p[2], v = p[1] / p[2], r2 = u * u + v * v;
            const double s = 1.0 + entry.at("k1").get<double>() * r2 + entry.at("k2").get<double>() * r2 * r2;
            EXPECT_NEAR(entry.at("f_px").get<double>() * u * s + entry.at("cx").get<double>(),
                        *rows->number(3), 1e-3);
            EXPECT_NEAR(entry.at("f_px").get<double>() * v * s + entry.at("cy").get<double>(),
                        *rows->number(4), 1e-3);
        }
    }
}

TEST(ImageWriter, TheTruthFolderHoldsEveryFrameAndMarksThoseNotRendered) {
    const rig::test::TempFolder folder;
    const auto world = rig::test::make_world(rig::test::flat_head(), two_cameras());
    TruthRecorder truth(*world);
    ASSERT_TRUE(write_world_images(*world, folder / "pictures", {.step = 6, .threads = 1, .layout = "9"},
                                   &truth, {}));
    ASSERT_TRUE(truth.save(folder / "truth"));
    const auto markers = read_npy<float>(folder / "truth/truth_markers.npy");
    const auto face = read_npy<float>(folder / "truth/truth_face.npy");
    const auto projections = read_npy<float>(folder / "truth/truth_projections.npy");
    ASSERT_TRUE(markers && face && projections);
    EXPECT_EQ(markers->shape, (std::vector<std::size_t>{12, 9, 3}));
    EXPECT_EQ(projections->shape, (std::vector<std::size_t>{12, 2, 9, 3}));
    const std::string table = text_of(folder / "truth/truth_slip.csv");
    auto slip = CsvReader::open(table, "truth_slip.csv");
    ASSERT_TRUE(slip);
    for (std::size_t frame = 0; frame < 12; ++frame) {
        ASSERT_TRUE(*slip->next());
        HeadsetSlip moved;
        for (std::size_t k = 0; k < 3; ++k) {
            moved.rotation_rad[k] = *slip->number(2 + k);
            moved.translation_mm[k] = *slip->number(5 + k);
        }
        for (std::size_t m = 0; m < 9; ++m) {
            const float* at = face->values.data() + 3 * (9 * frame + m);
            const Vec3d observed = moved.apply(
                {static_cast<double>(at[0]), static_cast<double>(at[1]), static_cast<double>(at[2])});
            for (std::size_t k = 0; k < 3; ++k) {
                EXPECT_NEAR(observed[k], static_cast<double>(markers->values[3 * (9 * frame + m) + k]), 1e-4);
            }
            const float visible = projections->values[3 * (18 * frame + m) + 2];
            EXPECT_EQ(visible, frame % 6 == 0 ? 1.0F : -1.0F);
        }
    }
    EXPECT_TRUE(std::filesystem::exists(folder / "truth/truth_weights.csv"));
}

TEST(ImageWriter, AFolderThatCannotBeMadeIsAnError) {
    const rig::test::TempFolder folder;
    std::ofstream(folder / "file") << "x";
    const auto world = rig::test::make_world(rig::test::flat_head(), two_cameras());
    const auto written = write_world_images(*world, folder / "file/pictures", {.layout = "9"}, nullptr, {});
    ASSERT_FALSE(written);
    EXPECT_NE(written.error().message.find("file"), std::string::npos);
}

}  // namespace
}  // namespace rig::host
