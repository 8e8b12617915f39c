// Inference against the Gaussian's conditional written out in long double, and its promises about confidence.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <numeric>
#include <vector>

#include "core/infer/inference.hpp"
#include "tests/support/random.hpp"

namespace rig {
namespace {

using Matrix = std::vector<std::vector<long double>>;

constexpr double kNoiseMm = 0.1;

Matrix inverse_of(Matrix a) {
    const std::size_t n = a.size();
    Matrix out(n, std::vector<long double>(n, 0.0L));
    for (std::size_t i = 0; i < n; ++i) out[i][i] = 1.0L;
    for (std::size_t i = 0; i < n; ++i) {
        const long double pivot = a[i][i];  // positive definite: no exchange of rows
        for (std::size_t j = 0; j < n; ++j) {
            a[i][j] /= pivot;
            out[i][j] /= pivot;
        }
        for (std::size_t k = 0; k < n; ++k) {
            const long double factor = a[k][i];
            if (k == i || factor == 0.0L) continue;
            for (std::size_t j = 0; j < n; ++j) {
                a[k][j] -= factor * a[i][j];
                out[k][j] -= factor * out[i][j];
            }
        }
    }
    return out;
}

// A face of random motions: every marker moves with all modes, the first ones most.
struct RandomFace {
    RandomFace(std::size_t markers, std::size_t modes, test::SeededRandom& random) {
        model->marker_count = static_cast<std::uint16_t>(markers);
        model->mode_count = static_cast<std::uint16_t>(modes);
        model->residual_mm = random.uniform(0.02, 0.3);
        for (std::size_t k = 0; k < markers; ++k) {
            model->mean_mm[k] = Vec3{random.normal(0.0, 40.0), random.normal(0.0, 40.0), 0.0};
            for (std::size_t j = 0; j < modes; ++j) {
                const double size = 3.0 / static_cast<double>(j + 1);
                model->modes[k * modes + j] =
                    Vec3{random.normal(0.0, size), random.normal(0.0, size), random.normal(0.0, size)};
            }
        }
        SolvePack pack;
        pack.marker_count = model->marker_count;
        pack.noise_mm = static_cast<float>(kNoiseMm);
        const auto scratch = std::make_unique<FaceGaussianWorkspace>();
        build_face_gaussian(pack, *model, *scratch, *face);
        input->count = model->marker_count;
        for (std::size_t k = 0; k < markers; ++k) {
            input->markers[k].position_mm =
                model->mean_mm[k] +
                Vec3{random.normal(0.0, 2.0), random.normal(0.0, 2.0), random.normal(0.0, 2.0)};
            measure(k);
        }
    }

    void measure(std::size_t k) {
        input->markers[k].seen = true;
        input->markers[k].information = Mat3::Identity() / face->noise_mm2;
    }
    // As one camera sees it, less sure than the pack expects.
    void see_from_one_side(std::size_t k, test::SeededRandom& random) {
        Vec3 ray{random.normal(0.0, 1.0), random.normal(0.0, 1.0), random.normal(0.0, 1.0)};
        ray /= std::sqrt(ray.dot(ray));
        const Mat3 across = Mat3::Identity() - ray * ray.transpose();
        input->markers[k].seen = true;
        input->markers[k].information = random.uniform(0.05, 0.5) / face->noise_mm2 * across;
    }
    void hide(std::size_t k) {
        input->markers[k].seen = false;
        input->markers[k].information = Mat3::Zero();
    }
    const InferenceOutput& infer() {
        infer_missing(*face, *input, *workspace, *output);
        return *output;
    }

