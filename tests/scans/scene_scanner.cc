#include "tests/scans/scene_scanner.h"

#include <Eigen/Geometry>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "core/geometry/station_table.h"
#include "tests/scans/random.h"
#include "tests/scans/ray_tree.h"

namespace rilievo {
namespace {

using Eigen::Vector3d;

constexpr int64_t kMaxRaysPerPoint = 100;

// The ray of a scanner for a place in the unit square.
using RayOf = std::function<Ray(double, double)>;

RayOf RaysOfStation(const Station& station) {
  return [station](double u, double v) {
    const double turn = 2 * std::numbers::pi * u;
    const double rise = station.lowest + v * (station.highest - station.lowest);
    return Ray{station.position,
               {std::cos(rise) * std::cos(turn), std::cos(rise) * std::sin(turn), std::sin(rise)}};
  };
}

RayOf RaysOfStrip(const Scene& scene, int strip) {
  const Eigen::AlignedBox3d box = scene.bounds();
  const double y = box.min().y() + box.sizes().y() * (strip + 0.5) / scene.flight.strips;
  return [box, y, flight = scene.flight](double u, double v) {
    const double angle = (2 * v - 1) * flight.half_angle;
    return Ray{{box.min().x() + u * box.sizes().x(), y, flight.height},
               {0, std::sin(angle), -std::cos(angle)}};
  };
}

// How far a ray comes before a leaf stops it; infinite where none does.
double LeafAlong(const Ray& ray, const std::vector<Crown>& crowns, Random* random) {
  double nearest = std::numeric_limits<double>::infinity();
  for (const Crown& crown : crowns) {
    const double middle = (crown.middle - ray.origin).dot(ray.direction);
    const double off = (ray.origin + middle * ray.direction - crown.middle).squaredNorm();
    const double half = std::sqrt(std::max(0.0, crown.radius * crown.radius - off));
    const double depth = -crown.free_path * std::log(1 - random->Uniform());
    if (depth < 2 * half) nearest = std::min(nearest, middle - half + depth);
  }
  return nearest;
}

class SceneScanner {
 public:
  SceneScanner(const Scene& scene, const SceneScanOptions& options)
      : truth_(scene.truth),
        crowns_(scene.crowns),
        tree_(scene.truth),
        sigma_(options.noise * scene.bounds().diagonal().norm()),
        least_cosine_(std::cos(options.max_incidence_degrees * std::numbers::pi / 180)),
        from_outside_(scene.truth.triangles.cols(), 0) {}

  // Rays in the R2 low-discrepancy pattern (Roberts 2018), until `quota` of them have returned.
  absl::Status Scan(const RayOf& ray_of, int64_t quota, Random random) {
    constexpr double kR2First = 0.7548776662466927, kR2Second = 0.5698402909980532;
    double u = random.Uniform(), v = random.Uniform();
    int64_t taken = 0;
    for (int64_t rays = 0; taken < quota; ++rays) {
      if (rays > kMaxRaysPerPoint * (quota + 100)) {
        return absl::FailedPreconditionError(
            absl::StrCat("a scanner sees too little of the scene: ", taken, " points of ", quota));
      }
      u = std::fmod(u + kR2First, 1.0);
      v = std::fmod(v + kR2Second, 1.0);
      const Ray ray = ray_of(u, v);
      const auto hit = tree_.First(ray);
      const double leaf = LeafAlong(ray, crowns_, &random);
      if (std::isfinite(leaf) && (!hit || leaf < hit->distance)) {
        points_.push_back(ray.origin + leaf * ray.direction);
        stations_.Add(ray.origin);
        is_leaf_.push_back(1);
        ++taken;
        continue;
      }
      if (!hit) continue;
      const double facing = -NormalOf(hit->triangle).dot(ray.direction);
      if (std::abs(facing) < least_cosine_) continue;
      from_outside_[hit->triangle] += facing > 0 ? 1 : -1;
      const double error = sigma_ > 0 ? sigma_ * random.Normal() : 0.0;
      points_.push_back(ray.origin + (hit->distance + error) * ray.direction);
      stations_.Add(ray.origin);
      is_leaf_.push_back(0);
      ++taken;
    }
    return absl::OkStatus();
  }

  SceneScan Take() {
    SceneScan scan;
    scan.cloud.points.resize(3, static_cast<Eigen::Index>(points_.size()));
    for (size_t i = 0; i < points_.size(); ++i) scan.cloud.points.col(i) = points_[i];
    stations_.Finish(&scan.cloud.sights);
    scan.is_leaf = is_leaf_;
    for (const int count : from_outside_) scan.seen.push_back((count > 0) - (count < 0));
    return scan;
  }

 private:
  Vector3d NormalOf(int triangle) const {
    const auto corners = truth_.triangles.col(triangle);
    const Vector3d a = truth_.vertices.col(corners[0]);
    return (truth_.vertices.col(corners[1]) - a)
        .cross(truth_.vertices.col(corners[2]) - a)
        .normalized();
  }

  const TriangleMesh& truth_;
  const std::vector<Crown>& crowns_;
  const RayTree tree_;
  const double sigma_, least_cosine_;
  std::vector<int> from_outside_;  // returns from there, less those from the other side
  std::vector<Vector3d> points_;
  std::vector<uint8_t> is_leaf_;
  StationTable stations_;
};

}  // namespace

absl::StatusOr<SceneScan> ScanScene(const Scene& scene, const SceneScanOptions& options) {
  std::vector<RayOf> scanners;
  for (const Station& station : scene.stations) scanners.push_back(RaysOfStation(station));
  for (int strip = 0; strip < scene.flight.strips; ++strip) {
    scanners.push_back(RaysOfStrip(scene, strip));
  }
  if (scanners.empty() || options.points < static_cast<int64_t>(scanners.size())) {
    return absl::InvalidArgumentError(absl::StrCat("scene ", scene.name, ": ", scanners.size(),
                                                   " scanners for ", options.points, " points"));
  }
  SceneScanner scanner(scene, options);
  const auto count = static_cast<int64_t>(scanners.size());
  for (int64_t k = 0; k < count; ++k) {
    const int64_t quota = options.points * (k + 1) / count - options.points * k / count;
    RILIEVO_RETURN_IF_ERROR(
        scanner.Scan(scanners[k], quota, Random(options.seed, static_cast<uint64_t>(k))));
  }
  return scanner.Take();
}

}  // namespace rilievo
