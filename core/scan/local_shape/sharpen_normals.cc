#include "core/scan/local_shape/sharpen_normals.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>
#include <unordered_set>
#include <utility>

#include "core/base/ablation.h"
#include "core/base/parallel_for.h"
#include "core/base/scratch_pool.h"
#include "core/base/status_macros.h"
#include "core/points/height_field.h"
#include "core/points/settings.h"
#include "core/scan/local_shape/settings.h"

namespace rilievo {
namespace {

using Eigen::Vector3d;

// Squared noises from which a point counts no more.
double Beyond() { return kCommon.noise_deviations * kCommon.noise_deviations; }

using Values = Eigen::Array<double, Eigen::Dynamic, 1, 0, kCommon.points_by_edge, 1>;

// Points as seen from the first of them, in its noise.
struct ScaledPatch {
  Values x, y, z;
  Values Along(const Vector3d& axis) const { return axis.x() * x + axis.y() * y + axis.z() * z; }
  ScaledPatch First(Eigen::Index count) const {
    return {x.head(count), y.head(count), z.head(count)};
  }
};

// Weighted sums of the points' coordinates and of their products.
class Moments {
 public:
  Moments(const ScaledPatch& patch, const Values& weights) {
    const Values x = weights * patch.x, y = weights * patch.y, z = weights * patch.z;
    count_ = weights.sum();
    sum_ = {x.sum(), y.sum(), z.sum()};
    const double xy = (x * patch.y).sum(), xz = (x * patch.z).sum(), yz = (y * patch.z).sum();
    products_ << (x * patch.x).sum(), xy, xz, xy, (y * patch.y).sum(), yz, xz, yz,
        (z * patch.z).sum();
  }
  Moments operator-(const Moments& part) const {
    Moments rest = *this;
    rest.count_ -= part.count_;
    rest.sum_ -= part.sum_;
    rest.products_ -= part.products_;
    return rest;
  }
  double count() const { return count_; }
  const Vector3d& sum() const { return sum_; }
  const Eigen::Matrix3d& products() const { return products_; }

