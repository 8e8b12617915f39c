#include "firmware_host/companion/fit/vertex_motion.hpp"

namespace rig::host {

VertexMotion::VertexMotion(const Rig& rig) : rig_(rig), offsets_(rig.vertices_mm.size() + 1, 0) {
    for (const SparseShape& shape : rig.shapes) {
        for (const std::int32_t vertex : shape.vertices) ++offsets_[static_cast<std::size_t>(vertex) + 1];
    }
    for (std::size_t v = 1; v < offsets_.size(); ++v) offsets_[v] += offsets_[v - 1];
    entries_.resize(offsets_.back());
    std::vector<std::size_t> next(offsets_.begin(), offsets_.end() - 1);
    for (std::size_t s = 0; s < rig.shapes.size(); ++s) {
        for (std::size_t i = 0; i < rig.shapes[s].vertices.size(); ++i) {
            const auto vertex = static_cast<std::size_t>(rig.shapes[s].vertices[i]);
            entries_[next[vertex]++] = {s, rig.shapes[s].delta_mm[i]};
        }
    }
}

Eigen::MatrixXd VertexMotion::at(std::size_t vertex) const {
    Eigen::MatrixXd motion = Eigen::MatrixXd::Zero(3, static_cast<Eigen::Index>(rig_.shapes.size()) + 1);
    for (Eigen::Index axis = 0; axis < 3; ++axis) {
        const auto a = static_cast<std::size_t>(axis);
        motion(axis, 0) = static_cast<double>(rig_.vertices_mm[vertex][a]);
        for (std::size_t e = offsets_[vertex]; e < offsets_[vertex + 1]; ++e) {
            motion(axis, static_cast<Eigen::Index>(entries_[e].shape) + 1) +=
                static_cast<double>(entries_[e].delta_mm[a]);
        }
    }
    return motion;
}

}  // namespace rig::host
