#include "tests/accuracy/measure_accuracy.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <ctime>
#include <map>
#include <numeric>
#include <vector>

#include "core/base/parallel_for.h"
#include "core/base/status_macros.h"
#include "core/codec/container/dss.h"
#include "core/geometry/mesh_topology.h"
#include "core/pipeline/reconstruct.h"
#include "core/surface/closest_point_tree.h"
#include "core/surface/displaced_surface.h"
#include "core/surface/surface_samples.h"
#include "tests/accuracy/local_spacing.h"

namespace rilievo {
namespace {

using Eigen::Matrix3Xd;
using Eigen::Vector3d;

constexpr int64_t kSurfacePlaces = 50000;
constexpr int64_t kBlock = 256;

// What is gathered over places, in their order.
struct Sums {
  double squares = 0, largest = 0;
  int64_t away = 0, unsupported = 0, count = 0;
  void Add(const Sums& other) {
    squares += other.squares;
    largest = std::max(largest, other.largest);
    away += other.away;
    unsupported += other.unsupported;
    count += other.count;
  }
  void AddDistance(double distance) {
    squares += distance * distance;
    largest = std::max(largest, distance);
    ++count;
  }
};

// The sum of measure(i) over [0, count), on all threads.
template <typename Measure>
absl::StatusOr<Sums> SumOver(int64_t count, const RunContext& context, const Measure& measure) {
  std::vector<Sums> blocks((count + kBlock - 1) / kBlock);
  RILIEVO_RETURN_IF_ERROR(ParallelFor(count, kBlock, context, [&](int64_t begin, int64_t end) {
    for (int64_t i = begin; i < end; ++i) measure(i, &blocks[begin / kBlock]);
  }));
  Sums sums;
  for (const Sums& block : blocks) sums.Add(block);
  return sums;
}

absl::StatusOr<Sums> FromSurface(const TriangleMesh& mesh, const Subject& subject,
                                 const RunContext& context) {
  std::vector<int> order(static_cast<size_t>(mesh.triangles.cols())), faces;
  std::iota(order.begin(), order.end(), 0);
  const Matrix3Xd places =
      SampleByArea(mesh.vertices, mesh.triangles, order, kSurfacePlaces, 1, &faces);
  const Matrix3Xd& points = subject.scan.points;
  const PointIndex index(points);
  const std::vector<float> spacing = LocalSpacing(points, index);
  RILIEVO_ASSIGN_OR_RETURN(const std::vector<int> nearest, index.NearestOfEach(places, context));
  return SumOver(places.cols(), context, [&](int64_t i, Sums* sums) {
    const Vector3d place = places.col(i);
    const Truth::Nearest truth = subject.truth->NearestTo(place);
    sums->AddDistance(truth.distance);
    const auto corners = mesh.triangles.col(faces[i]);
    const Vector3d a = mesh.vertices.col(corners[0]);
    const Vector3d normal =
        (mesh.vertices.col(corners[1]) - a).cross(mesh.vertices.col(corners[2]) - a);
    if (normal.dot(truth.normal) < 0) ++sums->away;
    const double from_points = (place - points.col(nearest[i])).norm();
    if (from_points > 3 * (double{spacing[nearest[i]]} + subject.noise)) ++sums->unsupported;
  });
}

absl::StatusOr<Sums> FromTruth(const TriangleMesh& mesh, const Subject& subject,
                               const RunContext& context) {
  RILIEVO_ASSIGN_OR_RETURN(const ClosestPointTree tree,
                           ClosestPointTree::Build(mesh.vertices, mesh.triangles, context));
  return SumOver(subject.seen.cols(), context, [&](int64_t i, Sums* sums) {
    sums->AddDistance(std::sqrt(tree.Closest(subject.seen.col(i)).squared_distance));
  });
}

}  // namespace

absl::StatusOr<AccuracyFigures> MeasureAccuracy(const Subject& subject, const RunContext& context) {
  const std::clock_t start = std::clock();
  RILIEVO_ASSIGN_OR_RETURN(const Reconstruction result,
                           Reconstruct(subject.scan, ReconstructOptions{}, context));
  const double seconds = static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
  AccuracyFigures figures;
  figures.microseconds = 1e6 * seconds / static_cast<double>(subject.scan.points.cols());
  const std::vector<uint8_t> bytes = result.encoded.Concatenate();
  figures.bytes = static_cast<int64_t>(bytes.size());
  RILIEVO_ASSIGN_OR_RETURN(const DecodedSurface decoded, DecodeDss(bytes, context));
  const ControlMesh& control = decoded.surface.control_mesh;
  figures.genus = SummarizeTopology(control.faces, static_cast<int>(control.vertices.cols())).genus;
  RILIEVO_ASSIGN_OR_RETURN(const TriangleMesh mesh,
                           Tessellate(decoded.surface, decoded.surface.max_level, context));
  RILIEVO_ASSIGN_OR_RETURN(const Sums surface, FromSurface(mesh, subject, context));
  RILIEVO_ASSIGN_OR_RETURN(const Sums truth, FromTruth(mesh, subject, context));
  const double places = static_cast<double>(surface.count), percent = 100 / subject.diagonal;
  const double mean_square =
      (surface.squares / places + truth.squares / static_cast<double>(truth.count)) / 2;
  figures.rms = percent * std::sqrt(mean_square);
  figures.hausdorff = percent * std::max(surface.largest, truth.largest);
  figures.wrong_normals = 100 * static_cast<double>(surface.away) / places;
  figures.false_area = 100 * static_cast<double>(surface.unsupported) / places;
  return figures;
}

absl::StatusOr<AccuracyFigures> MeasureAccuracy(const SubjectName& name, int seeds,
                                                const RunContext& context) {
  AccuracyFigures mean;
  double log_rms = 0, log_hausdorff = 0, log_bytes = 0, log_time = 0;
  std::map<int64_t, int> genera;
  for (int seed = 0; seed < seeds; ++seed) {
    SubjectName one = name;
    one.seed += static_cast<uint64_t>(seed);
    RILIEVO_ASSIGN_OR_RETURN(const Subject subject, MakeSubject(one));
    RILIEVO_ASSIGN_OR_RETURN(const AccuracyFigures figures, MeasureAccuracy(subject, context));
    log_rms += std::log(figures.rms) / seeds;
    log_hausdorff += std::log(figures.hausdorff) / seeds;
    log_bytes += std::log(static_cast<double>(figures.bytes)) / seeds;
    log_time += std::log(figures.microseconds) / seeds;
    mean.wrong_normals += figures.wrong_normals / seeds;
    mean.false_area += figures.false_area / seeds;
    ++genera[figures.genus];
  }
  mean.rms = std::exp(log_rms);
  mean.hausdorff = std::exp(log_hausdorff);
  mean.bytes = std::llround(std::exp(log_bytes));
  mean.microseconds = std::exp(log_time);
  const auto by_count = [](const auto& a, const auto& b) { return a.second < b.second; };
  mean.genus = std::max_element(genera.begin(), genera.end(), by_count)->first;
  return mean;
}

}  // namespace rilievo
