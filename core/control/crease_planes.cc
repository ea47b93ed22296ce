#include "core/control/crease_planes.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace rilievo {
namespace {

using Eigen::Vector3d;

// A disc of 3.5 spacings' radius.
constexpr int kFewestPoints = 48;
constexpr int kMostPoints = 192;
constexpr int kLeastSidePoints = 8;
constexpr int kRounds = 4;
// Least cosine of a point's normal and the nearer of the faces'.
constexpr double kSameSheet = 0.2;
// Least ratio of the widths of a side's points, squared: below it they lie on a line.
constexpr double kLeastWidth = 0.03;
// What planes leave of a clean scan's curved sides, in spacings.
constexpr double kLeastScatter = 0.05;

// Most of the points around that may belong to another sheet.
constexpr double kMostOfOthers = 0.1;
// Most cosine of such a point's normal and that of a side that it faces.
constexpr double kFacing = -0.5;

struct Neighborhood {
  int count = 0;
  std::array<Vector3d, kMostPoints> at, normal;
  std::array<int, kMostPoints> side;
};

// More points where they are noisier.
int PointsWanted(const OrientedCloud& cloud, int nearest) {
  const double ratio =
      cloud.spacing[nearest] > 0 ? cloud.noise[nearest] / cloud.spacing[nearest] : 0;
  return static_cast<int>(std::clamp(kFewestPoints * (1 + 12 * ratio * ratio),
                                     double{kFewestPoints}, double{kMostPoints}));
}

Neighborhood Gather(const OrientedCloud& cloud, const PointIndex& index, const EdgePlace& place,
                    double* spacing) {
  std::array<int, kMostPoints> found;
  std::array<double, kMostPoints> squared;
  index.Nearest(place.middle, 1, found.data(), squared.data());
  *spacing = cloud.spacing[found[0]];
  const int wanted = std::min(PointsWanted(cloud, found[0]), index.size());
  const int count = index.Nearest(place.middle, wanted, found.data(), squared.data());
  Neighborhood around;
  int others = 0;
  for (int i = 0; i < count; ++i) {
    const Vector3d normal = cloud.normals.col(found[i]);
    const auto [less, more] =
        std::minmax({normal.dot(place.normal[0]), normal.dot(place.normal[1])});
    if (more < kSameSheet) {
      // The third side of a corner turns away from both, another sheet faces one of them.
      others += less < kFacing;
      continue;
    }
    const Vector3d at = cloud.points.col(found[i]) - place.middle;
    around.at[around.count] = at;
    around.normal[around.count] = normal;
    around.side[around.count] = at.dot(place.inward[0]) > at.dot(place.inward[1]) ? 0 : 1;
    ++around.count;
  }
  // Across a thin wall there is another crease, whose points would mix with this one's.
  if (others > kMostOfOthers * count) around.count = 0;
  return around;
}

bool FitSide(const Neighborhood& around, int which, SidePlane* plane) {
  Vector3d mean = Vector3d::Zero(), outward = Vector3d::Zero();
  int count = 0;
  for (int i = 0; i < around.count; ++i) {
    if (around.side[i] != which) continue;
    mean += around.at[i];
    outward += around.normal[i];
    ++count;
  }
  if (count < kLeastSidePoints) return false;
  mean /= count;
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  for (int i = 0; i < around.count; ++i) {
    if (around.side[i] != which) continue;
    const Vector3d off = around.at[i] - mean;
    covariance += off * off.transpose();
  }
  Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver;
  solver.computeDirect(covariance);
  if (!(solver.eigenvalues()[1] > kLeastWidth * solver.eigenvalues()[2])) return false;
  plane->normal = solver.eigenvectors().col(0);
  if (plane->normal.dot(outward) < 0) plane->normal = -plane->normal;
  plane->offset = plane->normal.dot(mean);
  return true;
}

bool Part(Neighborhood* around, std::array<SidePlane, 2>* sides) {
  for (int round = 0; round < kRounds; ++round) {
    for (int k = 0; k < 2; ++k) {
      if (!FitSide(*around, k, &(*sides)[k])) return false;
    }
    bool changed = false;
    for (int i = 0; i < around->count; ++i) {
      const auto distance = [&](int k) {
        return std::abs((*sides)[k].normal.dot(around->at[i]) - (*sides)[k].offset);
      };
      const int side = distance(0) <= distance(1) ? 0 : 1;
      changed |= around->side[i] != side;
      around->side[i] = side;
    }
    if (!changed) return true;
  }
  return FitSide(*around, 0, &(*sides)[0]) && FitSide(*around, 1, &(*sides)[1]);
}

// Squared distances off the solid that the sides bound, the better of their meet and their union.
double PlaneSquares(const Neighborhood& around, const std::array<SidePlane, 2>& sides) {
  double convex = 0, concave = 0;
  for (int i = 0; i < around.count; ++i) {
    const double a = sides[0].normal.dot(around.at[i]) - sides[0].offset;
    const double b = sides[1].normal.dot(around.at[i]) - sides[1].offset;
    convex += std::pow(std::max(a, b), 2);
    concave += std::pow(std::min(a, b), 2);
  }
  return std::min(convex, concave);
}

// Squared residuals of the best quadric height field over `axis`.
double QuadricSquares(const Neighborhood& around, const Vector3d& axis) {
  constexpr int kTerms = 6;
  const Vector3d u = axis.unitOrthogonal(), v = axis.cross(u);
  Eigen::Matrix<double, kTerms, kTerms> normal_matrix =
      Eigen::Matrix<double, kTerms, kTerms>::Zero();
  Eigen::Matrix<double, kTerms, 1> right = Eigen::Matrix<double, kTerms, 1>::Zero();
  double squares = 0;
  const double scale = 1 / around.at[around.count - 1].norm();
  for (int i = 0; i < around.count; ++i) {
    const double x = scale * u.dot(around.at[i]), y = scale * v.dot(around.at[i]);
    const double height = axis.dot(around.at[i]);
    Eigen::Matrix<double, kTerms, 1> row;
    row << 1, x, y, x * x, x * y, y * y;
    normal_matrix += row * row.transpose();
    right += height * row;
    squares += height * height;
  }
  return std::max(0.0, squares - right.dot(normal_matrix.ldlt().solve(right)));
}

}  // namespace

