// What can be said about a pack's layout and numbers without the rig, and, with a performance, how well it
// solves.
//
//   column_i = |B_i|,   P = (B^T B / s^2 + P0^-1)^-1,   confidence_i = 1 - sqrt(P_ii / P0_ii), every marker
//   seen predicted error of marker k = sqrt(tr(B_k P B_k^T)): what noise and prior leave of its position
//                                                                                     (methods.md section 3)
#pragma once

#include <array>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/pack/solve_pack.hpp"
#include "firmware_host/companion/files/file_error.hpp"
#include "firmware_host/companion/rig_folder/rig_folder.hpp"
#include "firmware_host/companion/train/coverage.hpp"

namespace rig::host {

struct ShapeFigures {
    std::string name;
    double column_mm = 0.0;
    double prior_mean = 0.0;
    double prior_sigma = 0.0;
    double posterior_sigma = 0.0;
    double confidence = 0.0;  // 0..1
    double temporal_gamma_mm2 = 0.0;
    std::optional<double> error_rms;  // of the weight over the take
};

// Parts of the face by position: the frame's origin is between the eyes, the lowest marker is the chin.
enum class FaceRegion : std::uint8_t { kForehead, kEyes, kNose, kCheeks, kMouth, kJaw };
inline constexpr std::size_t kFaceRegions = 6;
[[nodiscard]] const char* region_name(FaceRegion region);
// height_mm: of the lowest marker under the eyes, > 0.
[[nodiscard]] FaceRegion region_of(double x_mm, double y_mm, double height_mm);

struct MarkerFigures {
    std::string name;
    std::array<double, 3> neutral_mm{};
    FaceRegion region = FaceRegion::kCheeks;
    double predicted_mm = 0.0;
    std::optional<double> error_rms_mm;  // solved against true position over the take
};

struct RegionFigures {
    FaceRegion region = FaceRegion::kCheeks;
    std::size_t markers = 0;
    double predicted_mm = 0.0;  // rms over its markers
    std::optional<double> error_rms_mm;
};

struct TakeFigures {
    std::size_t frames = 0;
    double weight_rms = 0.0;
    double visible_weight_rms = 0.0;  // over shapes whose column is longer than 1 mm
    double marker_rms_mm = 0.0;
    std::optional<Coverage> coverage;  // RBF packs
};

struct PackAnalysis {
    std::vector<ShapeFigures> shapes;
    std::vector<MarkerFigures> markers;
    std::vector<RegionFigures> regions;      // with markers only, in the order of FaceRegion
    std::vector<double> singular_values_mm;  // of B, falling
    std::size_t rank = 0;
    double condition = 0.0;  // over the values that count towards the rank
    std::optional<TakeFigures> take;
};

// `take`: weights that are played on the pack's own markers with its own noise and solved again by core's
// stages, without slip. Errors: a take with other shapes.
[[nodiscard]] Result<PackAnalysis, FileError> analyse_pack(const SolvePack& pack, const Take* take);

}  // namespace rig::host
