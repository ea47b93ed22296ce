#include "core/control/simplify/vertex_blocks.h"

#include <algorithm>
#include <utility>

#include "core/base/parallel_for.h"
#include "core/base/status_macros.h"
#include "core/points/morton_order.h"

namespace rilievo {

absl::StatusOr<VertexBlocks> CutIntoBlocks(const HalfEdgeMesh& mesh,
                                           const Eigen::Matrix3Xd& vertices, int block_size,
                                           const RunContext& context) {
  const int64_t count = vertices.cols();
  VertexBlocks blocks;
  if (count == 0) {
    blocks.begin = {0};
    return blocks;
  }
  const Eigen::Vector3d low = vertices.rowwise().minCoeff(), high = vertices.rowwise().maxCoeff();
  const double extent = (high - low).maxCoeff();
  const double scale = extent > 0 ? 1 / extent : 0;
  RILIEVO_ASSIGN_OR_RETURN(
      MortonOrder morton,
      ComputeMortonOrder(scale * (vertices.colwise() - (low + high) / 2), context));
  blocks.order = std::move(morton.order);
  blocks.block_of.resize(count);
  blocks.inner.resize(count);
  for (int64_t begin = 0; begin < count; begin += block_size) {
    blocks.begin.push_back(static_cast<int>(begin));
  }
  blocks.begin.push_back(static_cast<int>(count));
  for (int64_t place = 0; place < count; ++place) {
    blocks.block_of[blocks.order[place]] = static_cast<int>(place / block_size);
  }
  RILIEVO_RETURN_IF_ERROR(ParallelFor(count, block_size, context, [&](int64_t begin, int64_t end) {
    for (int v = static_cast<int>(begin); v < end; ++v) {
      bool inner = mesh.Outgoing(v) >= 0;
      if (inner) {
        mesh.ForEachNeighbor(
            v, [&](int w, int) { inner = inner && blocks.block_of[w] == blocks.block_of[v]; });
      }
      blocks.inner[v] = inner ? 1 : 0;
    }
  }));
  return blocks;
}

}  // namespace rilievo
