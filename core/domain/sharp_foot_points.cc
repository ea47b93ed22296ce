#include "core/domain/sharp_foot_points.h"

#include <Eigen/Eigenvalues>
#include <cmath>
#include <vector>

#include "core/base/ablation.h"
#include "core/domain/cloud_assignment.h"
#include "core/domain/settings.h"

namespace rilievo {
namespace {

using Eigen::Vector3d;

struct SideSum {
  double offset = 0, weight = 0;
};

}  // namespace

SideAxes AxesOfSides(const DomainSamples& samples, const SampledSurface& surface, int sample) {
  const int slot = samples.sharp_slot[static_cast<size_t>(sample)];
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  for (int side = samples.side_begin[slot]; side < samples.side_begin[slot + 1]; ++side) {
    const Vector3d normal = surface.side_normals.col(side);
    sum += normal * normal.transpose();
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(sum);
  return {solver.eigenvectors().rowwise().reverse(), solver.eigenvalues().reverse()};
}

std::optional<SharpFootPoint> FindSharpFootPoint(const OrientedCloud& cloud,
                                                 std::span<const int> points,
                                                 const DomainSamples& samples,
                                                 const SampledSurface& surface, int sample) {
  if (IsLeftOut(Mechanism::kSharpFootPoints)) return std::nullopt;
  const int slot = samples.sharp_slot[static_cast<size_t>(sample)];
  const int first = samples.side_begin[slot], sides = samples.side_begin[slot + 1] - first;
  const Vector3d position = surface.positions.col(sample);
  std::vector<SideSum> sums(static_cast<size_t>(sides));
  SharpFootPoint foot;
  int counted = 0;
  for (int point : points) {
    const Vector3d normal = cloud.normals.col(point);
    int best = 0;
    double agreement = -2;
    for (int k = 0; k < sides; ++k) {
      const double cosine = normal.dot(surface.side_normals.col(first + k));
      if (cosine > agreement) {
        agreement = cosine;
        best = k;
      }
    }
    if (agreement < kSharpFootPoints.own_side) continue;
    const Vector3d way = cloud.points.col(point) - position;
    const double spacing = cloud.spacing[static_cast<size_t>(point)];
    const double offset = HalfwayNormal(normal, surface.side_normals.col(first + best)).dot(way);
    const double aside2 = std::max(0.0, way.squaredNorm() - offset * offset);
    const double reach = kSharpFootPoints.reach_spacings * spacing;
    // Normals estimated across the edge lean: the less a point's own leans, the more it counts.
    const double weight = std::exp(-aside2 / (2 * reach * reach)) * std::pow(agreement, 8);
    sums[static_cast<size_t>(best)].offset += weight * offset;
    sums[static_cast<size_t>(best)].weight += weight;
    foot.spacing += spacing;
    ++counted;
  }
  Vector3d right = Vector3d::Zero();
  Eigen::Matrix3d matrix = Eigen::Matrix3d::Zero();
  int seen = 0;
  for (int k = 0; k < sides; ++k) {
    const SideSum& sum = sums[static_cast<size_t>(k)];
    if (!(sum.weight > 1e-3)) continue;
    const Vector3d normal = surface.side_normals.col(first + k);
    right += sum.offset / sum.weight * normal;
    matrix += normal * normal.transpose();
    ++seen;
  }
  if (seen < 2) return std::nullopt;
  foot.spacing /= counted;
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(matrix);
  foot.move.setZero();
  for (int k = 0; k < 3; ++k) {
    if (solver.eigenvalues()[k] < kSharpFootPoints.least_strength) continue;
    const Vector3d axis = solver.eigenvectors().col(k);
    foot.move += axis.dot(right) / solver.eigenvalues()[k] * axis;
  }
  foot.sides = AxesOfSides(samples, surface, sample);
  return foot;
}

}  // namespace rilievo