    std::unique_ptr<ShapeModel> model = std::make_unique<ShapeModel>();
    std::unique_ptr<FaceGaussian> face = std::make_unique<FaceGaussian>();
    std::unique_ptr<StabiliserOutput> input = std::make_unique<StabiliserOutput>();
    std::unique_ptr<InferenceWorkspace> workspace = std::make_unique<InferenceWorkspace>();
    std::unique_ptr<InferenceOutput> output = std::make_unique<InferenceOutput>();
};

struct Reference {
    std::vector<long double> offset;  // of every coordinate from its mean
    Matrix covariance;
};

// Posterior of all coordinates in the information form: (S^-1 + A)^-1 (A (y - mean)), S = M M^T + r I.
Reference reference_of(const RandomFace& f) {
    const std::size_t m = f.face->marker_count;
    const std::size_t rows = 3 * m;
    Matrix prior(rows, std::vector<long double>(rows, 0.0L));
    for (std::size_t r = 0; r < rows; ++r) {
        for (std::size_t s = 0; s < rows; ++s) {
            for (std::size_t j = 0; j < f.model->mode_count; ++j) {
                prior[r][s] +=
                    static_cast<long double>(
                        f.model->modes[r / 3 * f.model->mode_count + j][static_cast<Eigen::Index>(r % 3)]) *
                    static_cast<long double>(
                        f.model->modes[s / 3 * f.model->mode_count + j][static_cast<Eigen::Index>(s % 3)]);
            }
        }
        prior[r][r] +=
            static_cast<long double>(f.model->residual_mm) * static_cast<long double>(f.model->residual_mm);
    }
    Matrix information = inverse_of(prior);
    std::vector<long double> right(rows, 0.0L);
    for (std::size_t k = 0; k < m; ++k) {
        const StabilisedMarker& marker = f.input->markers[k];
        const Vec3 error = marker.position_mm - f.model->mean_mm[k];
        for (Eigen::Index a = 0; a < 3; ++a) {
            for (Eigen::Index b = 0; b < 3; ++b) {
                const auto row = 3 * k + static_cast<std::size_t>(a);
                const auto value = static_cast<long double>(marker.information(a, b));
                information[row][3 * k + static_cast<std::size_t>(b)] += value;
                right[row] += value * static_cast<long double>(error[b]);
            }
        }
    }
    Reference out;
    out.covariance = inverse_of(information);
    out.offset.assign(rows, 0.0L);
    for (std::size_t r = 0; r < rows; ++r) {
        for (std::size_t s = 0; s < rows; ++s) out.offset[r] += out.covariance[r][s] * right[s];
    }
    return out;
}

void expect_reference(RandomFace& f, const char* what) {
    const InferenceOutput& output = f.infer();
    const Reference reference = reference_of(f);
    for (std::size_t k = 0; k < f.face->marker_count; ++k) {
        const StabilisedMarker& marker = f.input->markers[k];
        if (marker.seen && marker.information.determinant() > 0.5 / std::pow(f.face->noise_mm2, 3)) continue;
        long double variance = 0.0L;
        for (std::size_t axis = 0; axis < 3; ++axis)
            variance += reference.covariance[3 * k + axis][3 * k + axis];
        EXPECT_NEAR(static_cast<double>(output.deviation_mm[k]), std::sqrt(static_cast<double>(variance)),
                    1e-5 * std::sqrt(f.face->prior_mm2[k]))
            << what << " " << k;
        if (marker.seen) continue;
        for (std::size_t axis = 0; axis < 3; ++axis) {
            const auto at = static_cast<Eigen::Index>(axis);
            EXPECT_NEAR(output.position_mm[k][at] - f.model->mean_mm[k][at],
                        static_cast<double>(reference.offset[3 * k + axis]), 1e-7)
                << what << " " << k;
        }
    }
}

TEST(InferenceProperties, IsTheConditionalOfTheGaussian) {
    test::SeededRandom random(201);
    for (int round = 0; round < 40; ++round) {
        const std::size_t markers = 5 + random.below(16);
        RandomFace f(markers, 1 + random.below(20), random);
        const double share = random.uniform(0.05, 0.95);
        for (std::size_t k = 0; k < markers; ++k) {
            if (random.chance(share)) f.hide(k);
        }
        expect_reference(f, "hidden");
        expect_reference(f, "hidden, worked out before");
        for (std::size_t k = 0; k < markers; ++k) {
            if (random.chance(0.3)) f.see_from_one_side(k, random);
        }
        expect_reference(f, "one camera");
    }
}

// The ways through the precision matrix and through the modes meet where one takes over from the other.
TEST(InferenceProperties, LargeFacesWithAnyNumberOfMarkersHidden) {
    test::SeededRandom random(202);
    RandomFace f(40, 12, random);
    for (std::size_t hidden = 0; hidden <= 40; hidden += 8) {
        for (std::size_t k = 0; k < 40; ++k) {
            if (k < hidden) f.hide(k);
        }
        expect_reference(f, "so many");
    }
}

TEST(InferenceProperties, HidingMoreNeverRaisesAConfidence) {
    test::SeededRandom random(203);
    for (int round = 0; round < 60; ++round) {
        const std::size_t markers = 6 + random.below(60);
        RandomFace f(markers, 1 + random.below(kMaxModes), random);
        std::vector<std::size_t> order(markers);
        std::iota(order.begin(), order.end(), std::size_t{0});
        random.shuffle(std::span(order));
        std::vector<float> before(markers, 1.0F);
        const auto expect_no_rise = [&](const char* what, std::size_t step) {
            const InferenceOutput& output = f.infer();
            for (std::size_t k = 0; k < markers; ++k) {
                ASSERT_LE(output.confidence[k], before[k] + 1e-6F) << what << " " << round << " " << step;
                ASSERT_GE(output.confidence[k], 0.0F);
                before[k] = output.confidence[k];
            }
        };
        // Some go from measured to one camera first.
        for (std::size_t i = 0; i < markers; i += 3) {
            f.see_from_one_side(order[i], random);
            expect_no_rise("one camera", i);
        }
        for (std::size_t i = 0; i < markers; ++i) {
            f.hide(order[i]);
            expect_no_rise("hidden", i);
        }
        for (const float x : before) EXPECT_NEAR(x, 0.0F, 1e-6F) << "nothing is known of any";
    }
}

}  // namespace
}  // namespace rig
