#include "firmware_host/companion/train/face_regions.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <string_view>

namespace rig::host {

namespace {

// Heights in shares of the way from the eyes down to the lowest marker. On two heads of light-stage scans the
// nose ends at 0.35 and the upper lip begins at 0.45.
constexpr double kBandTop = 0.25;
constexpr double kBandBottom = 0.45;

constexpr std::size_t kLeastOwned = 3;  // markers: nine rows, Zhang's smallest have 27 with what they share
constexpr double kBorderShare = 0.2;    // of the face's height below the eyes: how far a border reaches
constexpr double kLeastShare = 0.02;

struct Anchor {
    const char* name;
    double across;  // share of the widest marker's distance from the middle, left positive
    double up;      // share of the lowest marker's distance below the eyes
};

constexpr std::array<Anchor, 14> kAnchors{{{"forehead", 0.0, 0.45},
                                           {"glabella", 0.0, 0.18},
                                           {"left_eye", 0.55, 0.12},
                                           {"right_eye", -0.55, 0.12},
                                           {"nose", 0.0, -0.25},
                                           {"left_cheek", 0.72, -0.2},
                                           {"right_cheek", -0.72, -0.2},
                                           {"left_corner", 0.45, -0.48},
                                           {"right_corner", -0.45, -0.48},
                                           {"upper_lip", 0.0, -0.42},
                                           {"lower_lip", 0.0, -0.66},
                                           {"chin", 0.0, -0.95},
                                           {"left_jaw", 0.65, -0.75},
                                           {"right_jaw", -0.65, -0.75}}};

bool is_pupil(const LayoutMarker& marker) {
    std::string name = marker.name;
    for (char& c : name) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    return name.find("pupil") != std::string::npos || name.find("iris") != std::string::npos;
}

void add(MarkerRegion& region, std::size_t marker, double blend) {
    if (!(blend > 0.0)) return;
    region.markers.push_back(static_cast<std::uint16_t>(marker));
    region.blend.push_back(blend);
}

void drop_empty(std::vector<MarkerRegion>& regions) {
    std::erase_if(regions, [](const MarkerRegion& region) { return region.markers.empty(); });
}

std::vector<double> distances_mm(const LayoutMarker& marker, const std::vector<Anchor>& anchors,
                                 const LayoutExtent& extent) {
    std::vector<double> out;
    for (const Anchor& anchor : anchors) {
        const double x = static_cast<double>(marker.neutral_mm[0]) - anchor.across * extent.half_width_mm;
        const double y = static_cast<double>(marker.neutral_mm[1]) - anchor.up * extent.depth_mm;
        out.push_back(std::sqrt(x * x + y * y));
    }
    return out;
}

// Takes out the anchor that owns the fewest markers, while one owns too few.
std::vector<Anchor> anchors_with_markers(const MarkerLayout& layout, const LayoutExtent& extent) {
    std::vector<Anchor> anchors(kAnchors.begin(), kAnchors.end());
    while (anchors.size() > 1) {
        std::vector<std::size_t> owned(anchors.size(), 0);
        for (const LayoutMarker& marker : layout.markers) {
            const std::vector<double> gap_mm = distances_mm(marker, anchors, extent);
            ++owned[static_cast<std::size_t>(std::ranges::min_element(gap_mm) - gap_mm.begin())];
        }
        const auto fewest = std::ranges::min_element(owned);
        if (*fewest >= kLeastOwned) break;
        anchors.erase(anchors.begin() + (fewest - owned.begin()));
    }
    return anchors;
}

}  // namespace

LayoutExtent extent_of(const MarkerLayout& layout) {
    LayoutExtent extent;
    for (const LayoutMarker& marker : layout.markers) {
        extent.half_width_mm =
            std::max(extent.half_width_mm, std::fabs(static_cast<double>(marker.neutral_mm[0])));
        extent.depth_mm = std::max(extent.depth_mm, -static_cast<double>(marker.neutral_mm[1]));
    }
    return extent;
}

std::vector<MarkerRegion> feature_regions(const MarkerLayout& layout) {
    const LayoutExtent extent = extent_of(layout);
    std::vector<MarkerRegion> regions(3);
    regions[0].name = "eyes";
    regions[1].name = "mouth";
    regions[2].name = "pupils";
    for (std::size_t k = 0; k < layout.markers.size(); ++k) {
        const LayoutMarker& marker = layout.markers[k];
        if (is_pupil(marker)) {
            add(regions[2], k, 1.0);
            continue;
        }
        const double down = -static_cast<double>(marker.neutral_mm[1]) / extent.depth_mm;
        const double mouth = std::clamp((down - kBandTop) / (kBandBottom - kBandTop), 0.0, 1.0);
        add(regions[0], k, 1.0 - mouth);
        add(regions[1], k, mouth);
    }
    drop_empty(regions);
    return regions;
}

std::vector<MarkerRegion> surface_regions(const MarkerLayout& layout) {
    const LayoutExtent extent = extent_of(layout);
    const std::vector<Anchor> anchors = anchors_with_markers(layout, extent);
    std::vector<MarkerRegion> regions(anchors.size());
    for (std::size_t a = 0; a < anchors.size(); ++a) regions[a].name = anchors[a].name;
    const double border_mm = kBorderShare * extent.depth_mm;
    for (std::size_t k = 0; k < layout.markers.size(); ++k) {
        std::vector<double> blend = distances_mm(layout.markers[k], anchors, extent);
        const double nearest_mm = *std::ranges::min_element(blend);
        double sum = 0.0;
        for (double& b : blend) {
            b = std::max(0.0, 1.0 - (b - nearest_mm) / border_mm);
            sum += b;
        }
        for (std::size_t a = 0; a < anchors.size(); ++a) add(regions[a], k, blend[a] / sum);
    }
    drop_empty(regions);
    return regions;
}

MarkerRegion lip_region(const MarkerLayout& layout) {
    std::vector<double> share(layout.markers.size(), 0.0);
    for (const MarkerRegion& region : surface_regions(layout)) {
        if (!region.name.ends_with("lip") && !region.name.ends_with("corner")) continue;
        for (std::size_t a = 0; a < region.markers.size(); ++a) share[region.markers[a]] += region.blend[a];
    }
    MarkerRegion lips{"lips", {}, {}};
    for (std::size_t k = 0; k < share.size(); ++k) {
        if (share[k] > 0.5) add(lips, k, 1.0);
    }
    return lips;
}

std::vector<MarkerRegion> whole_face(const MarkerLayout& layout) {
    std::vector<MarkerRegion> regions(1);
    regions[0].name = "face";
    for (std::size_t k = 0; k < layout.markers.size(); ++k) add(regions[0], k, 1.0);
    return regions;
}

std::vector<double> shape_shares(std::span<const MarkerRegion> regions, std::span<const float> basis_mm,
                                 std::size_t shape_count) {
    std::vector<double> shares(regions.size() * shape_count, 0.0);
    const auto normalise = [&](std::size_t i, double least) {
        double sum = 0.0;
        for (std::size_t r = 0; r < regions.size(); ++r) {
            double& share = shares[r * shape_count + i];
            if (share < least) share = 0.0;
            sum += share;
        }
        for (std::size_t r = 0; r < regions.size() && sum > 0.0; ++r) shares[r * shape_count + i] /= sum;
    };
    for (std::size_t i = 0; i < shape_count; ++i) {
        for (std::size_t r = 0; r < regions.size(); ++r) {
            for (std::size_t a = 0; a < regions[r].markers.size(); ++a) {
                for (std::size_t axis = 0; axis < 3; ++axis) {
                    const auto b =
                        static_cast<double>(basis_mm[(3U * regions[r].markers[a] + axis) * shape_count + i]);
                    shares[r * shape_count + i] += regions[r].blend[a] * b * b;
                }
            }
        }
        normalise(i, 0.0);
        normalise(i, kLeastShare);
    }
    return shares;
}

}  // namespace rig::host
