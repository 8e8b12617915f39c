#include "firmware_host/companion/train/face_regions.hpp"

#include <gtest/gtest.h>

#include <map>
#include <set>

#include "firmware_host/companion/sample/sample.hpp"
#include "tests/support/shared_data.hpp"

namespace rig::host {
namespace {

// Every marker in at most two regions, with blends that sum to 1.
void expect_partition(const std::vector<MarkerRegion>& regions, std::size_t markers) {
    std::map<std::uint16_t, double> sum;
    for (const MarkerRegion& region : regions) {
        ASSERT_FALSE(region.markers.empty()) << region.name;
        ASSERT_EQ(region.markers.size(), region.blend.size());
        for (std::size_t a = 0; a < region.markers.size(); ++a) {
            if (a > 0) {
                EXPECT_GT(region.markers[a], region.markers[a - 1]);
            }
            EXPECT_GT(region.blend[a], 0.0);
            sum[region.markers[a]] += region.blend[a];
        }
    }
    EXPECT_EQ(sum.size(), markers);
    for (const auto& [marker, total] : sum) EXPECT_NEAR(total, 1.0, 1e-12) << marker;
}

TEST(FaceRegions, FeaturesAreEyesAndMouthWithABandBetween) {
    const Rig rig = sample_rig();
    const MarkerLayout layout = sample_layout(rig);
    const std::vector<MarkerRegion> regions = feature_regions(layout);
    ASSERT_EQ(regions.size(), 2U);
    EXPECT_EQ(regions[0].name, "eyes");
    EXPECT_EQ(regions[1].name, "mouth");
    expect_partition(regions, layout.markers.size());
    double lowest = 0.0;
    for (const LayoutMarker& marker : layout.markers)
        lowest = std::min(lowest, static_cast<double>(marker.neutral_mm[1]));
    for (std::size_t a = 0; a < regions[0].markers.size(); ++a) {
        const double y = static_cast<double>(layout.markers[regions[0].markers[a]].neutral_mm[1]);
        if (y > 0.2 * lowest) {
            EXPECT_EQ(regions[0].blend[a], 1.0);
        }
        EXPECT_GT(y, 0.46 * lowest);
    }
}

TEST(FaceRegions, MarkersNamedPupilAreARegionOfTheirOwn) {
    MarkerLayout layout = sample_layout(sample_rig());
    layout.markers[3].name = "L_Pupil";
    layout.markers[9].name = "right iris";
    const std::vector<MarkerRegion> regions = feature_regions(layout);
    ASSERT_EQ(regions.size(), 3U);
    EXPECT_EQ(regions[2].name, "pupils");
    EXPECT_EQ(regions[2].markers, (std::vector<std::uint16_t>{3, 9}));
    expect_partition(regions, layout.markers.size());
}

TEST(FaceRegions, TheSurfaceHasUpTo14SymmetricRegions) {
    RIG_SHARED_DATA_OR_SKIP(folder, "rig");
    const auto rig = load_rig(folder);
    ASSERT_TRUE(rig.has_value());
    for (const char* name : {"50", "60", "102"}) {
        const auto layout = load_layout(folder, name, *rig);
        ASSERT_TRUE(layout.has_value());
        const std::vector<MarkerRegion> regions = surface_regions(*layout);
        EXPECT_LE(regions.size(), 14U);
        EXPECT_GE(regions.size(), 8U) << name;
        expect_partition(regions, layout->markers.size());
        std::map<std::string, std::size_t> size;
        for (const MarkerRegion& region : regions) size[region.name] = region.markers.size();
        EXPECT_EQ(size["left_cheek"], size["right_cheek"]);
        EXPECT_EQ(size["left_corner"], size["right_corner"]);
        if (std::string(name) == "102") {
            EXPECT_EQ(regions.size(), 14U);
        }
    }
}

// A small step of a marker changes its blends little, also where three borders meet.
TEST(FaceRegions, BlendsAreContinuous) {
    RIG_SHARED_DATA_OR_SKIP(folder, "rig");
    const auto rig = load_rig(folder);
    ASSERT_TRUE(rig.has_value());
    auto layout = load_layout(folder, "102", *rig);
    ASSERT_TRUE(layout.has_value());
    const auto blends = [&] {
        std::map<std::string, double> out;
        for (const MarkerRegion& region : surface_regions(*layout)) {
            for (std::size_t a = 0; a < region.markers.size(); ++a) {
                if (region.markers[a] == 2) out[region.name] = region.blend[a];
            }
        }
        return out;
    };
    std::map<std::string, double> before;
    for (int step = 0; step < 200; ++step) {  // from the left cheek across the mouth to the right jaw
        layout->markers[2].neutral_mm[0] = 50.0F - 0.5F * static_cast<float>(step);
        layout->markers[2].neutral_mm[1] = -20.0F - 0.3F * static_cast<float>(step);
        std::map<std::string, double> now = blends();
        for (auto& [name, blend] : now) {
            if (step > 0) {
                EXPECT_NEAR(blend, before[name], 0.06) << name << " " << step;
            }
        }
        before = std::move(now);
    }
}

TEST(FaceRegions, LipsAreAroundTheMouth) {
    RIG_SHARED_DATA_OR_SKIP(folder, "rig");
    const auto rig = load_rig(folder);
    ASSERT_TRUE(rig.has_value());
    const auto layout = load_layout(folder, "102", *rig);
    ASSERT_TRUE(layout.has_value());
    const MarkerRegion lips = lip_region(*layout);
    EXPECT_GE(lips.markers.size(), 12U);
    EXPECT_LE(lips.markers.size(), 30U);
    std::set<std::string> names;
    for (const std::uint16_t k : lips.markers) names.insert(layout->markers[k].name);
    for (const char* name : {"UL_M", "LL_M", "UL1_L", "UL2_R", "MC_L", "MC_R", "LL1_R"})
        EXPECT_TRUE(names.contains(name)) << name;
    for (const char* name : {"NT_M", "CH3_M", "JW2_L", "CK4_R", "FH_M"})
        EXPECT_FALSE(names.contains(name)) << name;
}

TEST(FaceRegions, AFewMarkersMakeFewRegions) {
    MarkerLayout layout = sample_layout(sample_rig());
    layout.markers.resize(4);
    const std::vector<MarkerRegion> regions = surface_regions(layout);
    EXPECT_GE(regions.size(), 1U);
    EXPECT_LE(regions.size(), 2U);
    expect_partition(regions, 4);
    EXPECT_EQ(whole_face(layout)[0].markers.size(), 4U);
}

TEST(FaceRegions, SharesFollowTheMotion) {
    // Two regions of one marker each; shape 0 moves the first, shape 1 both alike, shape 2 none, shape 3 the
    // second a hundred times as much as the first.
    std::vector<MarkerRegion> regions(2);
    regions[0] = {"a", {0}, {1.0}};
    regions[1] = {"b", {1}, {1.0}};
    std::vector<float> basis(6 * 4, 0.0F);
    basis[0 * 4 + 0] = 2.0F;
    basis[0 * 4 + 1] = 1.0F;
    basis[4 * 4 + 1] = 1.0F;
    basis[1 * 4 + 3] = 0.1F;
    basis[3 * 4 + 3] = 10.0F;
    const std::vector<double> shares = shape_shares(regions, basis, 4);
    EXPECT_EQ(shares, (std::vector<double>{1.0, 0.5, 0.0, 0.0, 0.0, 0.5, 0.0, 1.0}));
}

}  // namespace
}  // namespace rig::host