std::optional<CreasePlanes> FitCreasePlanes(const OrientedCloud& cloud, const PointIndex& index,
                                            const EdgePlace& place) {
  CreasePlanes fit;
  Neighborhood around = Gather(cloud, index, place, &fit.spacing);
  if (around.count < 2 * kLeastSidePoints || !Part(&around, &fit.sides)) return std::nullopt;
  const Vector3d &a = fit.sides[0].normal, &b = fit.sides[1].normal;
  fit.cosine = a.dot(b);
  const Vector3d line = a.cross(b);
  const Vector3d axis = a + b;
  if (!(line.norm() > 0.05) || !(axis.norm() > 0.1)) return std::nullopt;
  fit.direction = line.normalized();
  // Heights over the mean plane shrink the quadric's residuals by what its slope is; both are
  // measured across the planes.
  const double tilt = axis.norm() / 2;
  const double quadric = QuadricSquares(around, axis.normalized()) * tilt * tilt;
  const double least = kLeastScatter * fit.spacing;
  const double floor = around.count * least * least;
  const double planes = PlaneSquares(around, fit.sides);
  fit.evidence = around.count * std::log((quadric + floor) / (planes + floor));
  // x = alpha a + beta b with a . x and b . x as the planes say.
  const double sine2 = 1 - fit.cosine * fit.cosine;
  const double alpha = (fit.sides[0].offset - fit.cosine * fit.sides[1].offset) / sine2;
  const double beta = (fit.sides[1].offset - fit.cosine * fit.sides[0].offset) / sine2;
  fit.at = place.middle + alpha * a + beta * b;
  for (SidePlane& side : fit.sides) side.offset += side.normal.dot(place.middle);
  return fit;
}

}  // namespace rilievo
