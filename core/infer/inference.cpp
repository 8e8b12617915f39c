#include "core/infer/inference.hpp"

#include "core/geometry/triangulation.hpp"

namespace rig {

namespace {

constexpr double kSmallestDepthShare =
    1e-6;                            // of a marker's mean information: below it the depth was not measured
constexpr double kWeakPrior = 0.01;  // of a marker's mean information

}  // namespace

void infer_missing(const ShapeModel& model, const StabiliserOutput& stabilised, InferenceOutput& output) {
    output.count = stabilised.count;
    output.inferred = 0;
    for (std::size_t k = 0; k < stabilised.count; ++k) {
        const StabilisedMarker& marker = stabilised.markers[k];
        const Vec3 inferred = model.face_position(k, stabilised.fit.coefficients);
        if (!marker.seen) {
            output.position_mm[k] = inferred;
            ++output.inferred;
            continue;
        }
        const double mean = marker.information.trace() / 3.0;
        const bool full_rank = marker.information.determinant() > kSmallestDepthShare * mean * mean * mean;
        // A weak prior decides only what was not measured.
        const Mat3 system = marker.information + kWeakPrior * mean * Mat3::Identity();
        const Vec3 offset = marker.information * (marker.position_mm - inferred);
        output.position_mm[k] =
            full_rank ? marker.position_mm : Vec3{inferred + inverse_3x3(system) * offset};
    }
}

}  // namespace rig
