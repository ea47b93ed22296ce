#include "tests/scans/scanner.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <utility>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "tests/scans/random.h"
#include "tests/scans/ray_cast.h"

namespace rilievo {
namespace {

using Eigen::Vector3d;

constexpr uint64_t kOutlierStream = 1u << 20, kShuffleStream = kOutlierStream + 1;
// A viewpoint that needs more rays than this a point does not see the shape.
constexpr int64_t kMaxRaysPerPoint = 2000;

struct Sample {
  Vector3d point, normal;
  int view;
  bool outlier;
};

struct BoundingSphere {
  Vector3d center;
  double radius;
};

BoundingSphere SphereAround(const AnalyticShape& shape) {
  return {shape.bounds().center(), 0.5 * shape.diagonal()};
}

// Directions evenly over the sphere (Fibonacci lattice), or over the cap z > 0.4.
Vector3d ViewDirection(int view, int views, bool closed) {
  const double golden = std::numbers::pi * (3.0 - std::sqrt(5.0));
  const double share = (view + 0.5) / views;
  const double z = closed ? 1.0 - 2.0 * share : 1.0 - 0.6 * share;
  const double radius = std::sqrt(1.0 - z * z);
  return {radius * std::cos(golden * view), radius * std::sin(golden * view), z};
}

std::pair<Vector3d, Vector3d> Perpendicular(const Vector3d& axis) {
  const Vector3d first = axis.unitOrthogonal();
  return {first, axis.cross(first)};
}

// One viewpoint: rays evenly over the cone around the bounding sphere, in the R2 low-discrepancy
// pattern (Roberts 2018), which stays even however many rays the quota takes.
absl::Status ScanFromView(const AnalyticShape& shape, const ScannerOptions& options, int view,
                          const Vector3d& viewpoint, int64_t quota, std::vector<Sample>* samples) {
  constexpr double kR2First = 0.7548776662466927, kR2Second = 0.5698402909980532;
  const BoundingSphere sphere = SphereAround(shape);
  const Vector3d axis = (sphere.center - viewpoint).normalized();
  const auto [side, up] = Perpendicular(axis);
  const double cone = 1.0 - std::sqrt(1.0 - 1.0 / std::pow(options.view_distance, 2));
  const double nearest = (options.view_distance - 1.0) * sphere.radius;
  const double t_end = (options.view_distance + 1.0) * sphere.radius;
  const double least_cosine = std::cos(options.max_incidence_degrees * std::numbers::pi / 180.0);
  const double sigma = options.noise * shape.diagonal();
  Random random(options.seed, static_cast<uint64_t>(view));
  double u = random.Uniform(), v = random.Uniform();
  int64_t taken = 0;
  for (int64_t ray_index = 0; taken < quota; ++ray_index) {
    if (ray_index > kMaxRaysPerPoint * (quota + 10)) {
      return absl::FailedPreconditionError(absl::StrCat("viewpoint ", view, " sees too little of ",
                                                        shape.name(), ": ", taken, " points of ",
                                                        quota, " after ", ray_index, " rays"));
    }
    u = std::fmod(u + kR2First, 1.0);
    v = std::fmod(v + kR2Second, 1.0);
    const double cosine = 1.0 - cone * u, sine = std::sqrt(1.0 - cosine * cosine);
    const double turn = 2 * std::numbers::pi * v;
    const Ray ray{viewpoint, cosine * axis + sine * (std::cos(turn) * side + std::sin(turn) * up)};
    const std::vector<double> hit = RayCrossings(shape, ray, t_end, 1);
    if (hit.empty()) continue;
    const Vector3d point = ray.origin + hit[0] * ray.direction;
    const Vector3d normal = shape.Normal(point);
    if (-normal.dot(ray.direction) < least_cosine) continue;
    if (random.Uniform() < options.dropout) continue;
    if (random.Uniform() > std::pow(nearest / hit[0], options.falloff)) continue;
    const double error = sigma > 0 ? sigma * random.Normal() : 0.0;
    samples->push_back({point + error * ray.direction, normal, view, false});
    ++taken;
  }
  return absl::OkStatus();
}

// Uniform over the area: the crossings of lines that are uniform among those that meet the bounding
// sphere are uniform on the surface (Cauchy and Crofton).
absl::Status ScanEverywhere(const AnalyticShape& shape, const ScannerOptions& options,
                            int64_t quota, std::vector<Sample>* samples) {
  const BoundingSphere sphere = SphereAround(shape);
  const double sigma = options.noise * shape.diagonal();
  Random random(options.seed);
  const int64_t end = static_cast<int64_t>(samples->size()) + quota;
  while (static_cast<int64_t>(samples->size()) < end) {
    const double z = random.Uniform(-1, 1), turn = random.Uniform(0, 2 * std::numbers::pi);
    const double ring = std::sqrt(1 - z * z);
    const Vector3d direction(ring * std::cos(turn), ring * std::sin(turn), z);
    const auto [side, up] = Perpendicular(direction);
    const double radius = sphere.radius * std::sqrt(random.Uniform());
    const double angle = random.Uniform(0, 2 * std::numbers::pi);
    const double reach = 1.001 * sphere.radius;
    const Ray ray{sphere.center - reach * direction +
                      radius * (std::cos(angle) * side + std::sin(angle) * up),
                  direction};
    for (double t : RayCrossings(shape, ray, 2 * reach, 1000)) {
      if (static_cast<int64_t>(samples->size()) == end) break;
      if (random.Uniform() < options.dropout) continue;
      const Vector3d point = ray.origin + t * direction;
      const Vector3d normal = shape.Normal(point);
      const double error = sigma > 0 ? sigma * random.Normal() : 0.0;
      samples->push_back({point + error * normal, normal, -1, false});
    }
  }
  return absl::OkStatus();
}

void AddOutliers(const AnalyticShape& shape, const ScannerOptions& options, int64_t count,
                 std::vector<Sample>* samples) {
  Random random(options.seed, kOutlierStream);
  const Eigen::AlignedBox3d box = shape.bounds();
  for (int64_t i = 0; i < count; ++i) {
    const Vector3d unit(random.Uniform(-0.6, 0.6), random.Uniform(-0.6, 0.6),
                        random.Uniform(-0.6, 0.6));
    samples->push_back({box.center() + unit.cwiseProduct(box.sizes()), Vector3d::Zero(), -1, true});
  }
}

SimulatedScan Gather(const std::vector<Sample>& samples, uint64_t seed) {
  std::vector<int64_t> order(samples.size());
  std::iota(order.begin(), order.end(), 0);
  Random random(seed, kShuffleStream);
  for (size_t i = order.size(); i > 1; --i) std::swap(order[i - 1], order[random.Below(i)]);

  SimulatedScan scan;
  const Eigen::Index count = static_cast<Eigen::Index>(samples.size());
  scan.cloud.points.resize(3, count);
  scan.normals.resize(3, count);
  scan.view.resize(samples.size());
  scan.outlier.resize(samples.size());
  for (Eigen::Index i = 0; i < count; ++i) {
    const Sample& sample = samples[static_cast<size_t>(order[i])];
    scan.cloud.points.col(i) = sample.point;
    scan.normals.col(i) = sample.normal;
    scan.view[i] = sample.view;
    scan.outlier[i] = sample.outlier ? 1 : 0;
  }
  return scan;
}

absl::Status CheckRange(absl::string_view field, double value, double low, double high) {
  if (value >= low && value <= high) return absl::OkStatus();
  return absl::InvalidArgumentError(
      absl::StrCat(field, " is ", value, "; it must lie in [", low, ", ", high, "]"));
}

}  // namespace

absl::Status ScannerOptions::Validate() const {
  RILIEVO_RETURN_IF_ERROR(CheckRange("points", static_cast<double>(points), 1, 2e8));
  RILIEVO_RETURN_IF_ERROR(CheckRange("views", views, 0, 1000));
  RILIEVO_RETURN_IF_ERROR(CheckRange("view_distance", view_distance, 1.2, 100));
  RILIEVO_RETURN_IF_ERROR(CheckRange("falloff", falloff, 0, 100));
  RILIEVO_RETURN_IF_ERROR(CheckRange("noise", noise, 0, 0.1));
  RILIEVO_RETURN_IF_ERROR(CheckRange("outliers", outliers, 0, 0.9));
  RILIEVO_RETURN_IF_ERROR(CheckRange("dropout", dropout, 0, 0.95));
  return CheckRange("max_incidence_degrees", max_incidence_degrees, 1e-3, 90);
}

absl::StatusOr<SimulatedScan> SimulateScan(const AnalyticShape& shape,
                                           const ScannerOptions& options) {
  RILIEVO_RETURN_IF_ERROR(options.Validate());
  const auto outliers =
      static_cast<int64_t>(std::llround(options.outliers * static_cast<double>(options.points)));
  const int64_t genuine = options.points - outliers;
  std::vector<Sample> samples;
  samples.reserve(static_cast<size_t>(options.points));
  Eigen::Matrix3Xd viewpoints(3, options.views);
  const BoundingSphere sphere = SphereAround(shape);
  for (int view = 0; view < options.views; ++view) {
    viewpoints.col(view) = sphere.center + options.view_distance * sphere.radius *
                                               ViewDirection(view, options.views, shape.closed());
    const int64_t quota = genuine * (view + 1) / options.views - genuine * view / options.views;
    RILIEVO_RETURN_IF_ERROR(
        ScanFromView(shape, options, view, viewpoints.col(view), quota, &samples));
  }
  if (options.views == 0) {
    RILIEVO_RETURN_IF_ERROR(ScanEverywhere(shape, options, genuine, &samples));
  }
  AddOutliers(shape, options, outliers, &samples);
  SimulatedScan scan = Gather(samples, options.seed);
  scan.viewpoints = std::move(viewpoints);
  return scan;
}

ShapeError MeasureAgainstShape(const AnalyticShape& shape, const Eigen::Matrix3Xd& points) {
  ShapeError error;
  if (points.cols() == 0) return error;
  for (Eigen::Index i = 0; i < points.cols(); ++i) {
    const double distance = std::abs(shape.Distance(points.col(i)));
    error.rms += distance * distance;
    error.mean += distance;
    error.max = std::max(error.max, distance);
  }
  error.rms = std::sqrt(error.rms / static_cast<double>(points.cols()));
  error.mean /= static_cast<double>(points.cols());
  return error;
}

}  // namespace rilievo
