#include "core/points/edge_model/two_plane_model.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <utility>

#include "core/points/edge_model/settings.h"
#include "core/points/height_field.h"
#include "core/points/neighborhood_size.h"
#include "core/points/settings.h"

namespace rilievo {
namespace {

using Eigen::Vector3d;

constexpr int kNeither = 2;  // of no side

struct Neighborhood {
  int count = 0;
  double reach = 0;  // farthest of the points found from the middle
  std::array<Vector3d, kTwoPlaneModel.most_points> at, normal;
  std::array<double, kTwoPlaneModel.most_points> bow;  // half the squared way along the edge
  std::array<int, kTwoPlaneModel.most_points> side;
};

// The points nearest to the middle of an edge, nearest first.
struct Found {
  int count = 0;
  std::array<int, kTwoPlaneModel.most_points> points;
  std::array<double, kTwoPlaneModel.most_points> squared;
};

// Of the first `count` points found.
Neighborhood Gather(const OrientedCloud& cloud, const Found& found, int count,
                    const EdgePlace& place) {
  Neighborhood around;
  around.reach = std::sqrt(found.squared[count - 1]);
  int others = 0;
  for (int i = 0; i < count; ++i) {
    const Vector3d normal = cloud.normals.col(found.points[i]);
    const auto [less, more] =
        std::minmax({normal.dot(place.normal[0]), normal.dot(place.normal[1])});
    if (more < kTwoPlaneModel.nearer_face) {
      // The third side of a corner turns away from both, another sheet faces one of them.
      others += less < kTwoPlaneModel.facing;
      continue;
    }
    const Vector3d at = cloud.points.col(found.points[i]) - place.middle;
    around.at[around.count] = at;
    around.normal[around.count] = normal;
    const double along = place.along.dot(at);
    around.bow[around.count] = along * along / 2;
    around.side[around.count] = at.dot(place.inward[0]) > at.dot(place.inward[1]) ? 0 : 1;
    ++around.count;
  }
  // Across a thin wall there is another crease, whose points would mix with this one's.
  if (others > kTwoPlaneModel.most_of_others * count) around.count = 0;
  return around;
}

// Sums over the points of a side.
struct SideSums {
  int count = 0;
  Vector3d at = Vector3d::Zero(), outward = Vector3d::Zero(), bow_way = Vector3d::Zero();
  double xx = 0, xy = 0, xz = 0, yy = 0, yz = 0, zz = 0;
  double bow = 0, bow_squares = 0;

  void Add(const Vector3d& point, const Vector3d& normal, double point_bow) {
    ++count;
    at += point;
    outward += normal;
    bow_way += point_bow * point;
    xx += point.x() * point.x();
    xy += point.x() * point.y();
    xz += point.x() * point.z();
    yy += point.y() * point.y();
    yz += point.y() * point.z();
    zz += point.z() * point.z();
    bow += point_bow;
    bow_squares += point_bow * point_bow;
  }

