#include "core/surface/nearest_of_parts.h"

#include <algorithm>
#include <cstdint>
#include <limits>

#include "core/base/status_macros.h"
#include "core/surface/one_way_distances.h"

namespace rilievo {

Eigen::AlignedBox3d BoxOfShape(const Shape& shape) {
  Eigen::AlignedBox3d box;
  for (const auto vertex : shape.vertices.colwise()) box.extend(vertex);
  return box;
}

absl::Status NearestOfParts::Ask(const Shape& part, double reach, const RunContext& context) {
  const Eigen::AlignedBox3d box = BoxOfShape(part);
  std::vector<int64_t> asking;
  for (int64_t i = 0; i < points_.cols(); ++i) {
    const double away = box.squaredExteriorDistance(points_.col(i));
    if (away <= reach * reach && away < squared_[i]) asking.push_back(i);
  }
  if (asking.empty()) return absl::OkStatus();
  RILIEVO_ASSIGN_OR_RETURN(
      const ClosestPointTree tree,
      ClosestPointTree::Over(part.vertices, part.triangles, context, part.children_per_face));
  RILIEVO_ASSIGN_OR_RETURN(
      const std::vector<double> found,
      SquaredDistances(
          static_cast<int64_t>(asking.size()),
          [&](int64_t i) -> Eigen::Vector3d { return points_.col(asking[i]); }, tree, context));
  for (size_t i = 0; i < found.size(); ++i) {
    squared_[asking[i]] = std::min(squared_[asking[i]], found[i]);
  }
  return absl::OkStatus();
}

absl::Status NearestOfParts::AskFarParts(const SurfaceParts& surface,
                                         const std::vector<Eigen::AlignedBox3d>& boxes,
                                         const RunContext& context) {
  for (int i = 0; i < surface.count; ++i) {
    if (!MayBeNearer(boxes[i])) continue;
    RILIEVO_ASSIGN_OR_RETURN(const PartTriangles part, surface.triangles(i, context));
    RILIEVO_RETURN_IF_ERROR(Ask(part.shape, std::numeric_limits<double>::max(), context));
  }
  return absl::OkStatus();
}

bool NearestOfParts::MayBeNearer(const Eigen::AlignedBox3d& box) const {
  constexpr double kSquaredNear = kNearPart * kNearPart;
  for (int64_t i = 0; i < points_.cols(); ++i) {
    if (squared_[i] <= kSquaredNear) continue;
    const double away = box.squaredExteriorDistance(points_.col(i));
    if (away > kSquaredNear && away < squared_[i]) return true;
  }
  return false;
}

}  // namespace rilievo
