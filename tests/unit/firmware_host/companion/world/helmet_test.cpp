#include "firmware_host/companion/world/helmet.hpp"

#include <gtest/gtest.h>

#include <fstream>

#include "tests/support/temp_folder.hpp"
#include "tests/unit/firmware_host/companion/world/test_head.hpp"

namespace rig::host {
namespace {

TEST(Helmet, SeesWhatTheFormulaSays) {
    for (const HelmetCamera& camera : default_helmet(4)) {
        for (const Vec3d& p : {Vec3d{0, 0, 20}, Vec3d{50, -90, -5}, Vec3d{-55, 40, 10}}) {
            const double dx = p[0] - camera.centre_mm[0], dy = p[1] - camera.centre_mm[1],
                         dz = p[2] - camera.centre_mm[2];
            const auto& r = camera.rotation;
            const double x = r[0] * dx + r[1] * dy + r[2] * dz;
            const double y = r[3] * dx + r[4] * dy + r[5] * dz;
            const double z = r[6] * dx + r[7] * dy + r[8] * dz;
            const double u = x / z, v = y / z, r2 = u * u + v * v;
            const double scale = 1.0 + camera.k1 * r2 + camera.k2 * r2 * r2;
            const PixelAt seen = see(camera, p);
            EXPECT_NEAR(seen.x_px, camera.f_px * u * scale + camera.cx_px, 1e-9);
            EXPECT_NEAR(seen.y_px, camera.f_px * v * scale + camera.cy_px, 1e-9);
            EXPECT_NEAR(seen.depth_mm, z, 1e-9);
        }
    }
}

TEST(Helmet, SlopeOfAPixelUndoesTheLens) {
    for (const double k1 : {-0.2, -0.11, 0.0, 0.15}) {
        const HelmetCamera camera = rig::test::straight_camera(k1, 0.02);
        for (const double x : {0.0, 31.7, 126.3, 255.0}) {
            for (const double y : {0.0, 129.6, 240.2}) {
                const RaySlope slope = slope_of_pixel(camera, x, y);
                const PixelAt back =
                    see(camera, camera.centre_mm + Vec3d{100.0 * slope.x, -100.0 * slope.y, -100.0});
                EXPECT_NEAR(back.x_px, x, 1e-9);
                EXPECT_NEAR(back.y_px, y, 1e-9);
            }
        }
    }
}

TEST(Helmet, APixelBeyondTheFoldOfTheLensSeesNothing) {
    // r (1 - r^2) is largest at r = 0.577 and never reaches 0.5.
    const HelmetCamera camera = rig::test::straight_camera(-1.0, 0.0);
    EXPECT_TRUE(std::isnan(slope_of_pixel(camera, camera.cx_px + 0.5 * camera.f_px, camera.cy_px).x));
    EXPECT_FALSE(std::isnan(slope_of_pixel(camera, camera.cx_px + 0.3 * camera.f_px, camera.cy_px).x));
}

TEST(Helmet, BehindTheCameraHasNoPixel) {
    const HelmetCamera camera = rig::test::straight_camera();
    EXPECT_LT(see(camera, {0, 0, 300}).depth_mm, 0.0);
}

TEST(Helmet, DefaultsLookAtTheFaceUpright) {
    for (std::size_t count = 1; count <= 4; ++count) {
        const auto cameras = default_helmet(count);
        ASSERT_EQ(cameras.size(), count);
        for (const HelmetCamera& camera : cameras) {
            const PixelAt nose = see(camera, {0, -33, 20});
            EXPECT_NEAR(nose.x_px, camera.cx_px, 1e-6);
            EXPECT_NEAR(nose.y_px, camera.cy_px, 1e-6);
            EXPECT_LT(see(camera, {0, 0, 20}).y_px, nose.y_px) << "up is up";
            EXPECT_GT(see(camera, {20, -33, 20}).x_px, nose.x_px)
                << "the subject's left is the picture's right";
            // Everything that a layout may carry, with an open jaw and four millimetres of slip.
            for (const Vec3d& p :
                 {Vec3d{0, 64, 8}, Vec3d{60, 45, -5}, Vec3d{-60, 45, -5}, Vec3d{0, -135, 10}}) {
                const PixelAt seen = see(camera, p);
                EXPECT_GT(seen.x_px, 10.0);
                EXPECT_LT(seen.x_px, camera.width_px - 10.0);
                EXPECT_GT(seen.y_px, 10.0);
                EXPECT_LT(seen.y_px, camera.height_px - 10.0);
            }
        }
    }
}

TEST(Helmet, FileRoundTrip) {
    const rig::test::TempFolder folder;
    const auto cameras = default_helmet(3);
    ASSERT_TRUE(save_helmet(folder / "cameras.json", cameras, 1.9, "60"));
    const auto back = load_helmet(folder / "cameras.json");
    ASSERT_TRUE(back) << back.error().message;
    ASSERT_EQ(back->size(), 3U);
    for (std::size_t c = 0; c < 3; ++c) {
        EXPECT_EQ((*back)[c].name, cameras[c].name);
        EXPECT_EQ((*back)[c].rotation, cameras[c].rotation);
        EXPECT_EQ((*back)[c].centre_mm, cameras[c].centre_mm);
        EXPECT_EQ((*back)[c].f_px, cameras[c].f_px);
        EXPECT_EQ((*back)[c].k2, cameras[c].k2);
    }
}

TEST(Helmet, BadFilesAreRefusedByName) {
    const rig::test::TempFolder folder;
    ASSERT_TRUE(save_helmet(folder / "good.json", default_helmet(2), 1.9, "60"));
    std::ifstream good(folder / "good.json");
    const std::string text((std::istreambuf_iterator<char>(good)), {});
    const auto replaced = [&](const std::string& from, const std::string& to) {
        std::string changed = text;
        const std::size_t at = changed.find(from);
        EXPECT_NE(at, std::string::npos) << from;
        return changed.replace(at, from.size(), to);
    };
    const std::size_t cameras = text.find("\"cameras\"");
    for (const std::string& bad : {
             std::string(),
             std::string("{"),
             std::string("[]"),
             std::string("{\"cameras\": []}"),
             std::string("{\"cameras\": 3}"),
             std::string("{\"cameras\": [{\"camera\": \"a\"}]}"),
             text.substr(0, text.size() / 2),
             text.substr(0, cameras) + "\"cameras\": [null]}",
             replaced("\"centre_mm\"", "\"center_mm\""),
             replaced("\"R\"", "\"Q\""),
             replaced("\"camera\": \"a\",\n   \"width\": 480", "\"camera\": \"a\",\n   \"width\": 481"),
             replaced("\"camera\": \"b\",\n   \"width\": 480", "\"camera\": \"b\",\n   \"width\": -480"),
             replaced("\"camera\": \"b\",\n   \"width\": 480", "\"camera\": \"b\",\n   \"width\": \"wide\""),
         }) {
        std::ofstream(folder / "bad.json", std::ios::trunc) << bad;
        const auto loaded = load_helmet(folder / "bad.json");
        ASSERT_FALSE(loaded) << bad;
        EXPECT_NE(loaded.error().message.find("bad.json"), std::string::npos);
    }
    EXPECT_FALSE(load_helmet(folder / "absent.json"));
}

TEST(Helmet, AMatrixThatIsNoRotationIsRefused) {
    const rig::test::TempFolder folder;
    auto cameras = default_helmet(1);
    cameras[0].rotation[0] *= 1.01;
    ASSERT_TRUE(save_helmet(folder / "c.json", cameras, 1.9, "60"));
    EXPECT_FALSE(load_helmet(folder / "c.json"));
    cameras = default_helmet(1);
    for (std::size_t k = 0; k < 3; ++k) cameras[0].rotation[k] = -cameras[0].rotation[k];  // a mirror
    ASSERT_TRUE(save_helmet(folder / "c.json", cameras, 1.9, "60"));
    EXPECT_FALSE(load_helmet(folder / "c.json"));
}

}  // namespace
}  // namespace rig::host
