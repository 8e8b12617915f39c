#include "core/pack/open_pack.hpp"

#include <gtest/gtest.h>

#include <cstring>
#include <limits>
#include <string>
#include <vector>

#include "firmware_host/companion/train/pack_writer.hpp"
#include "firmware_host/pack_file/sha256.hpp"
#include "tests/support/pack_samples/aligned_bytes.hpp"
#include "tests/support/pack_samples/sample_pack.hpp"

namespace rig {
namespace {

using host::PackIdentity;
using host::write_pack;
using test::AlignedBytes;
using test::SamplePack;

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr float kInf = std::numeric_limits<float>::infinity();

void expect_equal(std::span<const float> got, std::span<const float> wanted) {
    ASSERT_EQ(got.size(), wanted.size());
    if (wanted.empty()) return;
    EXPECT_EQ(std::memcmp(got.data(), wanted.data(), got.size_bytes()), 0);
}

void expect_refused(const SolvePack& pack, PackError error, const PackIdentity& identity = {}) {
    const AlignedBytes bytes(write_pack(pack, identity, sha256));
    const auto opened = open_pack(bytes.span(), sha256);
    ASSERT_FALSE(opened.has_value()) << "accepted instead of: " << pack_error_text(error);
    EXPECT_EQ(opened.error(), error) << pack_error_text(opened.error()) << " instead of "
                                     << pack_error_text(error);
}

TEST(OpenPack, GivesBackWhatWasWritten) {
    for (const SolverKind solver : {SolverKind::kLeastSquares, SolverKind::kNonNegative, SolverKind::kBoxQp,
                                    SolverKind::kRbf, SolverKind::kKeyShapes, SolverKind::kExamples}) {
        const SamplePack sample({.markers = 7, .shapes = 5, .solver = solver, .cameras = 2});
        const AlignedBytes bytes(write_pack(sample.view, {}, sha256));
        const auto opened = open_pack(bytes.span(), sha256);
        ASSERT_TRUE(opened.has_value()) << pack_error_text(opened.error());
        EXPECT_EQ(opened->marker_count, 7);
        EXPECT_EQ(opened->shape_count, 5);
        EXPECT_EQ(opened->solver, solver);
        EXPECT_EQ(opened->rate_hz, sample.view.rate_hz);
        EXPECT_EQ(opened->noise_mm, sample.view.noise_mm);
        EXPECT_EQ(opened->sparsity_mm2, sample.view.sparsity_mm2);
        EXPECT_EQ(opened->ridge_mm2, sample.view.ridge_mm2);
        expect_equal(opened->neutral_mm, sample.neutral);
        expect_equal(opened->basis_mm, sample.basis);
        expect_equal(opened->weight_low, sample.low);
        expect_equal(opened->weight_high, sample.high);
        expect_equal(opened->prior_mean, sample.mean);
        expect_equal(opened->prior_sigma, sample.sigma);
        expect_equal(opened->temporal_gamma, sample.gamma);
        expect_equal(opened->rbf.mean_mm, sample.rbf_mean);
        expect_equal(opened->rbf.basis, sample.rbf_basis);
        expect_equal(opened->rbf.centres, sample.rbf_centres);
        expect_equal(opened->rbf.widths_mm, sample.rbf_widths);
        expect_equal(opened->rbf.weights, sample.rbf_weights);
        expect_equal(opened->rbf.offset, sample.rbf_offset);
        for (std::size_t i = 0; i < 5; ++i) EXPECT_EQ(opened->shape_names[i], sample.names[i]);
        for (std::size_t i = 0; i < 7; ++i) EXPECT_EQ(opened->marker_names[i], sample.names[5 + i]);
        ASSERT_EQ(opened->camera_count, 2);
        EXPECT_EQ(opened->cameras[1].width_px, 640);
        EXPECT_EQ(opened->cameras[1].k1, -0.1);
        EXPECT_EQ(opened->cameras[1].centre_mm, sample.view.cameras[1].centre_mm);
        EXPECT_EQ(opened->cameras[1].camera_from_headset, sample.view.cameras[1].camera_from_headset);
    }
}

TEST(OpenPack, GivesBackKernelAndFallback) {
    for (const RbfKernel kernel : {RbfKernel::kGaussian, RbfKernel::kThinPlate, RbfKernel::kMultiquadric}) {
        SamplePack sample({.solver = SolverKind::kRbf});
        sample.view.rbf.kernel = kernel;
        sample.view.rbf.hull_near_widths = 1.5F;
        sample.view.rbf.hull_far_widths = 3.0F;
        const AlignedBytes bytes(write_pack(sample.view, {}, sha256));
        const auto opened = open_pack(bytes.span(), sha256);
        ASSERT_TRUE(opened.has_value()) << pack_error_text(opened.error());
        EXPECT_EQ(opened->rbf.kernel, kernel);
        EXPECT_EQ(opened->rbf.hull_near_widths, 1.5F);
        EXPECT_EQ(opened->rbf.hull_far_widths, 3.0F);
    }
}

TEST(OpenPack, TakesTheLargestCounts) {
    const SamplePack sample({.markers = kMaxMarkers,
                             .shapes = kMaxShapes,
                             .solver = SolverKind::kRbf,
                             .rbf_dimensions = kMaxRbfDimensions,
                             .rbf_centres = kMaxRbfCentres,
                             .cameras = kMaxCameras});
    const AlignedBytes bytes(write_pack(sample.view, {}, sha256));
    EXPECT_TRUE(open_pack(bytes.span(), sha256).has_value());
}

TEST(OpenPack, TensorsStartAtCacheLines) {
    const SamplePack sample({.markers = 5, .shapes = 3});
    const AlignedBytes bytes(write_pack(sample.view, {}, sha256));
    const auto opened = open_pack(bytes.span(), sha256);
    ASSERT_TRUE(opened.has_value());
    EXPECT_EQ(reinterpret_cast<std::uintptr_t>(opened->basis_mm.data()) % kPackAlignment, 0U);
    EXPECT_EQ(reinterpret_cast<std::uintptr_t>(opened->temporal_gamma.data()) % kPackAlignment, 0U);
}

TEST(OpenPack, RefusesEveryTruncation) {
    const SamplePack sample({.solver = SolverKind::kRbf});
    const std::vector<std::byte> whole = write_pack(sample.view, {}, sha256);
    for (std::size_t length = 0; length < whole.size(); ++length) {
        const AlignedBytes bytes(ByteSpan(whole).first(length));
        const auto opened = open_pack(bytes.span(), sha256);
        ASSERT_FALSE(opened.has_value()) << length;
        ASSERT_EQ(opened.error(), length < kPackHeaderBytes ? PackError::kTooShort : PackError::kTotalLength)
            << length;
    }
}

TEST(OpenPack, RefusesEverySingleBitFlip) {
    const SamplePack sample({.solver = SolverKind::kRbf});
    AlignedBytes bytes(write_pack(sample.view, {}, sha256));
    ASSERT_TRUE(open_pack(bytes.span(), sha256).has_value());
    for (std::size_t i = 0; i < bytes.span().size(); ++i) {
        for (int bit = 0; bit < 8; ++bit) {
            bytes[i] ^= std::byte{1} << bit;
            ASSERT_FALSE(open_pack(bytes.span(), sha256).has_value()) << "byte " << i << " bit " << bit;
            bytes[i] ^= std::byte{1} << bit;
        }
    }
    EXPECT_TRUE(open_pack(bytes.span(), sha256).has_value());
}

TEST(OpenPack, RefusesBytesOffTheBoundary) {
    const SamplePack sample({});
    std::vector<std::byte> whole = write_pack(sample.view, {}, sha256);
    whole.insert(whole.begin(), 4, std::byte{0});
    const AlignedBytes bytes(whole);
    const auto opened = open_pack(bytes.span().subspan(4), sha256);
    ASSERT_FALSE(opened.has_value());
    EXPECT_EQ(opened.error(), PackError::kMisaligned);
}

struct BadNumber {
    const char* what;
    std::vector<float> SamplePack::* tensor;
    float value;
    PackError error;
};

TEST(OpenPack, RefusesEachBadNumberByItsOwnRule) {
    const BadNumber cases[] = {
        {"neutral nan", &SamplePack::neutral, kNan, PackError::kNotFinite},
        {"neutral far", &SamplePack::neutral, 1.1e4F, PackError::kMagnitude},
        {"basis inf", &SamplePack::basis, kInf, PackError::kNotFinite},
        {"basis far", &SamplePack::basis, -1.1e4F, PackError::kMagnitude},
        {"low nan", &SamplePack::low, kNan, PackError::kNotFinite},
        {"low above high", &SamplePack::low, 1.5F, PackError::kWeightRange},
        {"high below low", &SamplePack::high, -0.5F, PackError::kWeightRange},
        {"high huge", &SamplePack::high, 1e6F, PackError::kMagnitude},
        {"mean inf", &SamplePack::mean, -kInf, PackError::kNotFinite},
        {"sigma zero", &SamplePack::sigma, 0.0F, PackError::kPriorSigma},
        {"sigma negative", &SamplePack::sigma, -0.3F, PackError::kPriorSigma},
        {"sigma subnormal", &SamplePack::sigma, 1e-40F, PackError::kPriorSigma},
        {"gamma negative", &SamplePack::gamma, -1.0F, PackError::kTemporalGamma},
        {"gamma nan", &SamplePack::gamma, kNan, PackError::kNotFinite},
        {"rbf mean nan", &SamplePack::rbf_mean, kNan, PackError::kNotFinite},
        {"rbf basis off", &SamplePack::rbf_basis, 0.9F, PackError::kRbfBasis},
        {"rbf basis huge", &SamplePack::rbf_basis, -2.0F, PackError::kRbfBasis},
        {"rbf centre inf", &SamplePack::rbf_centres, kInf, PackError::kNotFinite},
        {"rbf width zero", &SamplePack::rbf_widths, 0.0F, PackError::kRbfWidths},
        {"rbf width negative", &SamplePack::rbf_widths, -3.0F, PackError::kRbfWidths},
        {"rbf weight huge", &SamplePack::rbf_weights, 1e7F, PackError::kMagnitude},
        {"rbf offset nan", &SamplePack::rbf_offset, kNan, PackError::kNotFinite},
    };
    for (const BadNumber& bad : cases) {
        SCOPED_TRACE(bad.what);
        for (const bool first : {true, false}) {
            SamplePack sample({.solver = SolverKind::kRbf});
            auto& tensor = sample.*bad.tensor;
            if (first) {
                tensor.front() = bad.value;
            } else {
                tensor.back() = bad.value;
            }
            expect_refused(sample.view, bad.error);
        }
    }
}

TEST(OpenPack, RefusesTensorsThatDoNotFitTheCounts) {
    SamplePack sample({.solver = SolverKind::kRbf});
    for (std::span<const float>* tensor :
         {&sample.view.neutral_mm, &sample.view.basis_mm, &sample.view.weight_low, &sample.view.weight_high,
          &sample.view.prior_mean, &sample.view.prior_sigma, &sample.view.temporal_gamma,
          &sample.view.rbf.mean_mm, &sample.view.rbf.basis, &sample.view.rbf.centres,
          &sample.view.rbf.widths_mm, &sample.view.rbf.weights, &sample.view.rbf.offset}) {
        const std::span<const float> whole = *tensor;
        *tensor = whole.first(whole.size() - 1);
        expect_refused(sample.view, PackError::kSectionLength);
        *tensor = {};
        expect_refused(sample.view, PackError::kSectionLength);
        *tensor = whole;
    }
}

TEST(OpenPack, RefusesBadScalars) {
    const auto with = [](auto change, PackError error) {
        SamplePack sample({});
        change(sample.view);
        expect_refused(sample.view, error);
    };
    for (const float rate : {0.0F, -60.0F, 1001.0F, kNan, kInf}) {
        with([&](SolvePack& p) { p.rate_hz = rate; }, PackError::kRate);
    }
    for (const float noise : {0.0F, -0.1F, 101.0F, 1e-30F, kNan, kInf}) {
        with([&](SolvePack& p) { p.noise_mm = noise; }, PackError::kNoise);
    }
    for (const float value : {-1e-6F, 1e10F, kNan, kInf}) {
        with([&](SolvePack& p) { p.sparsity_mm2 = value; }, PackError::kRegularisation);
        with([&](SolvePack& p) { p.ridge_mm2 = value; }, PackError::kRegularisation);
    }
}

TEST(OpenPack, RefusesImplausibleCameras) {
    const auto with = [](auto change, PackError error) {
        SamplePack sample({});
        change(sample.view.cameras[0]);
        expect_refused(sample.view, error);
    };
    const double nan = std::numeric_limits<double>::quiet_NaN();
    const double inf = std::numeric_limits<double>::infinity();
    for (const double f : {0.0, -500.0, nan, inf}) {
        with([&](CameraModel& c) { c.fx_px = f; }, PackError::kCameraIntrinsics);
        with([&](CameraModel& c) { c.fy_px = f; }, PackError::kCameraIntrinsics);
    }
    for (const int size : {0, -1, 1 << 30}) {
        with([&](CameraModel& c) { c.width_px = size; }, PackError::kCameraIntrinsics);
        with([&](CameraModel& c) { c.height_px = size; }, PackError::kCameraIntrinsics);
    }
    with([&](CameraModel& c) { c.cx_px = nan; }, PackError::kCameraIntrinsics);
    with([&](CameraModel& c) { c.cy_px = 1e9; }, PackError::kCameraIntrinsics);
    with([&](CameraModel& c) { c.k1 = inf; }, PackError::kCameraIntrinsics);
    with([&](CameraModel& c) { c.k2 = 11.0; }, PackError::kCameraIntrinsics);
    with([&](CameraModel& c) { c.k3 = nan; }, PackError::kCameraIntrinsics);
    with([&](CameraModel& c) { c.p1 = nan; }, PackError::kCameraIntrinsics);
    with([&](CameraModel& c) { c.p2 = -2.0; }, PackError::kCameraIntrinsics);
    with([&](CameraModel& c) { c.k4 = nan; }, PackError::kCameraIntrinsics);
    with([&](CameraModel& c) { c.k5 = -11.0; }, PackError::kCameraIntrinsics);
    with([&](CameraModel& c) { c.k6 = inf; }, PackError::kCameraIntrinsics);
    with([&](CameraModel& c) { c.row_time_us = -1.0; }, PackError::kCameraIntrinsics);
    with([&](CameraModel& c) { c.row_time_us = 2000.0; }, PackError::kCameraIntrinsics);
    const auto fisheye = [&](auto change) {
        with(
            [&](CameraModel& c) {
                c.lens = LensModel::kFisheye;
                c.p1 = c.p2 = 0.0;
                change(c);
            },
            PackError::kCameraIntrinsics);
    };
    fisheye([](CameraModel& c) { c.p1 = 1e-3; });  // the model has no such term
    fisheye([](CameraModel& c) { c.k5 = 1e-3; });
    with([&](CameraModel& c) { c.camera_from_headset(0, 0) = nan; }, PackError::kCameraRotation);
    with([&](CameraModel& c) { c.camera_from_headset *= 1.01; }, PackError::kCameraRotation);
    with([&](CameraModel& c) { c.camera_from_headset.setZero(); }, PackError::kCameraRotation);
    with([&](CameraModel& c) { c.camera_from_headset(2, 2) *= -1.0; },
         PackError::kCameraRotation);  // a mirror
    with([&](CameraModel& c) { c.centre_mm[1] = nan; }, PackError::kCameraRotation);
    with([&](CameraModel& c) { c.centre_mm[2] = 1e6; }, PackError::kCameraRotation);
}

TEST(OpenPack, ReferenceMarksComeBackAndImplausibleOnesAreRefused) {
    const SamplePack sample({.cameras = 2, .reference_marks = kMaxReferenceMarks});
    AlignedBytes bytes(write_pack(sample.view, {}, sha256));
    const auto opened = open_pack(bytes.span(), sha256);
    ASSERT_TRUE(opened.has_value()) << pack_error_text(opened.error());
    ASSERT_EQ(opened->reference_mark_count, kMaxReferenceMarks);
    for (std::size_t i = 0; i < kMaxReferenceMarks; ++i) {
        EXPECT_EQ(opened->reference_marks[i].headset_mm, sample.view.reference_marks[i].headset_mm);
        EXPECT_EQ(opened->reference_marks[i].cameras, i % 2 == 0 ? 1 : 3);
    }
    for (std::size_t i = 0; i < bytes.span().size(); ++i) {
        bytes[i] ^= std::byte{1} << (i % 8);
        ASSERT_FALSE(open_pack(bytes.span(), sha256).has_value()) << i;
        bytes[i] ^= std::byte{1} << (i % 8);
    }
    const auto with = [](auto change) {
        SamplePack bad({.reference_marks = 2});
        change(bad.view.reference_marks[1]);
        expect_refused(bad.view, PackError::kReferenceMarks);
    };
    with([](HelmetMark& m) { m.headset_mm[0] = std::numeric_limits<double>::quiet_NaN(); });
    with([](HelmetMark& m) { m.headset_mm[2] = std::numeric_limits<double>::infinity(); });
    with([](HelmetMark& m) { m.headset_mm[1] = -2e4; });
    with([](HelmetMark& m) { m.cameras = 0; });
    with([](HelmetMark& m) { m.cameras = 2; });  // the pack has one camera
    with([](HelmetMark& m) { m.cameras = 255; });
    SamplePack blind({.cameras = 0});
    blind.view.reference_mark_count = 1;
    expect_refused(blind.view, PackError::kReferenceMarks);
}

TEST(OpenPack, RefusesBadNames) {
    const auto with = [](std::string_view shape, std::string_view marker, PackError error) {
        SamplePack sample({});
        if (shape.data() != nullptr) sample.view.shape_names[1] = shape;
        if (marker.data() != nullptr) sample.view.marker_names[2] = marker;
        expect_refused(sample.view, error);
    };
    const std::string longest(kMaxNameBytes + 1, 'x');
    for (const std::string_view bad :
         {std::string_view(""), std::string_view("a\nb"), std::string_view("tab\t"), std::string_view("\x7f"),
          std::string_view("\xff"), std::string_view("\xc3"), std::string_view("\xc0\x80"),
          std::string_view("\xed\xa0\x80"), std::string_view("\xe0\x80\x80"),
          std::string_view("\xf4\x90\x80\x80"), std::string_view(longest)}) {
        with(bad, {}, PackError::kNames);
        with({}, bad, PackError::kNames);
    }
    with("shape_0", {}, PackError::kNameTwice);
    with({}, "marker_3", PackError::kNameTwice);
    SamplePack sample({});
    sample.view.shape_names[0] = "m\xc3\xbcnd \xe2\x82\xac \xf0\x9f\x98\x80";
    const AlignedBytes bytes(write_pack(sample.view, {}, sha256));
    EXPECT_TRUE(open_pack(bytes.span(), sha256).has_value());
}

}  // namespace
}  // namespace rig
