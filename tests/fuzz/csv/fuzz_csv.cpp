// Any bytes as each text table that is read: plain numbers, a take, a marker layout, a list of markers to
// import.
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "core/limits.hpp"
#include "firmware_host/companion/files/csv.hpp"
#include "firmware_host/companion/rig_folder/layout_file.hpp"
#include "firmware_host/companion/rig_folder/obj_import.hpp"
#include "firmware_host/companion/rig_folder/take_file.hpp"

namespace {

using namespace rig::host;

const Rig& square() {
    static const Rig rig{.vertices_mm = {{0, 0, 0}, {10, 0, 0}, {10, 10, 0}, {0, 10, 0}},
                         .triangles = {{0, 1, 2}, {0, 2, 3}},
                         .triangle_part = {0, 0},
                         .parts = {"face"},
                         .shapes = {{.name = "jawOpen", .vertices = {0}, .delta_mm = {{0, -1, 0}}}}};
    return rig;
}

void require(bool condition) {
    if (!condition) std::abort();
}

void check_layout_result(const rig::Result<MarkerLayout, FileError>& layout) {
    if (!layout) {
        require(layout.error().message.find("fuzz.csv") != std::string::npos);
        return;
    }
    require(layout->markers.size() >= rig::kMinMarkers && layout->markers.size() <= rig::kMaxMarkers);
    for (const float value : marker_model(square(), *layout).neutral_mm) require(std::isfinite(value));
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    const std::string_view text{reinterpret_cast<const char*>(data), size};
    if (const auto table = parse_numeric_csv(text, "fuzz.csv")) {
        require(table->values.size() == table->row_count * table->columns.size());
        for (const double value : table->values) require(std::isfinite(value));
    }
    if (const auto take = parse_take(text, "fuzz.csv", {"jawOpen", "browUp"})) {
        require(take->frame_count > 0 && take->weights.size() == 2 * take->frame_count);
        require(std::isfinite(take->rate_hz) && take->rate_hz > 0.0);
    }
    check_layout_result(parse_layout(text, "fuzz.csv", square()));
    check_layout_result(parse_marker_list(text, "fuzz.csv", square(), 1.0));
    return 0;
}
