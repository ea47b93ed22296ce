#include "client/formats/carried_layers.h"

#include <vector>

#include "absl/strings/str_cat.h"
#include "core/base/parallel_for.h"
#include "core/base/status_macros.h"
#include "core/surface/closest_point_tree.h"

namespace rilievo {
namespace {

constexpr int64_t kVertexBlock = 1024;

// Numbers of the points whose coordinates are finite.
std::vector<int> FinitePoints(const Eigen::Matrix3Xd& points) {
  std::vector<int> finite;
  for (Eigen::Index i = 0; i < points.cols(); ++i) {
    if (points.col(i).allFinite()) finite.push_back(static_cast<int>(i));
  }
  return finite;
}

// The number of the point nearest to each vertex.
absl::StatusOr<std::vector<int>> Nearest(const Eigen::Matrix3Xd& vertices,
                                         const Eigen::Matrix3Xd& points,
                                         const RunContext& context) {
  const std::vector<int> finite = FinitePoints(points);
  if (finite.empty()) return absl::InvalidArgumentError("no point of the scan is finite");
  const Eigen::Matrix3Xd sound = points(Eigen::all, finite);
  RILIEVO_ASSIGN_OR_RETURN(const ClosestPointTree tree,
                           ClosestPointTree::Build(sound, Eigen::Matrix3Xi(), context));
  std::vector<int> nearest(static_cast<size_t>(vertices.cols()));
  RILIEVO_RETURN_IF_ERROR(
      ParallelFor(vertices.cols(), kVertexBlock, context, [&](int64_t begin, int64_t end) {
        int hint = -1;
        for (int64_t v = begin; v < end; ++v) {
          hint = tree.Closest(vertices.col(v), hint).item;
          nearest[static_cast<size_t>(v)] = finite[tree.source()[hint]];
        }
      }));
  return nearest;
}

}  // namespace

absl::StatusOr<PointLayers> LayersAt(const Eigen::Matrix3Xd& vertices, const ScanFile& scan,
                                     const RunContext& context) {
  const PointLayers& given = scan.layers;
  const std::vector<Rgb>& colors = scan.cloud.sights.colors;
  if (colors.empty() && given.intensity.empty()) {
    return absl::InvalidArgumentError(
        absl::StrCat("this scan (", scan.format, ") has neither colours nor intensity"));
  }
  RILIEVO_ASSIGN_OR_RETURN(const std::vector<int> nearest,
                           Nearest(vertices, scan.cloud.points, context));
  PointLayers layers;
  for (const int point : nearest) {
    if (!colors.empty()) layers.colors.push_back(colors[static_cast<size_t>(point)]);
    if (!given.intensity.empty()) {
      layers.intensity.push_back(given.intensity[static_cast<size_t>(point)]);
    }
  }
  return layers;
}

}  // namespace rilievo
