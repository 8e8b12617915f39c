// Any bytes as OBJ text: a mesh whose corners all name a position, or an error.
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "firmware_host/companion/files/obj.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    const auto mesh = rig::host::parse_obj({reinterpret_cast<const char*>(data), size}, "fuzz.obj");
    if (!mesh) {
        if (mesh.error().message.find("fuzz.obj") == std::string::npos) std::abort();
        return 0;
    }
    std::size_t corners = 0;
    for (const std::int32_t polygon_size : mesh->polygon_sizes)
        corners += static_cast<std::size_t>(polygon_size);
    if (corners != mesh->corners.size()) std::abort();
    for (const std::int32_t corner : mesh->corners) {
        if (corner < 0 || static_cast<std::size_t>(corner) >= mesh->positions.size()) std::abort();
    }
    for (const auto& position : mesh->positions) {
        for (const double x : position) {
            if (!std::isfinite(x)) std::abort();
        }
    }
    for (const std::int32_t material : mesh->polygon_material) {
        if (material < -1 || material >= static_cast<std::int32_t>(mesh->materials.size())) std::abort();
    }
    return 0;
}
