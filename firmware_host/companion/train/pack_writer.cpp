#include "firmware_host/companion/train/pack_writer.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <span>
#include <vector>

#include "core/pack/manifest_generated.h"
#include "firmware_host/pack_file/opened_pack.hpp"
#include "firmware_host/pack_file/sha256.hpp"

namespace rig::host {

namespace {

namespace fb = pack_manifest;

struct SectionData {
    SectionType type;
    std::vector<std::byte> bytes;
    Hash hash{};
};

std::vector<std::byte> bytes_of(std::span<const float> values) {
    const auto raw = std::as_bytes(values);
    return {raw.begin(), raw.end()};
}

std::vector<std::byte> bytes_of(std::span<const std::string_view> names) {
    std::vector<std::byte> bytes;
    for (const std::string_view name : names) {
        const auto raw = std::as_bytes(std::span(name));
        bytes.insert(bytes.end(), raw.begin(), raw.end());
        bytes.push_back(std::byte{'\n'});
    }
    return bytes;
}

// One part of every model, one after the other.
template <class Model, class T>
std::vector<std::byte> joined(std::span<const Model> models, std::span<const T> Model::* part) {
    std::vector<std::byte> bytes;
    for (const Model& model : models) {
        const auto raw = std::as_bytes(model.*part);
        bytes.insert(bytes.end(), raw.begin(), raw.end());
    }
    return bytes;
}

template <class Model>
std::vector<std::byte> bytes_of_names(std::span<const Model> models) {
    std::vector<std::string_view> names;
    for (const Model& model : models) names.push_back(model.name);
    return bytes_of(names);
}

std::vector<std::byte> bytes_of_table(std::span<const MarkerSetModel> sets) {
    std::vector<std::byte> bytes(kMarkerSetRecordBytes * sets.size());
    for (std::size_t f = 0; f < sets.size(); ++f) {
        const MutableByteSpan record = MutableByteSpan(bytes).subspan(f * kMarkerSetRecordBytes);
        store(record, 0, sets[f].level);
        store(record, 2, sets[f].marker_count);
        store(record, 4, sets[f].mode_count);
    }
    return bytes;
}

std::vector<std::byte> bytes_of_table(std::span<const RegionModel> regions) {
    std::vector<std::byte> bytes(kRegionRecordBytes * regions.size());
    for (std::size_t r = 0; r < regions.size(); ++r) {
        const MutableByteSpan record = MutableByteSpan(bytes).subspan(r * kRegionRecordBytes);
        store(record, 0, static_cast<std::uint8_t>(regions[r].solver));
        store(record, 2, regions[r].marker_count);
        store(record, 4, regions[r].example_count);
    }
    return bytes;
}

std::vector<SectionData> sections_of(const SolvePack& pack, HashFunction hash) {
    std::vector<SectionData> out;
    const auto add = [&](SectionType type, std::vector<std::byte> bytes) {
        out.push_back({type, std::move(bytes), {}});
        hash(out.back().bytes, out.back().hash);
    };
    add(SectionType::kNeutral, bytes_of(pack.neutral_mm));
    add(SectionType::kBasis, bytes_of(pack.basis_mm));
    add(SectionType::kWeightLow, bytes_of(pack.weight_low));
    add(SectionType::kWeightHigh, bytes_of(pack.weight_high));
    add(SectionType::kPriorMean, bytes_of(pack.prior_mean));
    add(SectionType::kPriorSigma, bytes_of(pack.prior_sigma));
    add(SectionType::kTemporalGamma, bytes_of(pack.temporal_gamma));
    const std::span shape_names(pack.shape_names);
    const std::span marker_names(pack.marker_names);
    add(SectionType::kShapeNames,
        bytes_of(shape_names.first(std::min<std::size_t>(pack.shape_count, kMaxShapes))));
    add(SectionType::kMarkerNames,
        bytes_of(marker_names.first(std::min<std::size_t>(pack.marker_count, kMaxMarkers))));
    if (pack.solver == SolverKind::kRbf) {
        add(SectionType::kRbfMean, bytes_of(pack.rbf.mean_mm));
        add(SectionType::kRbfBasis, bytes_of(pack.rbf.basis));
        add(SectionType::kRbfCentres, bytes_of(pack.rbf.centres));
        add(SectionType::kRbfWidths, bytes_of(pack.rbf.widths_mm));
        add(SectionType::kRbfWeights, bytes_of(pack.rbf.weights));
        add(SectionType::kRbfOffset, bytes_of(pack.rbf.offset));
    }
    if (is_regional(pack.solver)) {
        const std::span<const RegionModel> regions =
            std::span(pack.regions).first(std::min<std::size_t>(pack.region_count, kMaxRegions));
        add(SectionType::kRegionNames, bytes_of_names(regions));
        add(SectionType::kRegionTable, bytes_of_table(regions));
        add(SectionType::kRegionMarkers, joined(regions, &RegionModel::markers));
        add(SectionType::kRegionMarkerBlend, joined(regions, &RegionModel::marker_blend));
        add(SectionType::kRegionOrigin, joined(regions, &RegionModel::origin_mm));
        add(SectionType::kRegionExamples, joined(regions, &RegionModel::examples_mm));
        add(SectionType::kRegionShapes, joined(regions, &RegionModel::shapes));
        add(SectionType::kRegionShapeBlend, joined(regions, &RegionModel::shape_blend));
    }
    if (pack.marker_set_count > 0) {
        const std::span<const MarkerSetModel> sets =
            std::span(pack.marker_sets).first(std::min<std::size_t>(pack.marker_set_count, kMaxMarkerSets));
        add(SectionType::kMarkerSetNames, bytes_of_names(sets));
        add(SectionType::kMarkerSetTable, bytes_of_table(sets));
        add(SectionType::kMarkerSetMarkers, joined(sets, &MarkerSetModel::markers));
        add(SectionType::kMarkerSetMean, joined(sets, &MarkerSetModel::mean_mm));
        add(SectionType::kMarkerSetModes, joined(sets, &MarkerSetModel::modes));
        add(SectionType::kMarkerSetVariance, joined(sets, &MarkerSetModel::variance_mm2));
        add(SectionType::kMarkerSetResidual, joined(sets, &MarkerSetModel::residual_mm2));
    }
    return out;
}

fb::Camera stored_camera(const CameraModel& camera) {
    std::array<double, 9> rotation{};
    for (std::size_t i = 0; i < 9; ++i) {
        rotation[i] = camera.camera_from_headset(static_cast<int>(i) / 3, static_cast<int>(i) % 3);
    }
    const std::array<double, 3> centre{camera.centre_mm[0], camera.centre_mm[1], camera.centre_mm[2]};
    return {static_cast<std::uint32_t>(camera.width_px),
            static_cast<std::uint32_t>(camera.height_px),
            camera.fx_px,
            camera.fy_px,
            camera.cx_px,
            camera.cy_px,
            camera.k1,
            camera.k2,
            camera.p1,
            camera.p2,
            camera.k3,
            flatbuffers::span<const double, 9>(rotation.data(), rotation.size()),
            flatbuffers::span<const double, 3>(centre.data(), centre.size())};
}

bool has_new_lens(const CameraModel& camera) {
    return camera.lens != LensModel::kRational || camera.k4 != 0.0 || camera.k5 != 0.0 || camera.k6 != 0.0 ||
           camera.row_time_us != 0.0;
}

// Empty when every camera is one that older cores know.
std::vector<fb::CameraLens> stored_lenses(const SolvePack& pack) {
    const std::span<const CameraModel> cameras(pack.cameras.data(), pack.camera_count);
    std::vector<fb::CameraLens> lenses;
    if (std::ranges::none_of(cameras, has_new_lens)) return lenses;
    for (const CameraModel& camera : cameras) {
        lenses.emplace_back(static_cast<std::uint8_t>(camera.lens), std::uint8_t{0}, std::uint16_t{0}, 0U,
                            camera.k4, camera.k5, camera.k6, camera.row_time_us);
    }
    return lenses;
}

std::vector<fb::ReferenceMark> stored_marks(const SolvePack& pack) {
    std::vector<fb::ReferenceMark> marks;
    for (const HelmetMark& mark :
         std::span(pack.reference_marks)
             .first(std::min<std::size_t>(pack.reference_mark_count, kMaxReferenceMarks))) {
        const std::array<double, 3> at{mark.headset_mm[0], mark.headset_mm[1], mark.headset_mm[2]};
        marks.emplace_back(flatbuffers::span<const double, 3>(at.data(), at.size()), mark.cameras,
                           std::uint8_t{0}, std::uint16_t{0}, 0U);
    }
    return marks;
}

// A version 8 UUID (RFC 9562: contents are ours to choose) of the contents.
std::array<std::uint8_t, 16> uuid_of(const std::vector<SectionData>& sections, const PackIdentity& identity) {
    std::vector<std::byte> all;
    const auto add = [&](ByteSpan part) { all.insert(all.end(), part.begin(), part.end()); };
    add(std::as_bytes(std::span(identity.name)));
    add(std::as_bytes(std::span(&identity.pack_version, 1)));
    for (const SectionData& section : sections) add(section.hash);
    Hash digest{};
    sha256(all, digest);
    std::array<std::uint8_t, 16> uuid{};
    std::memcpy(uuid.data(), digest.data(), uuid.size());
    uuid[6] = static_cast<std::uint8_t>((uuid[6] & 0x0f) | 0x80);
    uuid[8] = static_cast<std::uint8_t>((uuid[8] & 0x3f) | 0x80);
    return uuid;
}

std::vector<fb::Section> table_of(const std::vector<SectionData>& sections, std::uint64_t manifest_bytes) {
    std::vector<fb::Section> table;
    std::uint64_t end = kPackHeaderBytes + manifest_bytes;
    for (const SectionData& section : sections) {
        const std::uint64_t offset = align_up(end);
        const flatbuffers::span<const std::uint8_t, kHashBytes> hash(
            reinterpret_cast<const std::uint8_t*>(section.hash.data()), kHashBytes);
        table.emplace_back(static_cast<std::uint16_t>(section.type), std::uint16_t{0}, 0U, offset,
                           std::uint64_t{section.bytes.size()}, hash);
        end = offset + section.bytes.size();
    }
    return table;
}

// The oldest core that takes this pack's numbers for what they are: one before 2 would take any kernel for
// the Gaussian and never fall back, one before 3 any lens for a polynomial one, and refuse marker sets, one
// before 4 the helmet's marks for markers.
std::uint16_t oldest_core_for(const SolvePack& pack) {
    constexpr std::uint16_t kMarkerSetAndLensAbi = 3;
    constexpr std::uint16_t kRbfKernelAbi = 2;
    constexpr std::uint16_t kReferenceMarkAbi = 4;
    if (pack.reference_mark_count > 0) return kReferenceMarkAbi;
    if (pack.marker_set_count > 0 || !stored_lenses(pack).empty()) return kMarkerSetAndLensAbi;
    const bool gaussian = pack.rbf.kernel == RbfKernel::kGaussian && pack.rbf.hull_far_widths == 0.0F;
    return gaussian ? kOldestSolverAbi : kRbfKernelAbi;
}

std::vector<std::byte> manifest_of(const SolvePack& pack, const PackIdentity& identity,
                                   const std::vector<SectionData>& sections, std::uint64_t manifest_bytes) {
    const std::vector<fb::Section> table = table_of(sections, manifest_bytes);
    const std::uint64_t total = table.back().offset() + table.back().length();
    flatbuffers::FlatBufferBuilder builder;
    builder.ForceDefaults(true);  // the length must not depend on the values
    const auto uuid_bytes = uuid_of(sections, identity);
    const fb::Uuid uuid(flatbuffers::span<const std::uint8_t, 16>(uuid_bytes.data(), uuid_bytes.size()));
    std::vector<fb::Camera> cameras;
    for (std::size_t c = 0; c < pack.camera_count; ++c) cameras.push_back(stored_camera(pack.cameras[c]));
    const auto name = builder.CreateString(identity.name);
    const auto boards = builder.CreateVectorOfStrings(identity.boards);
    const auto camera_vector = builder.CreateVectorOfStructs(cameras);
    const std::vector<fb::CameraLens> lenses = stored_lenses(pack);
    const auto lens_vector = builder.CreateVectorOfStructs(lenses);
    const std::vector<fb::ReferenceMark> marks = stored_marks(pack);
    flatbuffers::Offset<flatbuffers::Vector<const fb::ReferenceMark*>> mark_vector;
    if (!marks.empty()) mark_vector = builder.CreateVectorOfStructs(marks);
    const auto section_vector = builder.CreateVectorOfStructs(table);
    fb::ManifestBuilder manifest(builder);
    manifest.add_uuid(&uuid);
    manifest.add_name(name);
    manifest.add_pack_version(identity.pack_version);
    manifest.add_security_counter(identity.security_counter);
    manifest.add_solver_abi_min(oldest_core_for(pack));
    manifest.add_solver_abi_max(kSolverAbi);
    manifest.add_boards(boards);
    manifest.add_memory_bytes((total + 4095) / 4096 * 4096);  // whole pages of the mapped file
    manifest.add_solver(static_cast<std::uint8_t>(pack.solver));
    manifest.add_marker_count(pack.marker_count);
    manifest.add_shape_count(pack.shape_count);
    manifest.add_rbf_dimension_count(pack.rbf.dimension_count);
    manifest.add_rbf_centre_count(pack.rbf.centre_count);
    manifest.add_rate_hz(pack.rate_hz);
    manifest.add_noise_mm(pack.noise_mm);
    manifest.add_sparsity_mm2(pack.sparsity_mm2);
    manifest.add_ridge_mm2(pack.ridge_mm2);
    manifest.add_cameras(camera_vector);
    manifest.add_sections(section_vector);
    manifest.add_rbf_kernel(static_cast<std::uint8_t>(pack.rbf.kernel));
    manifest.add_rbf_hull_near_widths(pack.rbf.hull_near_widths);
    manifest.add_rbf_hull_far_widths(pack.rbf.hull_far_widths);
    manifest.add_region_count(pack.region_count);
    if (!lenses.empty()) manifest.add_camera_lenses(lens_vector);
    if (!marks.empty()) manifest.add_reference_marks(mark_vector);
    fb::FinishManifestBuffer(builder, manifest.Finish());
    const auto raw = std::as_bytes(std::span(builder.GetBufferPointer(), builder.GetSize()));
    return {raw.begin(), raw.end()};
}

Result<void, FileError> write_beside_and_rename(const std::filesystem::path& path, ByteSpan bytes) {
    std::filesystem::path beside = path;
    beside += ".part";
    {
        std::ofstream out(beside, std::ios::binary | std::ios::trunc);
        out.write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
        out.flush();
        if (!out) {
            return failure(FileError{fmt::format(
                "{}: cannot be written; does the folder exist and is there space?", beside.string())});
        }
    }
    std::error_code fault;
    std::filesystem::rename(beside, path, fault);
    if (fault)
        return failure(FileError{fmt::format("{}: cannot be written: {}", path.string(), fault.message())});
    return {};
}

}  // namespace

std::vector<std::byte> write_pack(const SolvePack& pack, const PackIdentity& identity, HashFunction hash) {
    const std::vector<SectionData> sections = sections_of(pack, hash);
    // Offsets depend on the manifest's length, and that not on their values: the second pass has the length
    // of the first.
    const std::size_t manifest_bytes = manifest_of(pack, identity, sections, 0).size();
    const std::vector<std::byte> manifest = manifest_of(pack, identity, sections, manifest_bytes);
    const std::vector<fb::Section> table = table_of(sections, manifest.size());
    std::vector<std::byte> out(table.back().offset() + table.back().length());
    const MutableByteSpan file(out);
    std::memcpy(out.data(), kPackMagic.data(), kPackMagic.size());
    store(file, 8, kPackFormatVersion);
    store(file, 12, static_cast<std::uint32_t>(manifest.size()));
    store(file, 16, std::uint64_t{out.size()});
    Hash manifest_hash{};
    hash(manifest, manifest_hash);
    store(file, 32, manifest_hash);
    std::ranges::copy(manifest, out.begin() + kPackHeaderBytes);
    for (std::size_t i = 0; i < sections.size(); ++i) {
        std::ranges::copy(sections[i].bytes, out.begin() + static_cast<std::ptrdiff_t>(table[i].offset()));
    }
    return out;
}

Result<void, FileError> save_pack(const std::filesystem::path& path, const SolvePack& pack,
                                  const PackIdentity& identity) {
    const std::vector<std::byte> bytes = write_pack(pack, identity, sha256);
    if (const auto opened = open_pack_copy(bytes, path.string()); !opened) {
        return failure(
            FileError{fmt::format("{} would not be usable and was not written", opened.error().message)});
    }
    return write_beside_and_rename(path, bytes);
}

}  // namespace rig::host
