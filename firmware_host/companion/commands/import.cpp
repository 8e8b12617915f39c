#include <fmt/format.h>

#include <memory>
#include <string>

#include "firmware_host/companion/commands/console.hpp"
#include "firmware_host/companion/commands/verbs.hpp"
#include "firmware_host/companion/files/whole_file.hpp"
#include "firmware_host/companion/rig_folder/obj_import.hpp"

namespace rig::host {

namespace {

struct ImportOptions {
    std::string obj_folder;
    std::string neutral = "neutral.obj";
    std::string markers;
    std::string out;
    std::string unit = "mm";
    double scale = 1.0;
    bool force = false;
};

double unit_mm(const std::string& unit) {
    if (unit == "m") return 1000.0;
    return unit == "cm" ? 10.0 : 1.0;
}

int run_import(const ImportOptions& options) {
    const auto imported = import_obj_folder({.folder = options.obj_folder,
                                             .neutral = options.neutral,
                                             .markers = options.markers,
                                             .mm_per_unit = unit_mm(options.unit) * options.scale});
    if (!imported) {
        print_error(imported.error().message);
        return kExitInput;
    }
    const auto save = [&]() -> Result<void, FileError> {
        if (const auto ok = make_output_folder(options.out, options.force); !ok) return ok;
        if (const auto ok = save_rig(options.out, imported->rig); !ok) return ok;
        return save_layout(options.out, imported->layout, imported->rig);
    };
    if (const auto ok = save(); !ok) {
        print_error(ok.error().message);
        return kExitOutput;
    }
    const std::size_t marker_count = imported->layout.markers.size();
    fmt::print("{}: {} vertices, {} triangles, {} shapes, {} markers\n", options.out,
               imported->rig.vertices_mm.size(), imported->rig.triangles.size(), imported->rig.shapes.size(),
               marker_count);
    fmt::print("next: headrig train --rig {} --layout {} --solver boxqp --out face.pack\n", options.out,
               marker_count);
    return kExitOk;
}

}  // namespace

void add_import_verb(CLI::App& app, int& exit_code) {
    auto options = std::make_shared<ImportOptions>();
    CLI::App* verb = app.add_subcommand("import", "Make a rig folder from OBJ files and a list of markers");
    verb->add_option("obj_folder", options->obj_folder,
                     "Folder of OBJ files: the neutral face and one file a shape")
        ->required()
        ->type_name("OBJ_DIR");
    verb->add_option("--neutral", options->neutral, "Name of the neutral face in the folder")
        ->capture_default_str()
        ->type_name("FILE");
    verb->add_option("--markers", options->markers,
                     "CSV name,vertex (from 0) or name,x,y,z (put on the surface)")
        ->required()
        ->type_name("LIST.csv");
    verb->add_option("--out", options->out, "Rig folder to write")->required()->type_name("DIR");
    verb->add_option("--unit", options->unit, "Unit of the files: mm, cm or m")
        ->capture_default_str()
        ->check(CLI::IsMember({"mm", "cm", "m"}).description(""))
        ->type_name("UNIT");
    verb->add_option("--scale", options->scale, "Further factor on all coordinates")
        ->capture_default_str()
        ->check(CLI::Range(1.0e-6, 1.0e6));
    verb->add_flag("--force", options->force, "Write into a folder that is not empty");
    verb->footer(
        "The files hold the same vertices in the same order; shapes are named as their files. Axes as "
        "everywhere here:\n"
        "+x to the performer's left, +y up, +z out of the face, origin midway between the eyeballs.\n"
        "Examples:\n"
        "  headrig import scans/ --neutral neutral.obj --markers dots.csv --out head/\n"
        "  headrig import scans/ --markers dots.csv --unit cm --out head/\n"
        "Exit codes: 0 done, 2 wrong command line, 3 an input is missing or malformed, 4 the folder could "
        "not be\n"
        "written or is not empty.");
    verb->callback([options, &exit_code] { exit_code = run_import(*options); });
}

}  // namespace rig::host
