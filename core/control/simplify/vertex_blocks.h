// Parts of a mesh that several threads may change side by side.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/control/simplify/half_edge_mesh.h"

namespace rilievo {

struct VertexBlocks {
  std::vector<int> order;      // vertices, block after block
  std::vector<int> begin;      // block k is order[begin[k]] .. order[begin[k + 1] - 1]
  std::vector<int> block_of;   // per vertex
  std::vector<uint8_t> inner;  // per vertex: 1 where it and its neighbours are of one block
  int count() const { return static_cast<int>(begin.size()) - 1; }
};

// Stretches of about `block_size` ([1, inf)) vertices of the Morton curve through their bounding
// cube. As long as only edges between inner vertices of a block are collapsed, its inner vertices
// stay inner, and no other block sees anything change. CANCELLED when stopped.
absl::StatusOr<VertexBlocks> CutIntoBlocks(const HalfEdgeMesh& mesh,
                                           const Eigen::Matrix3Xd& vertices, int block_size,
                                           const RunContext& context);

}  // namespace rilievo
