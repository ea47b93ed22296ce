#include "core/surface/error_at_vertices.h"

#include <cmath>
#include <limits>

#include "core/base/parallel_for.h"
#include "core/base/status_macros.h"
#include "core/surface/closest_point_tree.h"

namespace rilievo {

absl::StatusOr<VertexErrors> ErrorAtVertices(const TriangleMesh& mesh,
                                             const Eigen::Matrix3Xd& points,
                                             const RunContext& context) {
  if (mesh.triangles.cols() == 0) {
    return absl::InvalidArgumentError("the error is that of a surface; the input has points only");
  }
  RILIEVO_ASSIGN_OR_RETURN(const ClosestPointTree tree,
                           ClosestPointTree::Over(mesh.vertices, mesh.triangles, context));
  std::vector<ClosestPointTree::Hit> hits(static_cast<size_t>(points.cols()), {0, -1});
  RILIEVO_RETURN_IF_ERROR(
      ParallelFor(points.cols(), kSearchBlock, context, [&](int64_t begin, int64_t end) {
        int hint = -1;
        for (int64_t i = begin; i < end; ++i) {
          if (!points.col(i).allFinite()) continue;
          hits[static_cast<size_t>(i)] = tree.Closest(points.col(i), hint);
          hint = hits[static_cast<size_t>(i)].item;
        }
      }));
  // Summed in the order of the points, so that the threads do not matter.
  std::vector<double> sums(static_cast<size_t>(mesh.vertices.cols()));
  std::vector<int64_t> counts(sums.size());
  double sum = 0;
  int64_t measured = 0;
  for (const ClosestPointTree::Hit& hit : hits) {
    if (hit.item < 0) continue;
    sum += hit.squared_distance;
    ++measured;
    for (int k = 0; k < 3; ++k) {
      const auto vertex =
          static_cast<size_t>(mesh.triangles(k, tree.source()[static_cast<size_t>(hit.item)]));
      sums[vertex] += hit.squared_distance;
      ++counts[vertex];
    }
  }
  VertexErrors errors;
  errors.rms = measured > 0 ? std::sqrt(sum / static_cast<double>(measured)) : 0;
  errors.at_vertex.assign(sums.size(), std::numeric_limits<float>::quiet_NaN());
  for (size_t v = 0; v < sums.size(); ++v) {
    if (counts[v] == 0) continue;
    errors.at_vertex[v] = static_cast<float>(std::sqrt(sums[v] / static_cast<double>(counts[v])));
  }
  return errors;
}

}  // namespace rilievo
