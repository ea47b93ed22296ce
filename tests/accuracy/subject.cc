#include "tests/accuracy/subject.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <functional>
#include <map>
#include <numeric>
#include <random>
#include <tuple>
#include <utility>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "core/points/point_index.h"
#include "core/surface/closest_point_tree.h"
#include "core/surface/surface_samples.h"
#include "tests/accuracy/local_spacing.h"
#include "tests/scans/analytic_shape.h"
#include "tests/scans/scanner.h"
#include "tests/scans/scene_scanner.h"

namespace rilievo {
namespace {

using Eigen::Matrix3Xd;
using Eigen::Vector3d;

constexpr int64_t kSeenPlaces = 50000;

class TruthOfShape : public Truth {
 public:
  explicit TruthOfShape(ShapePtr shape) : shape_(std::move(shape)) {}
  Nearest NearestTo(const Vector3d& place) const override {
    const Vector3d nearest = shape_->ClosestPoint(place);
    return {(place - nearest).norm(), shape_->Gradient(nearest).normalized()};
  }

 private:
  ShapePtr shape_;
};

class TruthOfScene : public Truth {
 public:
  TruthOfScene(Scene scene, std::vector<int8_t> seen)
      : mesh_(std::move(scene.truth)),
        seen_(std::move(seen)),
        tree_(ClosestPointTree::Build(mesh_.vertices, mesh_.triangles, RunContext{}).value()) {}
  Nearest NearestTo(const Vector3d& place) const override {
    const ClosestPointTree::Hit hit = tree_.Closest(place);
    const int triangle = tree_.source()[hit.item];
    const auto corners = mesh_.triangles.col(triangle);
    const Vector3d a = mesh_.vertices.col(corners[0]);
    const Vector3d normal =
        (mesh_.vertices.col(corners[1]) - a).cross(mesh_.vertices.col(corners[2]) - a).normalized();
    return {std::sqrt(hit.squared_distance), seen_[triangle] < 0 ? Vector3d(-normal) : normal};
  }
  // Places on the triangles that were seen.
  Matrix3Xd Seen() const {
    std::vector<int> triangles;
    for (size_t f = 0; f < seen_.size(); ++f) {
      if (seen_[f] != 0) triangles.push_back(static_cast<int>(f));
    }
    const Eigen::Matrix3Xi corners = mesh_.triangles(Eigen::all, triangles);
    std::vector<int> order(triangles.size());
    std::iota(order.begin(), order.end(), 0);
    return SampleByArea(mesh_.vertices, corners, order, kSeenPlaces, 1);
  }

