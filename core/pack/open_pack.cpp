#include "core/pack/open_pack.hpp"

#include "core/base/math.hpp"
#include "core/pack/marker_set_sections.hpp"
#include "core/pack/region_sections.hpp"

namespace rig {

namespace {

// Sizes beyond which a number is a mistake or an attack: they keep every later product finite.
constexpr double kMaxFaceMm = 1e4;
constexpr double kMaxWeight = 1e3;
constexpr double kMinBlend = 1e-6;
constexpr double kMaxBlend = 1.0001;  // 1 within the tolerance of its sum
constexpr double kMinSigma = 1e-6;
constexpr double kMaxEnergyMm2 = 1e9;
constexpr double kMaxRbf = 1e6;
constexpr double kMinWidthMm = 1e-3;
constexpr double kMinVarianceMm2 = 1e-9;  // of a mode: under any camera's noise
constexpr double kMaxHullWidths = 1e3;
constexpr double kOrthonormalTolerance = 1e-3;  // rows stored as float32; a wrong basis misses by far more
constexpr double kMaxRowTimeUs = 1000.0;        // a picture of 480 rows would take half a second
constexpr double kRotationTolerance = 1e-4;     // calibration files print six digits and more

struct Bounds {
    double low;
    double high;
    PackError below;  // when a number is under `low`
};

Bounds bounds_of(SectionType type) {
    switch (type) {
        case SectionType::kNeutral:
        case SectionType::kBasis:
        case SectionType::kRbfMean:
        case SectionType::kRegionOrigin:
        case SectionType::kRegionExamples:
        case SectionType::kMarkerSetMean:
            return {-kMaxFaceMm, kMaxFaceMm, PackError::kMagnitude};
        case SectionType::kPriorSigma:
            return {kMinSigma, kMaxWeight, PackError::kPriorSigma};
        case SectionType::kTemporalGamma:
            return {0.0, kMaxEnergyMm2, PackError::kTemporalGamma};
        case SectionType::kRbfBasis:
            return {-1.0 - kOrthonormalTolerance, 1.0 + kOrthonormalTolerance, PackError::kRbfBasis};
        case SectionType::kMarkerSetModes:
            return {-1.0 - kOrthonormalTolerance, 1.0 + kOrthonormalTolerance, PackError::kMarkerSetModes};
        case SectionType::kMarkerSetVariance:
            return {kMinVarianceMm2, kMaxEnergyMm2, PackError::kMarkerSetVariance};
        case SectionType::kMarkerSetResidual:
            return {0.0, kMaxEnergyMm2, PackError::kMarkerSetVariance};
        case SectionType::kRbfCentres:
        case SectionType::kRbfWeights:
            return {-kMaxRbf, kMaxRbf, PackError::kMagnitude};
        case SectionType::kRbfWidths:
            return {kMinWidthMm, kMaxRbf, PackError::kRbfWidths};
        case SectionType::kRegionMarkerBlend:
            return {kMinBlend, kMaxBlend, PackError::kRegionMarkerBlend};
        case SectionType::kRegionShapeBlend:
            return {0.0, kMaxBlend, PackError::kRegionShapeBlend};
        default:
            return {-kMaxWeight, kMaxWeight, PackError::kMagnitude};
    }
}

std::span<const float> as_floats(ByteSpan bytes) {
    // Aligned: the pack starts at a 64-byte boundary and so does every section in it.
    return {reinterpret_cast<const float*>(bytes.data()), bytes.size() / sizeof(float)};
}

Result<void, PackError> check_numbers(SectionType type, std::span<const float> values) {
    const Bounds bounds = bounds_of(type);
    for (const float value : values) {
        const auto x = static_cast<double>(value);
        if (!is_finite(x)) return failure(PackError::kNotFinite);
        if (x < bounds.low) return failure(bounds.below);
        if (x > bounds.high) return failure(PackError::kMagnitude);
    }
    return {};
}

Result<void, PackError> check_scalars(const PackManifest& manifest) {
    const auto inside = [](float value, double low, double high) {
        const auto x = static_cast<double>(value);
        return is_finite(x) && x >= low && x <= high;
    };
    if (!inside(manifest.rate_hz, 1.0, 1000.0)) return failure(PackError::kRate);
    if (!inside(manifest.noise_mm, 0.9999e-4, 100.0)) return failure(PackError::kNoise);
    if (!inside(manifest.sparsity_mm2, 0.0, kMaxEnergyMm2) ||
        !inside(manifest.ridge_mm2, 0.0, kMaxEnergyMm2)) {
        return failure(PackError::kRegularisation);
    }
    const bool off = manifest.rbf_hull_near_widths == 0.0F && manifest.rbf_hull_far_widths == 0.0F;
    const bool ordered = inside(manifest.rbf_hull_near_widths, 0.0, kMaxHullWidths) &&
                         inside(manifest.rbf_hull_far_widths, 0.0, kMaxHullWidths) &&
                         manifest.rbf_hull_near_widths < manifest.rbf_hull_far_widths;
    if (!off && (!ordered || manifest.solver != SolverKind::kRbf)) return failure(PackError::kRbfHull);
    return {};
}

// Splits "a\nb\n" into exactly names.size() plain, distinct names.
Result<void, PackError> read_names(ByteSpan bytes, std::span<std::string_view> names) {
    const std::string_view text{reinterpret_cast<const char*>(bytes.data()), bytes.size()};
    std::size_t begin = 0;
    for (std::size_t i = 0; i < names.size(); ++i) {
        const std::size_t end = text.find('\n', begin);
        if (end == std::string_view::npos) return failure(PackError::kNames);
        names[i] = text.substr(begin, end - begin);
        if (!is_plain_text(names[i], kMaxNameBytes)) return failure(PackError::kNames);
        for (std::size_t k = 0; k < i; ++k) {
            if (names[k] == names[i]) return failure(PackError::kNameTwice);
        }
        begin = end + 1;
    }
    return begin == text.size() ? Result<void, PackError>{} : failure(PackError::kNames);
}

Result<void, PackError> check_section_set(const PackManifest& manifest) {
    std::array<bool, kSectionTypeCount + 1> present{};
    for (const PackSection& section : manifest.sections)
        present[static_cast<std::size_t>(section.type)] = true;
    const bool has_sets = present[static_cast<std::size_t>(SectionType::kMarkerSetTable)];
    for (std::size_t i = 1; i <= kSectionTypeCount; ++i) {
        const auto type = static_cast<SectionType>(i);
        const bool wanted = is_rbf_section(type)          ? manifest.solver == SolverKind::kRbf
                            : is_region_section(type)     ? is_regional(manifest.solver)
                            : is_marker_set_section(type) ? has_sets
                                                          : true;
        if (wanted && !present[i]) return failure(PackError::kSectionMissing);
        if (!wanted && present[i]) return failure(PackError::kSectionUnexpected);
    }
    return {};
}

Result<void, PackError> check_hashes(ByteSpan bytes, const PackManifest& manifest, HashFunction hash) {
    for (const PackSection& section : manifest.sections) {
        Hash digest{};
        hash(section_bytes(bytes, section), digest);
        if (digest != section.hash) return failure(PackError::kSectionHash);
    }
    return {};
}

// What is put together once every section is read.
struct Parts {
    RegionSections regions;
    MarkerSetSections sets;
};

std::span<const float>* tensor_of(SolvePack& pack, Parts& parts, SectionType type) {
    RegionSections& regions = parts.regions;
    switch (type) {
        case SectionType::kNeutral:
            return &pack.neutral_mm;
        case SectionType::kBasis:
            return &pack.basis_mm;
        case SectionType::kWeightLow:
            return &pack.weight_low;
        case SectionType::kWeightHigh:
            return &pack.weight_high;
        case SectionType::kPriorMean:
            return &pack.prior_mean;
        case SectionType::kPriorSigma:
            return &pack.prior_sigma;
        case SectionType::kTemporalGamma:
            return &pack.temporal_gamma;
        case SectionType::kRbfMean:
            return &pack.rbf.mean_mm;
        case SectionType::kRbfBasis:
            return &pack.rbf.basis;
        case SectionType::kRbfCentres:
            return &pack.rbf.centres;
        case SectionType::kRbfWidths:
            return &pack.rbf.widths_mm;
        case SectionType::kRbfWeights:
            return &pack.rbf.weights;
        case SectionType::kRbfOffset:
            return &pack.rbf.offset;
        case SectionType::kRegionMarkerBlend:
            return &regions.marker_blend;
        case SectionType::kRegionOrigin:
            return &regions.origin_mm;
        case SectionType::kRegionExamples:
            return &regions.examples_mm;
        case SectionType::kRegionShapes:
            return &regions.shapes;
        case SectionType::kRegionShapeBlend:
            return &regions.shape_blend;
        case SectionType::kMarkerSetMean:
            return &parts.sets.mean_mm;
        case SectionType::kMarkerSetModes:
            return &parts.sets.modes;
        case SectionType::kMarkerSetVariance:
            return &parts.sets.variance_mm2;
        case SectionType::kMarkerSetResidual:
            return &parts.sets.residual_mm2;
        default:  // names, tables and lists of markers are no floats
            break;
    }
    return nullptr;
}

Result<void, PackError> read_section(ByteSpan part, SectionType type, const PackCounts& counts,
                                     SolvePack& pack, Parts& parts) {
    if (type == SectionType::kShapeNames)
        return read_names(part, std::span(pack.shape_names).first(pack.shape_count));
    if (type == SectionType::kMarkerNames) {
        return read_names(part, std::span(pack.marker_names).first(pack.marker_count));
    }
    if (type == SectionType::kRegionNames)
        return read_names(part, std::span(parts.regions.names).first(counts.regions));
    if (type == SectionType::kMarkerSetNames)
        return read_names(part, std::span(parts.sets.names).first(counts.marker_sets));
    if (type == SectionType::kRegionTable || type == SectionType::kMarkerSetTable) return {};  // read first
    if (type == SectionType::kRegionMarkers || type == SectionType::kMarkerSetMarkers) {
        const bool regional = type == SectionType::kRegionMarkers;
        const auto markers = read_marker_list(part, regional ? counts.region_markers : counts.set_markers);
        if (!markers) return failure(markers.error());
        (regional ? parts.regions.markers : parts.sets.markers) = *markers;
        return {};
    }
    if (part.size() != sizeof(float) * section_floats(type, counts))
        return failure(PackError::kSectionLength);
    const std::span<const float> values = as_floats(part);
    *tensor_of(pack, parts, type) = values;
    return check_numbers(type, values);
}

Result<void, PackError> check_weight_ranges(const SolvePack& pack) {
    for (std::size_t i = 0; i < pack.shape_count; ++i) {
        if (pack.weight_low[i] > pack.weight_high[i]) return failure(PackError::kWeightRange);
    }
    return {};
}

Result<void, PackError> check_rbf_basis(const RbfModel& rbf, std::size_t rows) {
    for (std::size_t a = 0; a < rbf.dimension_count; ++a) {
        for (std::size_t b = 0; b <= a; ++b) {
            double sum = 0.0;
            for (std::size_t r = 0; r < rows; ++r) {
                sum += static_cast<double>(rbf.basis[a * rows + r]) *
                       static_cast<double>(rbf.basis[b * rows + r]);
            }
            const double error = sum - (a == b ? 1.0 : 0.0);
            if (error > kOrthonormalTolerance || error < -kOrthonormalTolerance)
                return failure(PackError::kRbfBasis);
        }
    }
    return {};
}

void copy_scalars(const PackManifest& manifest, SolvePack& pack) {
    pack.marker_count = static_cast<std::uint16_t>(manifest.counts.markers);
    pack.shape_count = static_cast<std::uint16_t>(manifest.counts.shapes);
    pack.solver = manifest.solver;
    pack.rate_hz = manifest.rate_hz;
    pack.noise_mm = manifest.noise_mm;
    pack.sparsity_mm2 = manifest.sparsity_mm2;
    pack.ridge_mm2 = manifest.ridge_mm2;
    pack.rbf.kernel = manifest.rbf_kernel;
    pack.rbf.hull_near_widths = manifest.rbf_hull_near_widths;
    pack.rbf.hull_far_widths = manifest.rbf_hull_far_widths;
    pack.rbf.dimension_count = static_cast<std::uint16_t>(manifest.counts.rbf_dimensions);
    pack.rbf.centre_count = static_cast<std::uint16_t>(manifest.counts.rbf_centres);
    pack.camera_count = static_cast<std::uint8_t>(manifest.cameras.size());
    for (std::size_t c = 0; c < manifest.cameras.size(); ++c) pack.cameras[c] = manifest.cameras[c];
    pack.reference_mark_count = static_cast<std::uint8_t>(manifest.reference_marks.size());
    for (std::size_t i = 0; i < manifest.reference_marks.size(); ++i)
        pack.reference_marks[i] = manifest.reference_marks[i];
}

}  // namespace

Result<void, PackError> check_camera(const CameraModel& camera) {
    const auto inside = [](double x, double low, double high) {
        return is_finite(x) && x >= low && x <= high;
    };
    const double width = camera.width_px;
    const double height = camera.height_px;
    const bool fisheye = camera.lens == LensModel::kFisheye;
    const double tangential = fisheye ? 0.0 : 1.0;
    const double denominator = fisheye ? 0.0 : 10.0;
    const bool plausible =
        camera.width_px >= 1 && camera.width_px <= static_cast<int>(kMaxImageWidth) &&
        camera.height_px >= 1 && camera.height_px <= static_cast<int>(kMaxImageHeight) &&
        inside(camera.fx_px, 1.0, 1e5) && inside(camera.fy_px, 1.0, 1e5) &&
        inside(camera.cx_px, -width, 2.0 * width) && inside(camera.cy_px, -height, 2.0 * height) &&
        inside(camera.k1, -10.0, 10.0) && inside(camera.k2, -10.0, 10.0) && inside(camera.k3, -10.0, 10.0) &&
        inside(camera.p1, -tangential, tangential) && inside(camera.p2, -tangential, tangential) &&
        inside(camera.k4, -10.0, 10.0) && inside(camera.k5, -denominator, denominator) &&
        inside(camera.k6, -denominator, denominator) && inside(camera.row_time_us, 0.0, kMaxRowTimeUs);
    if (!plausible) return failure(PackError::kCameraIntrinsics);
    const Mat3& r = camera.camera_from_headset;
    for (int i = 0; i < 9; ++i) {
        if (!inside(r(i / 3, i % 3), -2.0, 2.0)) return failure(PackError::kCameraRotation);
    }
    const Mat3 gram = r * r.transpose();
    for (int i = 0; i < 9; ++i) {
        const double error = gram(i / 3, i % 3) - (i % 4 == 0 ? 1.0 : 0.0);
        if (!inside(error, -kRotationTolerance, kRotationTolerance))
            return failure(PackError::kCameraRotation);
    }
    const Vec3 third = r.row(0).transpose().cross(r.row(1).transpose());
    if (third.dot(r.row(2).transpose()) <= 0.0) return failure(PackError::kCameraRotation);
    for (int i = 0; i < 3; ++i) {
        if (!inside(camera.centre_mm[i], -kMaxFaceMm, kMaxFaceMm)) return failure(PackError::kCameraRotation);
    }
    return {};
}

Result<void, PackError> check_reference_mark(const HelmetMark& mark, std::size_t camera_count) {
    for (int i = 0; i < 3; ++i) {
        const double x = mark.headset_mm[i];
        if (!is_finite(x) || x < -kMaxFaceMm || x > kMaxFaceMm) return failure(PackError::kReferenceMarks);
    }
    if (mark.cameras == 0 || (mark.cameras >> camera_count) != 0) return failure(PackError::kReferenceMarks);
    return {};
}

Result<SolvePack, PackError> open_pack(ByteSpan bytes, HashFunction hash) {
    const Result<PackManifest, PackError> manifest = read_manifest(bytes, hash);
    if (!manifest) return failure(manifest.error());
    if (auto ok = check_section_set(*manifest); !ok) return failure(ok.error());
    if (auto ok = check_hashes(bytes, *manifest, hash); !ok) return failure(ok.error());
    if (auto ok = check_scalars(*manifest); !ok) return failure(ok.error());
    for (const CameraModel& camera : manifest->cameras) {
        if (auto ok = check_camera(camera); !ok) return failure(ok.error());
    }
    for (const HelmetMark& mark : manifest->reference_marks) {
        if (auto ok = check_reference_mark(mark, manifest->cameras.size()); !ok) return failure(ok.error());
    }
    SolvePack pack;
    copy_scalars(*manifest, pack);
    PackCounts counts = manifest->counts;
    for (const PackSection& section : manifest->sections) {
        const ByteSpan part = section_bytes(bytes, section);
        Result<void, PackError> ok{};
        if (section.type == SectionType::kRegionTable)
            ok = read_region_table(part, pack.solver, counts, pack);
        if (section.type == SectionType::kMarkerSetTable) ok = read_marker_set_table(part, counts, pack);
        if (!ok) return failure(ok.error());
    }
    Parts parts;
    for (const PackSection& section : manifest->sections) {
        auto ok = read_section(section_bytes(bytes, section), section.type, counts, pack, parts);
        if (!ok) return failure(ok.error());
    }
    if (auto ok = check_weight_ranges(pack); !ok) return failure(ok.error());
    if (auto ok = check_rbf_basis(pack.rbf, 3 * manifest->counts.markers); !ok) return failure(ok.error());
    if (auto ok = assemble_regions(parts.regions, pack); !ok) return failure(ok.error());
    if (auto ok = assemble_marker_sets(parts.sets, pack); !ok) return failure(ok.error());
    return pack;
}

}  // namespace rig
