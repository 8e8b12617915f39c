// The pictures themselves: where dots are, what hides them, what light and controls do. References are
// formulas and brute force in double, written here.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "firmware_host/companion/files/csv.hpp"
#include "firmware_host/companion/world/world.hpp"
#include "tests/support/shared_data.hpp"
#include "tests/unit/firmware_host/companion/world/test_head.hpp"

namespace rig::host {
namespace {

using rig::test::clean_config;
using rig::test::flat_head;
using rig::test::make_world;
using rig::test::straight_camera;

struct Picture {
    int width_px;
    std::vector<std::uint8_t> pixels;
    std::vector<MarkerSight> sights;
    [[nodiscard]] double at(int x, int y) const { return pixels[static_cast<std::size_t>(y * width_px + x)]; }
};

Picture draw(const World& world, std::size_t frame, const CameraControl& control = {}) {
    WorldRenderer renderer(world);
    Picture picture{world.cameras()[0].width_px, std::vector<std::uint8_t>(world.image_bytes()),
                    std::vector<MarkerSight>(world.marker_count())};
    renderer.render(frame, 0, control, picture.pixels, picture.sights);
    return picture;
}

// Area centroid of a disc on the sheet z = 20 in the image of a straight camera, by 12 x 12 samples a pixel.
// The sheet is unstretched and lifted by lift_mm.
struct Blob {
    double x = 0.0, y = 0.0, area = 0.0;
};
Blob disc_in_image(const HelmetCamera& camera, double x_mm, double y_mm, double radius_mm, double near_x,
                   double near_y) {
    constexpr int kSamples = 12;
    Blob blob;
    for (int row = static_cast<int>(near_y) - 9; row <= static_cast<int>(near_y) + 9; ++row) {
        for (int column = static_cast<int>(near_x) - 9; column <= static_cast<int>(near_x) + 9; ++column) {
            for (int i = 0; i < kSamples * kSamples; ++i) {
                const double px = column - 0.5 + (i % kSamples + 0.5) / kSamples;
                const double py = row - 0.5 + (i / kSamples + 0.5) / kSamples;
                // Undo the lens by fixed-point iteration.
                const double xd = (px - camera.cx_px) / camera.f_px, yd = (py - camera.cy_px) / camera.f_px;
                double u = xd, v = yd;
                for (int step = 0; step < 12; ++step) {
                    const double r2 = u * u + v * v, s = 1.0 + camera.k1 * r2 + camera.k2 * r2 * r2;
                    u = xd / s;
                    v = yd / s;
                }
                const double depth = camera.centre_mm[2] - 20.0;
                if (std::hypot(u * depth - x_mm, -v * depth - y_mm) > radius_mm) continue;
                blob.x += px;
                blob.y += py;
                blob.area += 1.0;
            }
        }
    }
    blob.x /= blob.area;
    blob.y /= blob.area;
    blob.area /= kSamples * kSamples;
    return blob;
}

// Coverage-weighted centre of a dark dot, against a plane through the skin around it: skin tone has slopes of
// its own.
Blob measured(const Picture& picture, double near_x, double near_y) {
    constexpr double kBlack = 2.0;
    const int cx = static_cast<int>(std::lround(near_x)), cy = static_cast<int>(std::lround(near_y));
    double sum = 0.0, slope_x = 0.0, slope_y = 0.0, squares = 0.0, count = 0.0;
    for (int y = -9; y <= 9; ++y) {
        for (int x = -9; x <= 9; ++x) {
            if (std::max(std::abs(x), std::abs(y)) < 8) continue;
            const double value = picture.at(cx + x, cy + y) - kBlack;
            sum += value;
            slope_x += x * value;
            slope_y += y * value;
            squares += x * x;
            count += 1.0;
        }
    }
    const auto skin = [&](int x, int y) { return sum / count + (slope_x * x + slope_y * y) / squares; };
    const double ink = (picture.at(cx, cy) - kBlack) / skin(0, 0);
    Blob blob;
    for (int y = -7; y <= 7; ++y) {
        for (int x = -7; x <= 7; ++x) {
            const double lost = 1.0 - (picture.at(cx + x, cy + y) - kBlack) / skin(x, y);
            const double share = std::clamp(lost / (1.0 - ink) - 0.08, 0.0, 0.84) / 0.84;
            blob.x += share * (cx + x);
            blob.y += share * (cy + y);
            blob.area += share;
        }
    }
    blob.x /= blob.area;
    blob.y /= blob.area;
    return blob;
}

class DotsOnASheet : public ::testing::TestWithParam<double> {};

TEST_P(DotsOnASheet, AreWhereTheFormulaPutsThem) {
    const HelmetCamera camera = straight_camera(GetParam(), 0.03);
    auto head = flat_head();
    for (std::size_t frame = 0; frame < 40; ++frame)
        head.take.weights[2 * frame + 1] = 0.0F;  // lifted, not stretched
    const auto world = make_world(head, clean_config(camera));
    double worst_seen = 0.0, squares = 0.0;
    int count = 0;
    for (std::size_t frame = 0; frame < 40; frame += 13) {
        const Picture picture = draw(*world, frame);
        const double lift = 10.0 * static_cast<double>(head.take.weights[2 * frame]);
        for (std::size_t m = 0; m < 9; ++m) {
            const double x_mm = 30.0 * (static_cast<double>(m % 3) - 1.0);
            const double y_mm = 30.0 * (static_cast<double>(m / 3) - 1.0) + lift;
            const MarkerSight& sight = picture.sights[m];
            EXPECT_TRUE(sight.visible);
            EXPECT_NEAR(sight.cos_view,
                        (camera.centre_mm[2] - 20.0) / std::hypot(x_mm, y_mm, camera.centre_mm[2] - 20.0),
                        1e-4);
            const PixelAt centre = see(camera, {x_mm, y_mm, 20.0});
            EXPECT_NEAR(sight.x_px, centre.x_px, 1e-4);
            EXPECT_NEAR(sight.y_px, centre.y_px, 1e-4);
            const Blob disc = disc_in_image(camera, x_mm, y_mm, 1.9, centre.x_px, centre.y_px);
            EXPECT_NEAR(sight.dot_x_px, disc.x, 0.03);
            EXPECT_NEAR(sight.dot_y_px, disc.y, 0.03);
            EXPECT_NEAR(sight.dot_area_px, disc.area, 0.03 * disc.area);
            const Blob blob = measured(picture, centre.x_px, centre.y_px);
            const double error = std::hypot(blob.x - disc.x, blob.y - disc.y);
            worst_seen = std::max(worst_seen, error);
            squares += error * error;
            ++count;
        }
    }
    EXPECT_LT(std::sqrt(squares / count), 0.03) << "the picture's own centre of a dot";
    EXPECT_LT(worst_seen, 0.08);
}

INSTANTIATE_TEST_SUITE_P(Lenses, DotsOnASheet, ::testing::Values(0.0, -0.12, -0.3, 0.1));

TEST(WorldPicture, DotsStretchWithTheSkin) {
    auto head = flat_head();
    head.rig.shapes[1].delta_mm.clear();
    for (const auto& v : head.rig.vertices_mm)
        head.rig.shapes[1].delta_mm.push_back({0.5F * v[0], 0.0F, 0.0F});
    head.take.weights = {0.0F, 0.0F, 0.0F, 1.0F};
    head.take.frame_count = 2;
    const auto world = make_world(head, clean_config(straight_camera()));
    const double rest = draw(*world, 0).sights[4].dot_area_px;
    EXPECT_NEAR(draw(*world, 1).sights[4].dot_area_px, 1.5 * rest, 0.03 * rest);
}

TEST(WorldPicture, AFaceHidesItsOwnMarkers) {
    const auto open = make_world(flat_head(), clean_config(straight_camera()));
    const auto hidden = make_world(flat_head(true), clean_config(straight_camera()));
    const Picture before = draw(*open, 0), after = draw(*hidden, 0);
    for (std::size_t m = 0; m < 9; ++m) {
        const bool behind = m % 3 == 0;  // x = -30
        EXPECT_TRUE(before.sights[m].visible);
        EXPECT_EQ(after.sights[m].visible, !behind) << m;
        EXPECT_EQ(after.sights[m].dot_area_px > 0.0, !behind) << m;
        const int x = static_cast<int>(std::lround(before.sights[m].x_px)),
                  y = static_cast<int>(std::lround(before.sights[m].y_px));
        EXPECT_LT(before.at(x, y), 0.4 * before.at(x + 9, y)) << "a dot";
        if (behind) {
            EXPECT_GT(after.at(x, y), 0.7 * after.at(x + 9, y)) << "no dot";
        }
    }
}

TEST(WorldPicture, SkinThatFacesAwayIsNotSeen) {
    auto config = clean_config(straight_camera());
    config.cameras[0].rotation = {-1, 0, 0, 0, -1, 0, 0, 0, 1};  // from behind the sheet
    config.cameras[0].centre_mm = {0, 0, -210};
    const Picture picture = draw(*make_world(flat_head(), config), 0);
    for (const MarkerSight& sight : picture.sights) {
        EXPECT_FALSE(sight.visible);
        EXPECT_LT(sight.cos_view, 0.0);
    }
    EXPECT_EQ(*std::max_element(picture.pixels.begin(), picture.pixels.end()),
              *std::min_element(picture.pixels.begin(), picture.pixels.end()));
}

TEST(WorldPicture, MarkersOutsideTheImageAreNotVisible) {
    auto config = clean_config(straight_camera());
    config.cameras[0].f_px = 1900.0;
    const Picture picture = draw(*make_world(flat_head(), config), 0);
    for (std::size_t m = 0; m < 9; ++m) EXPECT_EQ(picture.sights[m].visible, m == 4) << m;
}

double mean(const Picture& picture) {
    double sum = 0.0;
    for (const std::uint8_t v : picture.pixels) sum += v;
    return sum / static_cast<double>(picture.pixels.size());
}

TEST(WorldPicture, ExposureAndGainBrighten) {
    const auto world = make_world(flat_head(), clean_config(straight_camera()));
    const double black = mean(draw(*world, 0, {0.0F, 0.0F}));
    const double one = mean(draw(*world, 0, {500.0F, 0.0F})) - black;
    EXPECT_GT(one, 5.0);
    EXPECT_NEAR(mean(draw(*world, 0, {1000.0F, 0.0F})) - black, 2.0 * one, 0.02 * one);
    EXPECT_NEAR(mean(draw(*world, 0, {500.0F, 6.0206F})) - black, 2.0 * one, 0.02 * one);
    EXPECT_EQ(mean(draw(*world, 0, {100000.0F, 48.0F})), 255.0);
}

TEST(WorldPicture, NoiseHasTheStatedSize) {
    auto config = clean_config(straight_camera());
    const Picture quiet = draw(*make_world(flat_head(), config), 0);
    config.noise = 1.0;
    const Picture noisy = draw(*make_world(flat_head(), config), 0);
    double sum = 0.0, squares = 0.0, expected = 0.0;
    for (std::size_t i = 0; i < quiet.pixels.size(); ++i) {
        const double difference = static_cast<double>(noisy.pixels[i]) - static_cast<double>(quiet.pixels[i]);
        sum += difference;
        squares += difference * difference;
        // shot: 39 electrons a DN above a black level of 2; read: 0.55 DN; rounding twice: 1/12 each
        expected += (static_cast<double>(quiet.pixels[i]) - 2.0) / 39.0 + 0.55 * 0.55 + 2.0 / 12.0;
    }
    const auto count = static_cast<double>(quiet.pixels.size());
    EXPECT_NEAR(sum / count, 0.0, 0.05);
    EXPECT_NEAR(squares / count, expected / count, 0.05 * expected / count);
}

TEST(WorldPicture, DefocusSpreadsADotAndKeepsItsCentre) {
    auto config = clean_config(straight_camera());
    const Picture sharp = draw(*make_world(flat_head(), config), 0);
    config.defocus_px = 1.2;
    const Picture soft = draw(*make_world(flat_head(), config), 0);
    const auto& sight = sharp.sights[4];
    const int x = static_cast<int>(std::lround(sight.x_px)), y = static_cast<int>(std::lround(sight.y_px));
    EXPECT_GT(soft.at(x, y), sharp.at(x, y));
    const Blob a = measured(sharp, sight.x_px, sight.y_px), b = measured(soft, sight.x_px, sight.y_px);
    EXPECT_LT(std::hypot(a.x - b.x, a.y - b.y), 0.05);
}

TEST(WorldPicture, RetroDotsAreBrighterThanSkin) {
    auto config = clean_config(straight_camera());
    config.style = DotStyle::kRetro;
    const Picture picture = draw(*make_world(flat_head(), config), 0);
    for (const MarkerSight& sight : picture.sights) {
        const int x = static_cast<int>(std::lround(sight.x_px)),
                  y = static_cast<int>(std::lround(sight.y_px));
        EXPECT_GT(picture.at(x, y), 1.5 * picture.at(x + 9, y));
    }
}

TEST(WorldPicture, ProjectsTheReferenceImagesMarkersWhereTheyAre) {
    RIG_SHARED_DATA_OR_SKIP(rig_folder, "rig");
    RIG_SHARED_DATA_OR_SKIP(take_file, "takes/alex_rom_3_weights60.csv");
    RIG_SHARED_DATA_OR_SKIP(images, "images");
    const auto rig = load_rig(rig_folder);
    ASSERT_TRUE(rig) << rig.error().message;
    const auto layout = load_layout(rig_folder, "60", *rig);
    ASSERT_TRUE(layout);
    const auto take = load_take(take_file, *rig);
    ASSERT_TRUE(take) << take.error().message;
    std::ifstream json_file(images / "cameras.json");
    const auto json = nlohmann::json::parse(json_file);
    std::ifstream csv_file(images / "truth.csv");
    std::stringstream text;
    text << csv_file.rdbuf();
    const std::string contents = text.str();
    auto rows = CsvReader::open(contents, "truth.csv");
    ASSERT_TRUE(rows) << rows.error().message;
    int compared = 0, hidden_differently = 0;
    for (const auto& entry : json.at("images")) {
        HelmetCamera camera;
        camera.name = "c";
        camera.width_px = json.at("width");
        camera.height_px = json.at("height");
        camera.f_px = json.at("f_px");
        camera.cx_px = json.at("cx");
        camera.cy_px = json.at("cy");
        camera.k1 = json.at("k1");
        camera.k2 = json.at("k2");
        for (std::size_t i = 0; i < 9; ++i) camera.rotation[i] = entry.at("R").at(i / 3).at(i % 3);
        for (std::size_t i = 0; i < 3; ++i) camera.centre_mm[i] = entry.at("centre_mm").at(i);
        WorldConfig config;
        config.cameras = {camera};
        config.slip = SlipKind::kNone;
        config.start_frame = entry.at("frame");
        config.frame_count = 1;
        const auto world = World::create(*rig, *layout, *take, config);
        ASSERT_TRUE(world) << world.error().message;
        const Picture picture = draw(**world, 0);
        for (std::size_t m = 0; m < 60; ++m) {
            ASSERT_TRUE(*rows->next());
            EXPECT_NEAR(picture.sights[m].x_px, *rows->number(3), 0.01) << entry.at("image") << ' ' << m;
            EXPECT_NEAR(picture.sights[m].y_px, *rows->number(4), 0.01) << entry.at("image") << ' ' << m;
            EXPECT_NEAR(picture.sights[m].cos_view, *rows->number(9), 0.03) << entry.at("image") << ' ' << m;
            if (*rows->number(9) > 0.35 && *rows->number(8) > 20.0) {
                EXPECT_NEAR(picture.sights[m].dot_x_px, *rows->number(5), 0.1)
                    << entry.at("image") << ' ' << m;
                EXPECT_NEAR(picture.sights[m].dot_y_px, *rows->number(6), 0.1)
                    << entry.at("image") << ' ' << m;
            }
            hidden_differently += picture.sights[m].visible != (*rows->number(7) > 0.5) ? 1 : 0;
            ++compared;
        }
    }
    EXPECT_EQ(compared, 360);
    EXPECT_LE(hidden_differently, 7);  // dots at the very edge of the face
}

}  // namespace
}  // namespace rig::host