 private:
  TriangleMesh mesh_;
  std::vector<int8_t> seen_;
  ClosestPointTree tree_;
};

// Of places all over the surface, those within three spacings of a point.
Matrix3Xd SeenBy(const Matrix3Xd& points, const Matrix3Xd& places) {
  const PointIndex index(points);
  const std::vector<float> spacing = LocalSpacing(points, index);
  const std::vector<int> nearest = index.NearestOfEach(places, RunContext{}).value();
  std::vector<int> kept;
  for (int i = 0; i < places.cols(); ++i) {
    const double distance = (places.col(i) - points.col(nearest[i])).norm();
    if (distance < 3 * double{spacing[nearest[i]]}) kept.push_back(i);
  }
  return places(Eigen::all, kept);
}

// All over the shape; the same for every scan of it, so made once.
absl::StatusOr<Matrix3Xd> PlacesOn(const AnalyticShape& shape, uint64_t seed) {
  static auto* const made = new std::map<std::tuple<std::string, double, uint64_t>, Matrix3Xd>;
  Matrix3Xd& places = (*made)[{shape.name(), shape.diagonal(), seed}];
  if (places.cols() > 0) return places;
  ScannerOptions options;
  options.points = kSeenPlaces;
  options.views = 0;
  options.seed = seed;
  RILIEVO_ASSIGN_OR_RETURN(SimulatedScan scan, SimulateScan(shape, options));
  places = std::move(scan.cloud.points);
  return places;
}

// Noise along the normals, whose deviation grows along x from nothing to `largest`.
void AddGrowingNoise(double largest, uint64_t seed, SimulatedScan* scan) {
  Matrix3Xd& points = scan->cloud.points;
  const double from = points.row(0).minCoeff(), width = points.row(0).maxCoeff() - from;
  std::mt19937_64 random(seed);
  std::normal_distribution<double> deviates;
  for (Eigen::Index i = 0; i < points.cols(); ++i) {
    const double deviation = largest * (points(0, i) - from) / width;
    points.col(i) += deviation * deviates(random) * scan->normals.col(i);
  }
}

struct Scanning {
  int views = 0;        // see ScannerOptions
  double outliers = 0;  // see ScannerOptions
  bool noise_grows = false;
};

absl::StatusOr<Subject> ScanShape(ShapePtr shape, const Scanning& how, const SubjectName& name) {
  ScannerOptions options;
  options.outliers = how.outliers;
  options.points = name.points;
  options.views = how.views;
  const double noise = name.noise_percent / 100;
  options.noise = how.noise_grows ? 0 : noise;
  options.seed = name.seed;
  Subject subject;
  RILIEVO_ASSIGN_OR_RETURN(SimulatedScan scan, SimulateScan(*shape, options));
  if (how.noise_grows) AddGrowingNoise(noise * shape->diagonal(), name.seed, &scan);
  subject.scan = std::move(scan.cloud);
  RILIEVO_ASSIGN_OR_RETURN(subject.seen, PlacesOn(*shape, name.seed + 1));
  if (how.views > 0) {
    options.noise = options.outliers = 0;
    RILIEVO_ASSIGN_OR_RETURN(const SimulatedScan clean, SimulateScan(*shape, options));
    subject.seen = SeenBy(clean.cloud.points, subject.seen);
  }
  subject.diagonal = shape->diagonal();
  subject.truth = std::make_unique<TruthOfShape>(std::move(shape));
  return subject;
}

absl::StatusOr<Subject> ScanOf(Scene scene, bool with_stations, const SubjectName& name) {
  SceneScanOptions options;
  options.points = name.points;
  options.noise = name.noise_percent / 100;
  options.seed = name.seed;
  RILIEVO_ASSIGN_OR_RETURN(SceneScan scan, ScanScene(scene, options));
  Subject subject;
  subject.scan = std::move(scan.cloud);
  if (!with_stations) subject.scan.sights = {};
  subject.diagonal = scene.bounds().diagonal().norm();
  auto truth = std::make_unique<TruthOfScene>(std::move(scene), std::move(scan.seen));
  subject.seen = truth->Seen();
  subject.truth = std::move(truth);
  return subject;
}

using Maker = std::function<absl::StatusOr<Subject>(const SubjectName&)>;

Maker OfShape(ShapePtr (*make)(), const Scanning& how = {}) {
  return [=](const SubjectName& name) { return ScanShape(make(), how, name); };
}

Maker OfScene(Scene (*make)(), bool with_stations) {
  return [=](const SubjectName& name) { return ScanOf(make(), with_stations, name); };
}

const std::vector<std::pair<std::string, Maker>>& Makers() {
  static const auto* const makers = new std::vector<std::pair<std::string, Maker>>{
      {"torus", OfShape([] { return MakeTorus(); })},
      {"genus2", OfShape(MakeGenus2)},
      {"pair", OfShape(MakePair)},
      {"star", OfShape(MakeStar)},
      {"cutbox", OfShape(MakeCutBox)},
      {"bracket", OfShape(MakeBracket)},
      {"thinwalls", OfShape(MakeThinWalls)},
      {"terrain", OfShape(MakeTerrain)},
      {"genus2-open", OfShape(MakeGenus2, {.views = 3})},
      {"genus2-outliers", OfShape(MakeGenus2, {.outliers = 0.1})},
      {"genus2-growing", OfShape(MakeGenus2, {.noise_grows = true})},
      {"bracket-growing", OfShape(MakeBracket, {.noise_grows = true})},
      {"street", OfScene(MakeStreet, false)},
      {"block", OfScene(MakeBlock, false)},
      {"garden", OfScene(MakeGarden, false)},
      {"rooms", OfScene(MakeRooms, false)},
      {"street-stations", OfScene(MakeStreet, true)},
      {"block-stations", OfScene(MakeBlock, true)},
      {"rooms-stations", OfScene(MakeRooms, true)},
  };
  return *makers;
}

}  // namespace

std::vector<std::string> SubjectShapes() {
  std::vector<std::string> names;
  for (const auto& [name, maker] : Makers()) names.push_back(name);
  return names;
}

absl::StatusOr<Subject> MakeSubject(const SubjectName& name) {
  for (const auto& [shape, make] : Makers()) {
    if (shape != name.shape) continue;
    RILIEVO_ASSIGN_OR_RETURN(Subject subject, make(name));
    subject.noise = name.noise_percent / 100 * subject.diagonal;
    return subject;
  }
  return absl::InvalidArgumentError(absl::StrCat("no subject is called '", name.shape, "'"));
}

}  // namespace rilievo
