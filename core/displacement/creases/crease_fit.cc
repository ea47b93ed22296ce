#include "core/displacement/creases/crease_fit.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>

#include "core/base/ablation.h"
#include "core/displacement/local_fit/normal_equations.h"

namespace rilievo {
namespace {

constexpr int kMostPlanes = 3;
constexpr int kLeastPlanePoints = 4;
constexpr int kRounds = 4;
// The planes' residual must be below this share of the quadric's.
constexpr float kResidualShare = 0.6f;
// Planes that meet at less than this angle are one surface: 1 - cos(4 degrees).
constexpr float kLeastTurn = 0.0024f;
// A plane steeper than this against the ray says nothing of the height.
constexpr float kLeastRayAgreement = 0.05f;
// How far beyond the heights of the points an apex may stand, in spacings.
constexpr float kApexSpacings = 0.75f;

using Vector3 = Eigen::Vector3f;

struct Plane {
  Vector3 normal;
  float offset;
};

using Values = std::array<float, kMostCreasePoints>;  // one a point

// Three coordinates of each point. Products with a vector run over the points, so on registers as
// wide as there are; their terms are added up as Eigen's dot() does.
struct Vectors {
  alignas(16) std::array<Values, 3> axes;
  Vector3 operator[](int i) const { return {axes[0][i], axes[1][i], axes[2][i]}; }
  void Set(int i, const Vector3& value) {
    for (int k = 0; k < 3; ++k) axes[k][i] = value[k];
  }
  void Dot(const Vector3& with, int count, Values* products) const {
    for (int i = 0; i < count; ++i) {
      (*products)[i] = axes[0][i] * with[0] + (axes[1][i] * with[1] + axes[2][i] * with[2]);
    }
  }
};

// The points in the frame of the ray, in units of the local spacing.
struct Sample {
  int count = 0;
  Vectors at, normal;
  std::array<int, kMostCreasePoints> plane{};
};

Sample InRayFrame(std::span<const QueuedPoint> queue, const RayCloud& cloud, const Ray& ray,
                  float scale) {
  Sample sample;
  sample.count = std::min(kMostCreasePoints, static_cast<int>(queue.size()));
  for (int i = 0; i < sample.count; ++i) {
    sample.at.Set(i, Vector3(queue[i].u, queue[i].v, queue[i].height) * scale);
    const Eigen::Map<const Vector3> normal(cloud.points[queue[i].point].normal);
    sample.normal.Set(i, {normal.dot(ray.u), normal.dot(ray.v), normal.dot(ray.direction)});
  }
  return sample;
}

// Seeds far apart among the normals, then means of the points nearest to each.
bool PartByNormals(int planes, Sample* sample) {
  const int count = sample->count;
  std::array<Vector3, kMostPlanes> seeds;
  std::array<Values, kMostPlanes> agreement;  // with each seed
  seeds[0] = sample->normal[0];
  for (int k = 0; k < planes; ++k) {
    const int others = std::max(k, 1);
    sample->normal.Dot(seeds[others - 1], count, &agreement[others - 1]);
    float farthest = 2;
    int seed = 0;
    for (int i = 0; i < count; ++i) {
      float nearest = -2;
      for (int other = 0; other < others; ++other) {
        nearest = std::max(nearest, agreement[other][i]);
      }
      if (nearest < farthest) {
        farthest = nearest;
        seed = i;
      }
    }
    if (k > 0 && 1 - farthest < kLeastTurn) return false;
    seeds[k] = sample->normal[seed];
  }
  for (int round = 0; round < kRounds; ++round) {
    for (int k = 0; k < planes; ++k) sample->normal.Dot(seeds[k], count, &agreement[k]);
    std::array<Vector3, kMostPlanes> sums;
    sums.fill(Vector3::Zero());
    bool changed = round == 0;
    for (int i = 0; i < count; ++i) {
      int best = 0;
      for (int k = 1; k < planes; ++k) {
        if (agreement[k][i] > agreement[best][i]) best = k;
      }
      changed |= sample->plane[i] != best;
      sample->plane[i] = best;
      sums[best] += sample->normal[i];
    }
    if (!changed) break;
    for (int k = 0; k < planes; ++k) {
      if (sums[k].squaredNorm() > 0) seeds[k] = sums[k].normalized();
    }
  }
  return true;
}

// Total least squares over the points of one plane, outward as their normals say.
bool FitPlane(const Sample& sample, int which, Plane* plane) {
  std::array<int, kMostCreasePoints> members;
  int count = 0;
  for (int i = 0; i < sample.count; ++i) {
    members[count] = i;
    count += sample.plane[i] == which ? 1 : 0;
  }
  if (count < kLeastPlanePoints) return false;
  Vector3 mean = Vector3::Zero(), outward = Vector3::Zero();
  for (int m = 0; m < count; ++m) {
    mean += sample.at[members[m]];
    outward += sample.normal[members[m]];
  }
  mean /= static_cast<float>(count);
  Eigen::Matrix3f covariance = Eigen::Matrix3f::Zero();
  for (int m = 0; m < count; ++m) {
    const Vector3 off = sample.at[members[m]] - mean;
    covariance += off * off.transpose();
  }
  Eigen::SelfAdjointEigenSolver<Eigen::Matrix3f> solver;
  solver.computeDirect(covariance);
  constexpr float kLeastWidth = 0.02f;  // of the points' spread; below it they lie on a line
  if (!(solver.eigenvalues()[1] > kLeastWidth * solver.eigenvalues()[2])) return false;
  plane->normal = solver.eigenvectors().col(0);
  if (plane->normal.dot(outward) < 0) plane->normal = -plane->normal;
  plane->offset = plane->normal.dot(mean);
  return true;
}

// Of the distances to each plane.
using Distances = std::array<Values, kMostPlanes>;

// Sum over the points of the squared distance off the solid that the planes bound: their
// intersection or their union.
float SumSquares(const Distances& distances, int planes, bool convex, int count) {
  float sum = 0;
  for (int i = 0; i < count; ++i) {
    float distance = distances[0][i];
    for (int k = 1; k < planes; ++k) {
      distance = convex ? std::max(distance, distances[k][i]) : std::min(distance, distances[k][i]);
    }
    sum += distance * distance;
  }
  return sum;
}

// Squared residuals of one quadric height(u, v), seen along its own mean normal.
float QuadricSquares(const Sample& sample) {
  constexpr int kTerms = 6;
  Vector3 axis = Vector3::Zero();
  for (int i = 0; i < sample.count; ++i) axis += sample.normal[i];
  axis.normalize();
  const Vector3 across = axis.unitOrthogonal(), along = axis.cross(across);
  NormalEquations<kTerms> equations;
  equations.matrix.setZero();
  equations.solution.setZero();
  double squares = 0;
  for (int i = 0; i < sample.count; ++i) {
    const double u = across.dot(sample.at[i]), v = along.dot(sample.at[i]);
    const double h = axis.dot(sample.at[i]);
    const double basis[kTerms] = {1, u, v, u * u, u * v, v * v};
    for (int a = 0; a < kTerms; ++a) {
      equations.solution[a] += basis[a] * h;
      for (int b = 0; b <= a; ++b) equations.matrix(a, b) += basis[a] * basis[b];
    }
    squares += h * h;
  }
  const auto right_side = equations.solution;
  if (!equations.Solve()) return 0;
  return static_cast<float>(std::max(0.0, squares - equations.solution.dot(right_side)));
}

// Where the ray, the third axis, leaves the solid.
std::optional<float> Exit(const std::array<Plane, kMostPlanes>& planes, int count, bool convex) {
  std::optional<float> height;
  for (int k = 0; k < count; ++k) {
    const float agreement = planes[k].normal[2];
    if (agreement < kLeastRayAgreement) {
      if (convex) continue;  // bounds the solid from below
      return std::nullopt;
    }
    const float at = planes[k].offset / agreement;
    if (!height) {
      height = at;
    } else {
      height = convex ? std::min(*height, at) : std::max(*height, at);
    }
  }
  return height;
}

std::optional<float> FitPlanes(int planes, Sample* sample, float most_squares, float* squares) {
  if (!PartByNormals(planes, sample)) return std::nullopt;
  const int count = sample->count;
  std::array<Plane, kMostPlanes> fitted;
  Distances distances;
  std::array<bool, kMostPlanes> changed;  // the points of each plane
  changed.fill(true);
  for (int round = 0; round < kRounds; ++round) {
    for (int k = 0; k < planes; ++k) {
      if (!changed[k]) continue;
      if (!FitPlane(*sample, k, &fitted[k])) return std::nullopt;
      sample->at.Dot(fitted[k].normal, count, &distances[k]);
      for (int i = 0; i < count; ++i) distances[k][i] -= fitted[k].offset;
    }
    changed.fill(false);
    bool any = false;
    for (int i = 0; i < count; ++i) {
      int best = 0;
      for (int k = 1; k < planes; ++k) {
        if (std::abs(distances[k][i]) < std::abs(distances[best][i])) best = k;
      }
      const int before = sample->plane[i];
      if (before == best) continue;
      changed[before] = changed[best] = any = true;
      sample->plane[i] = best;
    }
    if (!any) break;
  }
  for (int k = 1; k < planes; ++k) {
    if (1 - fitted[k].normal.dot(fitted[k - 1].normal) < kLeastTurn) return std::nullopt;
  }
  const float convex_squares = SumSquares(distances, planes, true, count);
  const float concave_squares = SumSquares(distances, planes, false, count);
  const bool convex = convex_squares < concave_squares;
  *squares = convex ? convex_squares : concave_squares;
  if (!(*squares < most_squares)) return std::nullopt;
  return Exit(fitted, planes, convex);
}

}  // namespace

std::optional<CreaseFit> FitCrease(std::span<const QueuedPoint> queue, const RayCloud& cloud,
                                   const Ray& ray, float noise) {
  if (IsLeftOut(Mechanism::kCreaseFit)) return std::nullopt;
  const int kLeastPoints = 2 * kLeastPlanePoints + 2;
  if (static_cast<int>(queue.size()) < kLeastPoints) return std::nullopt;
  const float spacing = cloud.points[queue[0].point].spacing;
  if (!(spacing > 0)) return std::nullopt;
  Sample sample = InRayFrame(queue, cloud, ray, 1 / spacing);
  const float scatter = noise / spacing;
  const float quadric = QuadricSquares(sample);
  // What noise alone leaves in either model is no reason to prefer one.
  const float most = kResidualShare * kResidualShare * quadric;
  if (!(quadric > 2 * scatter * scatter * sample.count)) return std::nullopt;
  float lowest = sample.at[0][2], highest = lowest;
  for (int i = 0; i < sample.count; ++i) {
    lowest = std::min(lowest, sample.at[i][2]);
    highest = std::max(highest, sample.at[i][2]);
  }
  for (int planes = 2; planes <= kMostPlanes; ++planes) {
    float squares = 0;
    const auto height = FitPlanes(planes, &sample, most, &squares);
    if (!height) continue;
    if (*height < lowest - kApexSpacings || *height > highest + kApexSpacings) continue;
    return CreaseFit{*height * spacing, std::sqrt(squares) / sample.count * spacing};
  }
  return std::nullopt;
}

}  // namespace rilievo
