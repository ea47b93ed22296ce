#include "core/surface/one_way_distances.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <span>

namespace rilievo {
namespace {

using Eigen::Vector3d;

constexpr size_t kPointsOfSides = 4;  // nearest to a place, that tell the sides around it

using FoundItems = std::span<const ClosestPointTree::Hit>;

// The least distance of `place`, squared, from the planes of the sides that its nearest points
// show; infinite where they show but one.
double SquaredAcrossSides(const Shape& to, const ClosestPointTree& to_tree, FoundItems found,
                          const Vector3d& place) {
  constexpr double kSameSide = 0.866;  // cos 30 degrees
  constexpr double kReach =
      1.0 / 3;  // of a gap: a plane runs on beyond the edge, its side does not
  std::array<Vector3d, kPointsOfSides> sides;
  size_t count = 0;
  double least = std::numeric_limits<double>::infinity();
  for (const ClosestPointTree::Hit& hit : found) {
    const int point = to_tree.source()[hit.item];
    const Vector3d normal = to.normals.col(point);
    const auto same = [&](const Vector3d& side) { return std::abs(side.dot(normal)) > kSameSide; };
    if (std::any_of(sides.begin(), sides.begin() + count, same)) continue;
    sides[count++] = normal;
    least = std::min(least,
                     SquaredAcross(to.vertices.col(point), normal, kReach * to.gaps[point], place));
  }
  return count > 1 ? least : std::numeric_limits<double>::infinity();
}

}  // namespace

double Percentile95(std::vector<double>& distances) {
  const auto place = distances.begin() + static_cast<int64_t>(0.95 * (distances.size() - 1));
  std::nth_element(distances.begin(), place, distances.end());
  return *place;
}

double SquaredAcross(const Vector3d& point, const Vector3d& normal, double reach,
                     const Vector3d& place) {
  const Vector3d offset = place - point;
  const double across = offset.dot(normal);
  const double along = offset.squaredNorm() - across * across;
  return along <= reach * reach ? across * across : offset.squaredNorm();
}

bool IsFilled(const Shape& shape, int face) {
  if (shape.filled.empty()) return false;
  const auto corners = shape.triangles.col(face);
  return std::all_of(corners.begin(), corners.end(), [&](int v) { return shape.filled[v] != 0; });
}

absl::StatusOr<std::vector<double>> SquaredAcrossCloud(
    const Shape& from, const SurfaceSamples& samples, const Shape& to,
    const ClosestPointTree& to_tree, const RunContext& context, std::vector<double>* across) {
  const int64_t count = samples.places.cols();
  const size_t wanted = to.normals.cols() == 0 ? 1 : kPointsOfSides;
  std::vector<double> squared(static_cast<size_t>(count));
  across->assign(squared.size(), 0);
  RILIEVO_RETURN_IF_ERROR(
      ParallelFor(count, kSearchBlock, context, [&](int64_t begin, int64_t end) {
        std::array<ClosestPointTree::Hit, kPointsOfSides> hits;
        size_t found = 0;
        for (int64_t i = begin; i < end; ++i) {
          const auto triangle = from.triangles.col(samples.faces[i]);
          const Vector3d a = from.vertices.col(triangle[0]), place = samples.places.col(i);
          const Vector3d normal =
              (from.vertices.col(triangle[1]) - a).cross(from.vertices.col(triangle[2]) - a);
          found =
              static_cast<size_t>(to_tree.Nearest(place, {hits.data(), wanted}, found == wanted));
          if (found == 0) hits[0] = to_tree.Closest(place);
          squared[i] = hits[0].squared_distance;
          const int nearest = to_tree.source()[hits[0].item];
          double& of_sample = (*across)[i];
          of_sample =
              SquaredAcross(to.vertices.col(nearest), normal.normalized(), to.gaps[nearest], place);
          if (wanted == 1) continue;
          of_sample =
              std::min(of_sample, SquaredAcrossSides(to, to_tree, {hits.data(), found}, place));
        }
      }));
  return squared;
}

}  // namespace rilievo
