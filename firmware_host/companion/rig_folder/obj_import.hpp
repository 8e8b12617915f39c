// From a folder of OBJ files (the neutral face and one file a shape, as modelling programs export them) and a
// list of markers to a rig.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "firmware_host/companion/files/obj.hpp"
#include "firmware_host/companion/rig_folder/rig_folder.hpp"

namespace rig::host {

struct ObjImport {
    std::filesystem::path folder;
    std::string neutral = "neutral.obj";  // a name in the folder
    std::filesystem::path markers;        // CSV, see parse_marker_list()
    double mm_per_unit = 1.0;             // of both the OBJ files and the marker list
};

struct ImportedRig {
    Rig rig;
    MarkerLayout layout;
};

// Every other *.obj of the folder is a shape, named as the file without .obj, in alphabetical order. Polygons
// become fans of triangles, materials become parts (one part "face" where there are none). Deltas under 0.005
// mm are left out. Errors name the file: missing, malformed, another vertex count or other faces than the
// neutral's, no shapes, too many, names that cannot be used.
[[nodiscard]] Result<ImportedRig, FileError> import_obj_folder(const ObjImport& import);

// CSV with the columns name and vertex (index from 0), or name,x,y,z (a point whose nearest point of the
// surface carries the marker), or all five, where an empty vertex means that the row's x,y,z count. Errors
// name `name` and the line: a vertex that is not there, a point over 20 mm off the surface, unusable or
// repeated names.
[[nodiscard]] Result<MarkerLayout, FileError> parse_marker_list(std::string_view text,
                                                                const std::filesystem::path& name,
                                                                const Rig& rig, double mm_per_unit);

}  // namespace rig::host
