// headrig pack info: what is in a solve pack.
#include <fmt/format.h>

#include <array>
#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>

#include "firmware_host/companion/commands/console.hpp"
#include "firmware_host/companion/commands/verbs.hpp"
#include "firmware_host/companion/train/camera_file.hpp"
#include "firmware_host/pack_file/opened_pack.hpp"

namespace rig::host {

namespace {

using nlohmann::json;

struct PackInfoCommand {
    std::string file;
    bool json = false;
};

std::string hex(const Hash& hash) {
    std::string out;
    for (const std::byte b : hash) out += fmt::format("{:02x}", static_cast<unsigned>(b));
    return out;
}

std::string uuid_text(const std::array<std::uint8_t, 16>& uuid) {
    std::string out;
    for (std::size_t i = 0; i < uuid.size(); ++i) {
        if (i == 4 || i == 6 || i == 8 || i == 10) out += '-';
        out += fmt::format("{:02x}", uuid[i]);
    }
    return out;
}

const char* solver_name(SolverKind solver) {
    switch (solver) {
        case SolverKind::kLeastSquares:
            return "lsq";
        case SolverKind::kNonNegative:
            return "nnls";
        case SolverKind::kBoxQp:
            return "boxqp";
        case SolverKind::kRbf:
            return "rbf";
        case SolverKind::kKeyShapes:
            return "keyshapes";
        case SolverKind::kExamples:
            return "examples";
    }
    return "unknown";
}

// Euclidean norm of column i of the basis: how much a full weight moves the markers in sum.
double column_mm(const SolvePack& pack, std::size_t i) {
    double sum = 0.0;
    for (std::size_t r = 0; r < 3U * pack.marker_count; ++r) {
        const auto x = static_cast<double>(pack.basis_mm[r * pack.shape_count + i]);
        sum += x * x;
    }
    return std::sqrt(sum);
}

json shape_json(const SolvePack& pack, std::size_t i) {
    return {{"name", pack.shape_names[i]},
            {"column_mm", column_mm(pack, i)},
            {"low", pack.weight_low[i]},
            {"high", pack.weight_high[i]},
            {"prior_mean", pack.prior_mean[i]},
            {"prior_sigma", pack.prior_sigma[i]},
            {"temporal_gamma_mm2", pack.temporal_gamma[i]}};
}

const char* region_solver_name(RegionSolver solver) {
    return solver == RegionSolver::kSimplex ? "simplex" : "nnls";
}

json region_json(const SolvePack& pack, const RegionModel& region) {
    json out = {{"name", region.name},
                {"solver", region_solver_name(region.solver)},
                {"examples", region.example_count},
                {"markers", json::array()},
                {"shapes", json::array()}};
    for (std::size_t a = 0; a < region.marker_count; ++a) {
        out["markers"].push_back(
            {{"name", pack.marker_names[region.markers[a]]}, {"blend", region.marker_blend[a]}});
    }
    for (std::size_t i = 0; i < pack.shape_count; ++i) {
        if (region.shape_blend[i] > 0.0F)
            out["shapes"].push_back({{"name", pack.shape_names[i]}, {"blend", region.shape_blend[i]}});
    }
    return out;
}

json pack_json(const OpenedPack& opened) {
    const SolvePack& pack = opened.pack();
    const PackManifest& manifest = opened.manifest();
    json out = {{"name", manifest.name},
                {"uuid", uuid_text(manifest.uuid)},
                {"pack_version", manifest.pack_version},
                {"security_counter", manifest.security_counter},
                {"format_version", kPackFormatVersion},
                {"solver_abi", {manifest.solver_abi_min, manifest.solver_abi_max}},
                {"total_bytes", manifest.total_bytes},
                {"memory_bytes", manifest.memory_bytes},
                {"manifest_bytes", manifest.manifest_bytes},
                {"manifest_sha256", hex(manifest.manifest_hash)},
                {"solver", solver_name(pack.solver)},
                {"rate_hz", pack.rate_hz},
                {"noise_mm", pack.noise_mm},
                {"sparsity_mm2", pack.sparsity_mm2},
                {"ridge_mm2", pack.ridge_mm2},
                {"rbf_dimensions", pack.rbf.dimension_count},
                {"rbf_centres", pack.rbf.centre_count},
                {"rbf_kernel", rbf_kernel_name(pack.rbf.kernel)},
                {"rbf_hull_widths", {pack.rbf.hull_near_widths, pack.rbf.hull_far_widths}}};
    for (const char* list :
         {"boards", "sections", "cameras", "reference_marks", "regions", "marker_sets", "shapes", "markers"})
        out[list] = json::array();
    for (const std::string_view board : manifest.boards) out["boards"].push_back(board);
    for (const PackSection& section : manifest.sections) {
        out["sections"].push_back({{"type", section_name(section.type)},
                                   {"offset", section.offset},
                                   {"bytes", section.length},
                                   {"sha256", hex(section.hash)}});
    }
    for (std::size_t c = 0; c < pack.camera_count; ++c)
        out["cameras"].push_back(json(camera_json(pack.cameras[c])));
    for (const HelmetMark& mark : pack.helmet_marks()) {
        out["reference_marks"].push_back(
            {{"headset_mm", {mark.headset_mm[0], mark.headset_mm[1], mark.headset_mm[2]}},
             {"cameras", json::array()}});
        for (std::size_t c = 0; c < pack.camera_count; ++c)
            if (mark.is_seen_by(c)) out["reference_marks"].back()["cameras"].push_back(c);
    }
    for (std::size_t r = 0; r < pack.region_count; ++r)
        out["regions"].push_back(region_json(pack, pack.regions[r]));
    for (std::size_t f = 0; f < pack.marker_set_count; ++f) {
        const MarkerSetModel& set = pack.marker_sets[f];
        out["marker_sets"].push_back({{"name", set.name},
                                      {"level", set.level},
                                      {"markers", set.marker_count},
                                      {"components", set.mode_count}});
    }
    for (std::size_t i = 0; i < pack.shape_count; ++i) out["shapes"].push_back(shape_json(pack, i));
    for (std::size_t k = 0; k < pack.marker_count; ++k) {
        out["markers"].push_back(
            {{"name", pack.marker_names[k]},
             {"neutral_mm",
              {pack.neutral_mm[3 * k], pack.neutral_mm[3 * k + 1], pack.neutral_mm[3 * k + 2]}}});
    }
    return out;
}

void print_identity(const PackInfoCommand& command, const OpenedPack& opened) {
    const SolvePack& pack = opened.pack();
    const PackManifest& manifest = opened.manifest();
    fmt::print("file         {}\n", command.file);
    fmt::print("name         {}  version {}  counter {}\n", manifest.name, manifest.pack_version,
               manifest.security_counter);
    fmt::print("uuid         {}\n", uuid_text(manifest.uuid));
    fmt::print("format       {}  solver interface {} to {}\n", kPackFormatVersion, manifest.solver_abi_min,
               manifest.solver_abi_max);
    fmt::print("boards       {}\n",
               manifest.boards.empty() ? "any" : fmt::format("{}", fmt::join(manifest.boards.span(), ", ")));
    fmt::print("size         {} bytes, manifest {} bytes, memory {} bytes\n", manifest.total_bytes,
               manifest.manifest_bytes, manifest.memory_bytes);
    fmt::print("solver       {} at {} Hz\n", solver_name(pack.solver), pack.rate_hz);
    fmt::print("markers      {}  noise {} mm\n", pack.marker_count, pack.noise_mm);
    fmt::print("shapes       {}  sparsity {} mm^2  ridge {} mm^2\n", pack.shape_count, pack.sparsity_mm2,
               pack.ridge_mm2);
    if (pack.solver == SolverKind::kRbf) {
        fmt::print("rbf          {} centres in {} dimensions, {} kernel\n", pack.rbf.centre_count,
                   pack.rbf.dimension_count, rbf_kernel_name(pack.rbf.kernel));
        if (pack.rbf.hull_far_widths > 0.0F) {
            fmt::print("             box QP from {} to {} widths from its nearest centre\n",
                       pack.rbf.hull_near_widths, pack.rbf.hull_far_widths);
        }
    }
    if (pack.region_count > 0) fmt::print("regions      {}\n", pack.region_count);
    if (pack.marker_set_count > 0) fmt::print("marker sets  {}\n", pack.marker_set_count);
    fmt::print("cameras      {}\n", pack.camera_count);
    if (pack.reference_mark_count > 0) fmt::print("helmet marks {}\n", pack.reference_mark_count);
}

void print_tables(const OpenedPack& opened) {
    const SolvePack& pack = opened.pack();
    const PackManifest& manifest = opened.manifest();
    for (std::size_t c = 0; c < pack.camera_count; ++c) {
        const CameraModel& camera = pack.cameras[c];
        fmt::print(
            "  {}  {} x {} px  {}  f {:.2f} {:.2f}  c {:.2f} {:.2f}  k {:.4g} {:.4g} {:.4g} {:.4g} {:.4g} "
            "{:.4g}  p {:.4g} {:.4g}  row {:.3g} us  at {:.1f} {:.1f} {:.1f} mm\n",
            c, camera.width_px, camera.height_px, lens_name(camera.lens), camera.fx_px, camera.fy_px,
            camera.cx_px, camera.cy_px, camera.k1, camera.k2, camera.k3, camera.k4, camera.k5, camera.k6,
            camera.p1, camera.p2, camera.row_time_us, camera.centre_mm[0], camera.centre_mm[1],
            camera.centre_mm[2]);
    }
    for (std::size_t r = 0; r < pack.region_count; ++r) {
        const RegionModel& region = pack.regions[r];
        std::size_t shapes = 0;
        for (const float blend : region.shape_blend) shapes += blend > 0.0F ? 1 : 0;
        fmt::print("  {:<14} {:<8} {:>3} markers {:>3} examples  speaks for {} shapes\n", region.name,
                   region_solver_name(region.solver), region.marker_count, region.example_count, shapes);
    }
    for (std::size_t f = 0; f < pack.marker_set_count; ++f) {
        const MarkerSetModel& set = pack.marker_sets[f];
        fmt::print("  {:<18} level {}  {:>3} markers {:>3} components\n", set.name, set.level,
                   set.marker_count, set.mode_count);
    }
    fmt::print("\n{:<19} {:>9} {:>9}  sha256\n", "section", "offset", "bytes");
    for (const PackSection& section : manifest.sections) {
        fmt::print("{:<19} {:>9} {:>9}  {}\n", section_name(section.type), section.offset, section.length,
                   hex(section.hash));
    }
    fmt::print("{:<19} {:>9} {:>9}  {}\n", "manifest", kPackHeaderBytes, manifest.manifest_bytes,
               hex(manifest.manifest_hash));
    fmt::print("\n{:<28} {:>9} {:>5} {:>5} {:>7} {:>7} {:>10}\n", "shape", "column mm", "low", "high", "mean",
               "sigma", "pull mm^2");
    for (std::size_t i = 0; i < pack.shape_count; ++i) {
        fmt::print("{:<28} {:>9.2f} {:>5.2f} {:>5.2f} {:>7.3f} {:>7.3f} {:>10.4g}\n", pack.shape_names[i],
                   column_mm(pack, i), pack.weight_low[i], pack.weight_high[i], pack.prior_mean[i],
                   pack.prior_sigma[i], pack.temporal_gamma[i]);
    }
    fmt::print("\n{:<28} {:>8} {:>8} {:>8}\n", "marker", "x mm", "y mm", "z mm");
    for (std::size_t k = 0; k < pack.marker_count; ++k) {
        fmt::print("{:<28} {:>8.2f} {:>8.2f} {:>8.2f}\n", pack.marker_names[k], pack.neutral_mm[3 * k],
                   pack.neutral_mm[3 * k + 1], pack.neutral_mm[3 * k + 2]);
    }
}

int run_pack_info(const PackInfoCommand& command) {
    const auto opened = open_pack_file(command.file);
    if (!opened) {
        print_error(opened.error().message);
        return kExitInput;
    }
    if (command.json) {
        fmt::print("{}\n", pack_json(*opened).dump(1));
    } else {
        print_identity(command, *opened);
        print_tables(*opened);
    }
    return kExitOk;
}

}  // namespace

void add_pack_verb(CLI::App& app, int& exit_code) {
    CLI::App* pack = app.add_subcommand("pack", "Look into solve packs");
    pack->require_subcommand(1);
    auto command = std::make_shared<PackInfoCommand>();
    CLI::App* info = pack->add_subcommand("info", "Verify a pack and print everything readable in it");
    info->add_option("file", command->file, "pack file")->required()->type_name("PACK");
    info->add_flag("--json", command->json, "as one JSON object");
    info->footer(
        "Exit code 3 and one sentence when the file is damaged, foreign or unusable.\n"
        "Examples:\n  headrig pack info face.pack\n  headrig pack info face.pack --json | jq .sections");
    info->callback([command, &exit_code] { exit_code = run_pack_info(*command); });
}

}  // namespace rig::host
