#include <array>
#include <cstddef>
#include <span>
#include <vector>

#include "firmware_host/companion/rig_folder/rig_folder.hpp"

namespace rig::host {

namespace {

struct Corner {
    std::size_t marker;
    float share;
};

// For every vertex the markers that hang on it, as one list with offsets: shapes touch far more vertices than
// that.
class CornersByVertex {
  public:
    CornersByVertex(const MarkerLayout& layout, std::size_t vertex_count) : offsets_(vertex_count + 1, 0) {
        for (const LayoutMarker& marker : layout.markers) {
            for (const std::int32_t vertex : marker.vertices)
                ++offsets_[static_cast<std::size_t>(vertex) + 1];
        }
        for (std::size_t v = 0; v < vertex_count; ++v) offsets_[v + 1] += offsets_[v];
        corners_.resize(offsets_.back());
        std::vector<std::size_t> next(offsets_.begin(), offsets_.end() - 1);
        for (std::size_t m = 0; m < layout.markers.size(); ++m) {
            for (std::size_t c = 0; c < 3; ++c) {
                const auto vertex = static_cast<std::size_t>(layout.markers[m].vertices[c]);
                corners_[next[vertex]++] = {m, layout.markers[m].barycentric[c]};
            }
        }
    }

    [[nodiscard]] std::span<const Corner> of(std::size_t vertex) const {
        return std::span{corners_}.subspan(offsets_[vertex], offsets_[vertex + 1] - offsets_[vertex]);
    }

  private:
    std::vector<std::size_t> offsets_;
    std::vector<Corner> corners_;
};

}  // namespace

MarkerModel marker_model(const Rig& rig, const MarkerLayout& layout) {
    const std::size_t rows = 3 * layout.markers.size();
    const std::size_t shape_count = rig.shapes.size();
    const CornersByVertex corners{layout, rig.vertices_mm.size()};
    std::vector<double> neutral(rows, 0.0);
    std::vector<double> basis(rows * shape_count, 0.0);
    for (std::size_t m = 0; m < layout.markers.size(); ++m) {
        for (std::size_t axis = 0; axis < 3; ++axis)
            neutral[3 * m + axis] = static_cast<double>(layout.markers[m].offset_mm[axis]);
    }
    for (std::size_t v = 0; v < rig.vertices_mm.size(); ++v) {
        for (const Corner& corner : corners.of(v)) {
            for (std::size_t axis = 0; axis < 3; ++axis) {
                neutral[3 * corner.marker + axis] +=
                    static_cast<double>(corner.share) * static_cast<double>(rig.vertices_mm[v][axis]);
            }
        }
    }
    for (std::size_t s = 0; s < shape_count; ++s) {
        const SparseShape& shape = rig.shapes[s];
        for (std::size_t i = 0; i < shape.vertices.size(); ++i) {
            for (const Corner& corner : corners.of(static_cast<std::size_t>(shape.vertices[i]))) {
                for (std::size_t axis = 0; axis < 3; ++axis) {
                    basis[(3 * corner.marker + axis) * shape_count + s] +=
                        static_cast<double>(corner.share) * static_cast<double>(shape.delta_mm[i][axis]);
                }
            }
        }
    }
    return {.neutral_mm = {neutral.begin(), neutral.end()}, .basis_mm = {basis.begin(), basis.end()}};
}

}  // namespace rig::host
