// How each vertex of a head moves with the weights: the rows of the head's own shape matrix, found by vertex
// instead of by shape.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

#include "firmware_host/companion/rig_folder/rig_folder.hpp"

namespace rig::host {

class VertexMotion {
  public:
    explicit VertexMotion(const Rig& rig);

    // A [3 x (N + 1)]: the vertex is at A [1; w], mm.
    [[nodiscard]] Eigen::MatrixXd at(std::size_t vertex) const;

  private:
    struct Entry {
        std::size_t shape;
        Float3 delta_mm;
    };
    const Rig& rig_;
    std::vector<std::size_t> offsets_;  // entries of vertex v: [offsets_[v], offsets_[v + 1])
    std::vector<Entry> entries_;
};

}  // namespace rig::host
