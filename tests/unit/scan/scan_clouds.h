// Clouds with known normals for the tests of the scan stages.
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <numeric>
#include <utility>
#include <vector>

#include "core/geometry/point_cloud.h"
#include "core/points/neighbor_graph.h"
#include "core/points/oriented_cloud.h"
#include "core/scan/clean/check_scan.h"
#include "core/scan/local_shape/estimate_normals.h"
#include "core/scan/orientation/orient_normals.h"
#include "tests/scans/random.h"

namespace rilievo {

struct KnownCloud {
  PointCloud cloud;
  Eigen::Matrix3Xd normals;  // true, outward
};

inline KnownCloud Concatenate(const KnownCloud& a, const KnownCloud& b) {
  KnownCloud both;
  both.cloud.points.resize(3, a.cloud.points.cols() + b.cloud.points.cols());
  both.cloud.points << a.cloud.points, b.cloud.points;
  both.normals.resize(3, a.normals.cols() + b.normals.cols());
  both.normals << a.normals, b.normals;
  return both;
}

inline Eigen::Vector3d RandomDirection(Random* random) {
  const double z = random->Uniform(-1, 1);
  const double angle = random->Uniform(0, 2 * std::numbers::pi);
  const double r = std::sqrt(1 - z * z);
  return {r * std::cos(angle), r * std::sin(angle), z};
}

// `noise`: standard deviation in each coordinate, unit of the shape.
inline void AddNoise(double noise, uint64_t seed, KnownCloud* known) {
  Random random(seed, 99);
  for (double& value : known->cloud.points.reshaped()) value += noise * random.Normal();
}

inline KnownCloud SphereCloud(int count, uint64_t seed, double radius = 1,
                              const Eigen::Vector3d& center = Eigen::Vector3d::Zero()) {
  Random random(seed);
  KnownCloud known{{Eigen::Matrix3Xd(3, count)}, Eigen::Matrix3Xd(3, count)};
  for (int i = 0; i < count; ++i) {
    known.normals.col(i) = RandomDirection(&random);
    known.cloud.points.col(i) = center + radius * known.normals.col(i);
  }
  return known;
}

inline KnownCloud TorusCloud(int count, uint64_t seed, double ring = 1, double tube = 0.35) {
  Random random(seed);
  KnownCloud known{{Eigen::Matrix3Xd(3, count)}, Eigen::Matrix3Xd(3, count)};
  for (int i = 0; i < count;) {
    const double u = random.Uniform(0, 2 * std::numbers::pi);
    const double v = random.Uniform(0, 2 * std::numbers::pi);
    if (random.Uniform() * (ring + tube) > ring + tube * std::cos(v)) continue;  // even by area
    const Eigen::Vector3d outward(std::cos(u) * std::cos(v), std::sin(u) * std::cos(v),
                                  std::sin(v));
    known.normals.col(i) = outward;
    known.cloud.points.col(i) =
        Eigen::Vector3d(ring * std::cos(u), ring * std::sin(u), 0) + tube * outward;
    ++i;
  }
  return known;
}

// Axis-parallel box around the origin, even by area; thin ones are plates.
inline KnownCloud BoxCloud(int count, uint64_t seed, const Eigen::Vector3d& size) {
  Random random(seed);
  const double areas[3] = {size.y() * size.z(), size.x() * size.z(), size.x() * size.y()};
  const double total = areas[0] + areas[1] + areas[2];
  KnownCloud known{{Eigen::Matrix3Xd(3, count)}, Eigen::Matrix3Xd::Zero(3, count)};
  for (int i = 0; i < count; ++i) {
    double pick = random.Uniform() * total;
    int axis = 0;
    while (axis < 2 && pick >= areas[axis]) pick -= areas[axis++];
    const double side = random.Uniform() < 0.5 ? -1 : 1;
    for (int k = 0; k < 3; ++k) {
      known.cloud.points(k, i) = size[k] * (k == axis ? side / 2 : random.Uniform(-0.5, 0.5));
    }
    known.normals(axis, i) = side;
  }
  return known;
}

// z = 0 over the unit square.
inline KnownCloud PlaneCloud(int count, uint64_t seed) {
  Random random(seed);
  KnownCloud known{{Eigen::Matrix3Xd::Zero(3, count)}, Eigen::Matrix3Xd::Zero(3, count)};
  for (int i = 0; i < count; ++i) {
    known.cloud.points(0, i) = random.Uniform();
    known.cloud.points(1, i) = random.Uniform();
    known.normals(2, i) = 1;
  }
  return known;
}

// One-sided: no consistent normals exist.
inline KnownCloud MoebiusCloud(int count, uint64_t seed) {
  Random random(seed);
  KnownCloud known{{Eigen::Matrix3Xd(3, count)}, Eigen::Matrix3Xd::Zero(3, count)};
  for (int i = 0; i < count; ++i) {
    const double u = random.Uniform(0, 2 * std::numbers::pi);
    const double v = random.Uniform(-0.3, 0.3);
    const double r = 1 + v * std::cos(u / 2);
    known.cloud.points.col(i) << r * std::cos(u), r * std::sin(u), v * std::sin(u / 2);
  }
  return known;
}

// A quarter of the sphere's surface, or all but a hole: what is left above z = `lowest`.
inline KnownCloud CutBelow(const KnownCloud& whole, double lowest) {
  std::vector<int> kept;
  for (int i = 0; i < whole.cloud.points.cols(); ++i) {
    if (whole.cloud.points(2, i) >= lowest) kept.push_back(i);
  }
  return {{whole.cloud.points(Eigen::all, kept)}, whole.normals(Eigen::all, kept)};
}

// The way through the scan stages up to where a test begins.
struct PreparedCloud {
  CheckedScan scan;
  NeighborGraph graph;
  Eigen::Matrix3Xd normals;  // true ones, in the order of scan.points
};

inline PreparedCloud Prepare(const KnownCloud& known, int k = 16,
                             const RunContext& context = RunContext{}) {
  PreparedCloud prepared;
  prepared.scan = CheckScan(known.cloud, CheckOptions{}, context).value();
  const PointIndex index(prepared.scan.points);
  NeighborOptions options;
  options.k = k;
  prepared.graph = BuildNeighborGraph(index, prepared.scan.points, options, context).value();
  prepared.normals = known.normals(Eigen::all, prepared.scan.source_index);
  return prepared;
}

// Mean angle between lines, degrees.
inline double MeanLineAngle(const Eigen::Matrix3Xd& a, const Eigen::Matrix3Xd& b) {
  const Eigen::ArrayXd cosines = (a.array() * b.array()).colwise().sum().abs().min(1.0).transpose();
  return cosines.acos().mean() * 180 / std::numbers::pi;
}

// Share of vectors that point away from the true ones.
inline double WrongShare(const Eigen::Matrix3Xd& normals, const Eigen::Matrix3Xd& truth) {
  return ((normals.array() * truth.array()).colwise().sum() < 0).cast<double>().mean();
}

}  // namespace rilievo
