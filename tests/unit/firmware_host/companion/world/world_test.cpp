// Truth, refusals, and equal bytes.
#include "firmware_host/companion/world/world.hpp"

#include <gtest/gtest.h>

#include <thread>

#include "firmware_host/companion/files/npy.hpp"
#include "tests/support/digest.hpp"
#include "tests/support/shared_data.hpp"
#include "tests/unit/firmware_host/companion/world/test_head.hpp"

namespace rig::host {
namespace {

using rig::test::clean_config;
using rig::test::flat_head;
using rig::test::make_world;
using rig::test::straight_camera;

TEST(World, TruthIsNeutralPlusShapes) {
    const auto head = flat_head();
    const auto world = make_world(head, clean_config(straight_camera()));
    ASSERT_EQ(world->frame_count(), 40U);
    for (const std::size_t frame : {0U, 7U, 39U}) {
        const FrameTruth truth = world->truth(frame);
        const auto lift = static_cast<double>(head.take.weights[2 * frame]);
        const auto stretch = static_cast<double>(head.take.weights[2 * frame + 1]);
        for (std::size_t m = 0; m < 9; ++m) {
            const double x = 30.0 * (static_cast<double>(m % 3) - 1.0),
                         y = 30.0 * (static_cast<double>(m / 3) - 1.0);
            EXPECT_NEAR(truth.face_mm[m][0], x * (1.0 + 0.1 * stretch), 1e-5);
            EXPECT_NEAR(truth.face_mm[m][1], y + 10.0 * lift, 1e-5);
            EXPECT_NEAR(truth.face_mm[m][2], 20.0, 1e-5);
            EXPECT_EQ(truth.headset_mm[m], truth.face_mm[m]);
        }
    }
}

TEST(World, SlipMovesTheFaceUnderTheCameras) {
    auto config = clean_config(straight_camera());
    config.slip = SlipKind::kHard;
    config.seed = 4;
    const auto world = make_world(flat_head(), config);
    const FrameTruth truth = world->truth(35);
    ASSERT_GT(length(truth.slip.translation_mm), 0.01);
    // R p + t by Rodrigues' formula written out here.
    const Vec3d r = truth.slip.rotation_rad;
    const double angle = length(r);
    const Vec3d k = (1.0 / angle) * r;
    for (std::size_t m = 0; m < 9; ++m) {
        const Vec3d p = truth.face_mm[m];
        const Vec3d turned =
            std::cos(angle) * p + std::sin(angle) * cross(k, p) + ((1.0 - std::cos(angle)) * dot(k, p)) * k;
        EXPECT_LT(length(truth.headset_mm[m] - (turned + truth.slip.translation_mm)), 1e-9);
        // And the view that the renderer uses is the same motion.
        const FaceView view = world->view(35, 0);
        const Vec3d in_camera = multiply(view.rotation, p) + view.offset_mm;
        const HelmetCamera& camera = world->cameras()[0];
        EXPECT_LT(length(in_camera - multiply(camera.rotation, truth.headset_mm[m] - camera.centre_mm)),
                  1e-9);
    }
}

TEST(World, AnotherRateResamplesTheTake) {
    auto config = clean_config(straight_camera());
    config.rate_hz = 120.0;
    config.start_frame = 10;
    const auto world = make_world(flat_head(), config);
    EXPECT_EQ(world->frame_count(), 59U);  // 29 intervals of the take, twice as many frames
    EXPECT_NEAR(world->weights(0)[0], 0.10F, 1e-6F);
    EXPECT_NEAR(world->weights(1)[0], 0.105F, 1e-6F);
    EXPECT_NEAR(world->weights(58)[0], 0.39F, 1e-6F);
}

TEST(World, RefusesWhatItCannotShow) {
    const auto head = flat_head();
    const auto good = clean_config(straight_camera());
    const auto refuses = [](const rig::test::TestHead& h, const WorldConfig& c, const char* word) {
        const auto world = World::create(h.rig, h.layout, h.take, c);
        ASSERT_FALSE(world) << word;
        EXPECT_NE(world.error().message.find(word), std::string::npos) << world.error().message;
    };
    auto config = good;
    config.cameras.clear();
    refuses(head, config, "cameras");
    config = good;
    config.cameras.push_back(default_helmet(1)[0]);
    refuses(head, config, "size");
    config = good;
    config.start_frame = 40;
    refuses(head, config, "start frame");
    config = good;
    config.dot_radius_mm = std::numeric_limits<double>::quiet_NaN();
    refuses(head, config, "radius");
    auto bad = head;
    bad.layout.markers.clear();
    refuses(bad, good, "markers");
    bad = head;
    bad.layout.markers[3].vertices[1] = 99999;
    refuses(bad, good, "M3");
    bad = head;
    bad.rig.triangles[5][0] = -1;
    refuses(bad, good, "triangle");
    bad = head;
    bad.take.weights.pop_back();
    refuses(bad, good, "take");
}

std::uint64_t digest_of(const World& world, std::size_t threads) {
    std::vector<std::uint64_t> frames(world.frame_count());
    const auto draw = [&](std::size_t first) {
        WorldRenderer renderer(world);
        std::vector<std::uint8_t> image(world.image_bytes());
        for (std::size_t frame = first; frame < world.frame_count(); frame += threads) {
            rig::test::Digest digest;
            for (std::size_t camera = 0; camera < world.cameras().size(); ++camera) {
                renderer.render(frame, camera, {}, image);
                digest.add(std::span<const std::uint8_t>(image));
            }
            frames[frame] = digest.value();
        }
    };
    {
        std::vector<std::jthread> pool;
        for (std::size_t t = 0; t < threads; ++t) pool.emplace_back(draw, t);
    }
    return rig::test::Digest().add(std::span<const std::uint64_t>(frames)).value();
}

TEST(World, EqualSeedsGiveEqualBytesOnAnyNumberOfThreads) {
    WorldConfig config;
    config.cameras = {straight_camera(-0.1, 0.02), straight_camera()};
    config.cameras[1].centre_mm[0] = 40.0;
    config.frame_count = 8;
    const auto head = flat_head();
    const std::uint64_t one = digest_of(*make_world(head, config), 1);
    EXPECT_EQ(one, digest_of(*make_world(head, config), 2));
    EXPECT_EQ(one, digest_of(*make_world(head, config), 3));
    config.seed = 2;
    EXPECT_NE(one, digest_of(*make_world(head, config), 1));
}

TEST(World, ARealHeadsMarkersAreTheRecordedOnes) {
    RIG_SHARED_DATA_OR_SKIP(folder, "rig");
    RIG_SHARED_DATA_OR_SKIP(take_file, "takes/alex_rom_3_weights60.csv");
    RIG_SHARED_DATA_OR_SKIP(truth_file, "markers/alex_rom_3/60/truth.npy");
    const auto rig = load_rig(folder);
    ASSERT_TRUE(rig) << rig.error().message;
    const auto layout = load_layout(folder, "60", *rig);
    ASSERT_TRUE(layout) << layout.error().message;
    const auto take = load_take(take_file, *rig);
    ASSERT_TRUE(take) << take.error().message;
    const auto recorded = read_npy<float>(truth_file);
    ASSERT_TRUE(recorded) << recorded.error().message;
    WorldConfig config;
    config.slip = SlipKind::kNone;
    config.start_frame = 2400;  // the window's start, from its manifest
    config.frame_count = 1200;
    const auto world = World::create(*rig, *layout, *take, config);
    ASSERT_TRUE(world) << world.error().message;
    for (std::size_t frame = 0; frame < 1200; frame += 97) {
        const FrameTruth truth = (*world)->truth(frame);
        // The recording used the whole basis; the rig's files leave deltas under 0.005 mm out of every shape.
        double left_out_mm = 1e-4;
        for (const float w : truth.weights) left_out_mm += 0.005 * static_cast<double>(w);
        for (std::size_t m = 0; m < 60; ++m) {
            for (std::size_t k = 0; k < 3; ++k) {
                const auto expected = static_cast<double>(recorded->values[(frame * 60 + m) * 3 + k]);
                EXPECT_NEAR(truth.headset_mm[m][k], expected, left_out_mm);
            }
        }
    }
}

}  // namespace
}  // namespace rig::host