  Eigen::Matrix3d Squares() const {
    Eigen::Matrix3d squares;
    squares << xx, xy, xz, xy, yy, yz, xz, yz, zz;
    return squares;
  }
};

// The plane of a side's points, and its curvature along the edge: by turns, as each is linear.
bool FitSide(const SideSums& sums, HingePlane* plane) {
  const int count = sums.count;
  if (count < kTwoPlaneModel.least_side_points) return false;
  const Vector3d mean = sums.at / count;
  const double mean_bow = sums.bow / count;
  const Eigen::Matrix3d squares = sums.Squares() - count * mean * mean.transpose();
  const double bow_squares = sums.bow_squares - count * mean_bow * mean_bow;
  const Vector3d bow_way = sums.bow_way - count * mean_bow * mean;
  plane->curvature = 0;
  for (int round = 0;; ++round) {
    const Vector3d lift = plane->curvature * plane->normal;
    const Eigen::Matrix3d crossed = bow_way * lift.transpose();
    Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver;
    solver.computeDirect(squares - crossed - crossed.transpose() +
                         bow_squares * lift * lift.transpose());
    if (!(solver.eigenvalues()[1] > kTwoPlaneModel.least_width * solver.eigenvalues()[2]))
      return false;
    plane->normal = solver.eigenvectors().col(0);
    if (plane->normal.dot(sums.outward) < 0) plane->normal = -plane->normal;
    if (round == kTwoPlaneModel.bow_rounds) break;
    if (bow_squares > 0) plane->curvature = plane->normal.dot(bow_way) / bow_squares;
  }
  plane->offset = plane->normal.dot(mean) - plane->curvature * mean_bow;
  return true;
}

bool FitSides(const Neighborhood& around, std::array<HingePlane, 2>* planes) {
  std::array<SideSums, 4> sums;  // by Neighborhood::side
  for (int i = 0; i < around.count; ++i) {
    sums[around.side[i]].Add(around.at[i], around.normal[i], around.bow[i]);
  }
  return FitSide(sums[0], &(*planes)[0]) && FitSide(sums[1], &(*planes)[1]);
}

double Off(const HingePlane& side, const Neighborhood& around, int i) {
  return side.normal.dot(around.at[i]) - side.offset - side.curvature * around.bow[i];
}

// To the nearer plane, which finds the sides from a poor guess.
bool Part(Neighborhood* around, std::array<HingePlane, 2>* sides) {
  for (int round = 0; round < kCommon.side_rounds; ++round) {
    if (!FitSides(*around, sides)) return false;
    bool changed = false;
    for (int i = 0; i < around->count; ++i) {
      const auto distance = [&](int k) { return std::abs(Off((*sides)[k], *around, i)); };
      const auto agreement = [&](int k) { return (*sides)[k].normal.dot(around->normal[i]); };
      int side = distance(0) <= distance(1) ? 0 : 1;
      if (std::max(agreement(0), agreement(1)) < kTwoPlaneModel.own_sides) side = kNeither;
      changed |= around->side[i] != side;
      around->side[i] = side;
    }
    if (!changed) return true;
  }
  return FitSides(*around, sides);
}

// Squared distances off the solid that the sides bound: where it is their meet, and their union.
struct SolidSquares {
  double convex = 0, concave = 0;
  double best() const { return std::min(convex, concave); }
};

SolidSquares PlaneSquares(const Neighborhood& around, const std::array<HingePlane, 2>& sides) {
  SolidSquares squares;
  for (int i = 0; i < around.count; ++i) {
    if (around.side[i] == kNeither) continue;
    const double a = Off(sides[0], around, i), b = Off(sides[1], around, i);
    const double more = std::max(a, b), less = std::min(a, b);
    squares.convex += more * more;
    squares.concave += less * less;
  }
  return squares;
}

// How far inside the corner of the sides the points by the edge are in the mean, in standard
// errors. A point's distance to the solid is the larger one of two, so noise about a true corner
// carries the mean outward.
double Bluntness(const Neighborhood& around, const std::array<HingePlane, 2>& sides, bool convex,
                 double spacing, double noise) {
  noise = std::max(noise, kTwoPlaneModel.least_noise_by_edge * spacing);
  double inside = 0;
  int count = 0;
  for (int i = 0; i < around.count; ++i) {
    if (around.side[i] == kNeither) continue;
    const double a = Off(sides[0], around, i), b = Off(sides[1], around, i);
    if (std::max(std::abs(a), std::abs(b)) > spacing + noise) continue;
    inside += convex ? -std::max(a, b) : std::min(a, b);
    ++count;
  }
  return count > 0 ? inside / (noise * std::sqrt(count)) : 0;
}

// Squared residuals of the best quadric height field over `axis`.
double QuadricSquares(const Neighborhood& around, const Vector3d& axis) {
  const Vector3d u = axis.unitOrthogonal(), v = axis.cross(u);
  Eigen::Matrix<double, kQuadricTerms, kQuadricTerms> normal_matrix =
      Eigen::Matrix<double, kQuadricTerms, kQuadricTerms>::Zero();
  Eigen::Matrix<double, kQuadricTerms, 1> right = Eigen::Matrix<double, kQuadricTerms, 1>::Zero();
  double squares = 0;
  const double scale = 1 / around.reach;
  for (int i = 0; i < around.count; ++i) {
    if (around.side[i] == kNeither) continue;
    const double x = scale * u.dot(around.at[i]), y = scale * v.dot(around.at[i]);
    const double height = axis.dot(around.at[i]);
    Eigen::Matrix<double, kQuadricTerms, 1> row;
    row << 1, x, y, x * x, x * y, y * y;
    normal_matrix += row * row.transpose();
    right += height * row;
    squares += height * height;
  }
  return std::max(0.0, squares - right.dot(normal_matrix.ldlt().solve(right)));
}

// Among the first `count` points found.
std::optional<TwoPlaneModel> FitAmong(const OrientedCloud& cloud, const Found& found, int count,
                                      const EdgePlace& place) {
  const int nearest = found.points[0];
  TwoPlaneModel fit;
  fit.spacing = cloud.spacing[nearest];
  fit.middle = place.middle;
  fit.along = place.along;
  Neighborhood around = Gather(cloud, found, count, place);
  if (around.count < 2 * kTwoPlaneModel.least_side_points || !Part(&around, &fit.sides))
    return std::nullopt;
  const Vector3d &a = fit.sides[0].normal, &b = fit.sides[1].normal;
  const Vector3d axis = a + b;
  if (!(a.cross(b).norm() > kTwoPlaneModel.least_sine) || !(axis.norm() > 0.1)) return std::nullopt;
  // Heights over the mean plane shrink the quadric's residuals by what its slope is; both are
  // measured across the planes.
  const double tilt = axis.norm() / 2;
  const double quadric = QuadricSquares(around, axis.normalized()) * tilt * tilt;
  const double least = kTwoPlaneModel.least_scatter * fit.spacing;
  const auto used = static_cast<double>(
      around.count - std::count(around.side.begin(), around.side.begin() + around.count, kNeither));
  const double floor = used * least * least;
  const SolidSquares solid = PlaneSquares(around, fit.sides);
  const double planes = solid.best();
  // Two unknowns more than the quadric has (Schwarz 1978).
  const double roughness = kCommon.noises_off_sides * cloud.noise[nearest] + least;
  if (planes > used * roughness * roughness) return std::nullopt;
  fit.log_likelihood_ratio =
      used * std::log((quadric + floor) / (planes + floor)) - 2 * std::log(used);
  fit.bluntness =
      Bluntness(around, fit.sides, solid.convex < solid.concave, fit.spacing, cloud.noise[nearest]);
  fit.cosine = a.dot(b);
  fit.direction = a.cross(b).normalized();
  // x = alpha a + beta b with a . x and b . x as the planes say.
  const double sine2 = 1 - fit.cosine * fit.cosine;
  const double alpha = (fit.sides[0].offset - fit.cosine * fit.sides[1].offset) / sine2;
  const double beta = (fit.sides[1].offset - fit.cosine * fit.sides[0].offset) / sine2;
  fit.at = place.middle + alpha * a + beta * b;
  for (HingePlane& side : fit.sides) side.offset += side.normal.dot(place.middle);
  return fit;
}

}  // namespace

HingePlane TwoPlaneModel::TangentAt(int side, const Vector3d& place) const {
  const double t = along.dot(place - middle), curvature = sides[side].curvature;
  HingePlane tangent;
  tangent.normal = sides[side].normal - curvature * t * along;
  tangent.offset = sides[side].offset - curvature * t * (along.dot(middle) + t / 2);
  const double length = tangent.normal.norm();
  tangent.normal /= length;
  tangent.offset /= length;
  return tangent;
}

std::optional<TwoPlaneModel> FitTwoPlaneModel(const OrientedCloud& cloud, const PointIndex& index,
                                              const EdgePlace& place) {
  Found found;
  index.Nearest(place.middle, 1, found.points.data(), found.squared.data());
  const int nearest = found.points[0];
  const double noise = cloud.noise[nearest], spacing = cloud.spacing[nearest];
  const int wanted =
      NeighborhoodSize(kCommon.points_by_edge, kTwoPlaneModel.most_points / 2, noise, spacing);
  // Noise asks for more points; without it fewer reach less far past a short edge.
  const int other = noise > kCommon.little_noise * spacing ? 2 * wanted : wanted / 2;
  // One search serves both, for the first neighbourhood seldom says enough.
  found.count = index.Nearest(place.middle, std::max(wanted, other), found.points.data(),
                              found.squared.data());
  std::optional<TwoPlaneModel> best;
  for (const int asked : {wanted, other}) {
    auto fit = FitAmong(cloud, found, std::min(asked, found.count), place);
    if (fit && (!best || fit->log_likelihood_ratio > best->log_likelihood_ratio)) best = fit;
    if (best && best->log_likelihood_ratio > kTwoPlaneModel.enough) break;
  }
  return best;
}

}  // namespace rilievo