 private:
  double count_;
  Vector3d sum_;
  Eigen::Matrix3d products_;
};

// Points p with normal . p = offset.
struct Plane {
  Vector3d normal = Vector3d::UnitZ();
  double offset = 0;
  Values Off(const ScaledPatch& patch) const { return patch.Along(normal) - offset; }
};

// Total least squares; its normal on the side of `up`.
Plane FitPlane(const Moments& moments, const Vector3d& up) {
  if (!(moments.count() > 0)) return {up, 0};
  const Vector3d mean = moments.sum() / moments.count();
  Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes;
  axes.computeDirect(moments.products() - moments.sum() * mean.transpose());
  Vector3d normal = axes.eigenvectors().col(0);
  if (normal.dot(up) < 0) normal = -normal;
  return {normal, normal.dot(mean)};
}

// The quadric of all points over their plane.
struct Quadric {
  Vector3d up;    // normal of the plane
  double cost;    // squares of the points' distances, none above Beyond()
  Values across;  // the points along the axis of the strongest curvature, in their radius
  bool bends_up = false;
};

std::optional<Quadric> FitQuadric(const ScaledPatch& patch) {
  const double radius =
      std::sqrt((patch.x.square() + patch.y.square() + patch.z.square()).maxCoeff());
  if (!(radius > 0)) return std::nullopt;
  const Eigen::Index count = patch.x.size();
  const Vector3d up = FitPlane(Moments(patch, Values::Ones(count)), Vector3d::UnitZ()).normal;
  const Vector3d u = up.unitOrthogonal(), v = up.cross(u);
  const Values x = patch.Along(u) / radius, y = patch.Along(v) / radius;
  const Values z = patch.Along(up) / radius;
  Eigen::Matrix<double, Eigen::Dynamic, 6, 0, kCommon.points_by_edge, 6> rows(count, 6);
  rows << Values::Ones(count), x, y, x * x, x * y, y * y;
  Eigen::Matrix<double, 6, 6> gram = rows.transpose().lazyProduct(rows);
  gram.diagonal().array() += kHeightField.ridge;
  const Eigen::Matrix<double, 6, 1> terms =
      gram.ldlt().solve(rows.transpose().lazyProduct(z.matrix()));
  const double slant = 1 + terms[1] * terms[1] + terms[2] * terms[2];
  const Values off = radius * (z - rows.lazyProduct(terms).array());
  Eigen::Matrix2d hessian;
  hessian << 2 * terms[3], terms[4], terms[4], 2 * terms[5];
  Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> axes;
  axes.computeDirect(hessian);
  const int strongest = std::abs(axes.eigenvalues()[0]) > std::abs(axes.eigenvalues()[1]) ? 0 : 1;
  const Eigen::Vector2d axis = axes.eigenvectors().col(strongest);
  return Quadric{up, (off.square() / slant).min(Beyond()).sum(), axis.x() * x + axis.y() * y,
                 axes.eigenvalues()[strongest] > 0};
}

// Two planes that meet in an edge.
struct Sides {
  double cost = 0;        // as that of a quadric
  Vector3d first_normal;  // of the side on which the first point lies
  Values on_side;         // 1: a point of that side, near its plane
};

// From the points beyond `start` across the bend and those before it.
std::optional<Sides> FitSides(const ScaledPatch& patch, const Quadric& quadric, double start) {
  const Eigen::Index count = patch.x.size();
  const Values ones = Values::Ones(count);
  Values on_one = (quadric.across > start).cast<double>(), weights = ones, squares;
  Plane one, two;
  for (int round = 0; round < kSharpenNormals.rounds; ++round) {
    const Moments all(patch, weights), of_one(patch, weights * on_one);
    one = FitPlane(of_one, quadric.up);
    two = FitPlane(all - of_one, quadric.up);
    // A ridge is the lower of its planes, a valley the higher.
    const Values off_one = one.Off(patch), off_two = two.Off(patch);
    on_one = (quadric.bends_up ? off_one < off_two : off_one > off_two).cast<double>();
    squares = (on_one * off_one + (1 - on_one) * off_two).square().min(Beyond());
    weights = (squares < Beyond()).select(ones, kSharpenNormals.off_weight);
  }
  const double sum = on_one.sum();
  const double cost = squares.sum();
  if (std::min(sum, static_cast<double>(count) - sum) < kSharpenNormals.fewest_of_bend ||
      cost > kSharpenNormals.most_cost * static_cast<double>(count - kQuadricTerms) ||
      one.normal.dot(two.normal) > kCommon.smooth_cosine) {
    return std::nullopt;
  }
  const bool first_on_one = on_one[0] > 0;
  const Values on_side = first_on_one ? on_one : Values(1 - on_one);
  return Sides{cost, first_on_one ? one.normal : two.normal,
               on_side * (squares < Beyond()).cast<double>()};
}

// What two planes save against a quadric, and the side of the first point.
struct Crease {
  double saved = 0;
  Vector3d normal = Vector3d::Zero();
  Values on_side;
};

// None where no two planes save more than `least`: they save no more than the quadric costs.
std::optional<Crease> FindCrease(const ScaledPatch& patch, double least) {
  if (patch.x.size() < kSharpenNormals.fewest_points) return std::nullopt;
  const auto quadric = FitQuadric(patch);
  if (!quadric || quadric->cost <= least) return std::nullopt;
  std::optional<Crease> best;
  for (const double start : {-0.25, 0.25}) {
    const auto sides = FitSides(patch, *quadric, start);
    const double saved = sides ? quadric->cost - sides->cost : 0;
    if (saved <= least) continue;
    best = Crease{saved, sides->first_normal, sides->on_side};
    least = saved;
  }
  return best;
}

// Gathers points along a graph.
class Neighborhood {
 public:
  // The nearest of a point's neighbours and theirs, itself first; lengths in `unit`.
  ScaledPatch Around(const Eigen::Matrix3Xd& points, const NeighborGraph& graph, int center,
                     double unit) {
    around_.assign(1, center);
    std::unordered_set<int> taken = {center};
    for (size_t begin = 0; begin < around_.size() && around_.size() < kSharpenNormals.enough;) {
      for (const size_t end = around_.size(); begin < end; ++begin) {
        for (const int j : graph.neighbors(around_[begin])) {
          if (taken.insert(j).second) around_.push_back(j);
        }
      }
    }
    const Vector3d at = points.col(center);
    nearest_.clear();
    for (const int j : around_) nearest_.emplace_back((points.col(j) - at).squaredNorm(), j);
    const size_t count = std::min<size_t>(kCommon.points_by_edge, nearest_.size());
    std::partial_sort(nearest_.begin(), nearest_.begin() + static_cast<int64_t>(count),
                      nearest_.end());
    ScaledPatch patch{Values(count), Values(count), Values(count)};
    for (size_t i = 0; i < count; ++i) {
      const Vector3d offset = (points.col(nearest_[i].second) - at) / unit;
      patch.x[i] = offset.x();
      patch.y[i] = offset.y();
      patch.z[i] = offset.z();
    }
    return patch;
  }
  // Of `vectors`, one a point, those of the last patch's first points, weighted.
  Vector3d Sum(const Eigen::Matrix3Xd& vectors, const Values& weights) const {
    Vector3d sum = Vector3d::Zero();
    for (Eigen::Index i = 0; i < weights.size(); ++i) {
      sum += weights[i] * vectors.col(nearest_[i].second);
    }
    return sum;
  }

 private:
  std::vector<int> around_;
  std::vector<std::pair<double, int>> nearest_;
};

}  // namespace

absl::Status SharpenNormals(const NeighborGraph& graph, const std::vector<NearEdgePoint>& near_edge,
                            const RunContext& context, OrientedCloud* cloud) {
  if (IsLeftOut(Mechanism::kSharpenNormals)) return absl::OkStatus();
  const Neighborhood prototype;
  ScratchPool<Neighborhood> pool(prototype);
  // Zero: as it was. The old ones are read until all are found.
  Eigen::Matrix3Xd sharp = Eigen::Matrix3Xd::Zero(3, static_cast<Eigen::Index>(near_edge.size()));
  RILIEVO_RETURN_IF_ERROR(
      ParallelFor(sharp.cols(), kHeavyBlock, context, [&](int64_t begin, int64_t end) {
        const auto neighborhood = pool.Take();
        for (int64_t i = begin; i < end; ++i) {
          const auto [point, noise] = near_edge[i];
          const ScaledPatch patch = neighborhood->Around(cloud->points, graph, point, noise);
          const Eigen::Index count = patch.x.size();
          auto best = FindCrease(patch, kCommon.sure_evidence);
          const auto narrow =
              FindCrease(patch.First(count / 2), best ? best->saved : kCommon.sure_evidence);
          if (narrow) best = narrow;
          if (!best) continue;
          const Vector3d sum = neighborhood->Sum(cloud->normals, best->on_side);
          sharp.col(i) = sum.dot(best->normal) < 0 ? Vector3d(-best->normal) : best->normal;
        }
      }));
  for (Eigen::Index i = 0; i < sharp.cols(); ++i) {
    if (!sharp.col(i).isZero(0)) cloud->normals.col(near_edge[i].point) = sharp.col(i);
  }
  return absl::OkStatus();
}

}  // namespace rilievo
