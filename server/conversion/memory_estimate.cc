#include "server/conversion/memory_estimate.h"

#include <algorithm>

#include "core/control/implicit/implicit_function.h"
#include "core/control/spherical/spherical_control_mesh.h"
#include "core/paging/paged_scan.h"
#include "core/pipeline/sample_heights.h"
#include "core/pipeline/settings.h"

namespace rilievo {
namespace {

constexpr int64_t kMostPoints = int64_t{1} << 50;  // no memory holds so many; the sum still fits
constexpr int64_t kProgramBytes = 21'000'000;
// Of each point beyond so many neighbours are kept packed (see ScanSurface).
constexpr int64_t kManyPoints = 200'000;
// While normals and the control mesh are made: of a point, of a further one, and of a node of the
// implicit function. Few scans ask for all the nodes that it may have.
constexpr int64_t kAnalyzedPoint = 330, kFurtherAnalyzedPoint = 200, kNode = 45;
// More neighbours than usual are more to keep; of fewer come normals that a crumpled control mesh
// comes of.
constexpr int kUsualNeighbors = 16, kFewNeighbors = 12;
constexpr int64_t kNeighbor = 11, kMissingNeighbor = 250;
// While the domain is fitted: of a point and of a sample, with the control mesh below it.
constexpr int64_t kFittedPoint = 300, kFurtherFittedPoint = 200, kSample = 1300;
// While the surface is sampled and coded: of a point, of a face of the finest level whose heights
// are found at once, of any face, and of one where there are more than five for a point, so that
// most heights are filled in.
constexpr int64_t kSampledPoint = 60, kFace = 150, kCodedFace = 65, kFilledFace = 215;
const int64_t kFacesAtOnce = 4 * kSampleHeights.part_vertices;  // two parts; a vertex has two faces
// The number of a point's station with its vote and weight, and its normal, while sides are
// decided; its colour, from the first to the last.
constexpr int64_t kStationOfPoint = 10, kNormalOfPoint = 16, kColorOfPoint = 3;
// The coding of colours, of a face of the finest level.
constexpr int64_t kColoredFace = 70;
constexpr int64_t kTelling = 5;
// While a mesh is checked, before points are sampled on it: of a vertex and of a triangle, with its
// edges.
constexpr int64_t kCheckedVertex = 60, kCheckedTriangle = 180;
// While a surface is brought up to date, all of it at most: of a vertex of its finest level, and of
// a point. Measured where every height of 4 098 to 262 146 changed.
constexpr int64_t kUpdatedVertex = 420, kUpdatedPoint = 400;
// A control mesh has about so many faces at least, however few were asked for.
constexpr int64_t kFewestMade = 64;
// By parts: of a point of a part, with the four that the coarse pass sees for each, and of a
// further one; beside what the smallest takes, a page with its halo. More than even scans take, but
// not than a part that cannot be cut smaller, for its points lie within a halo: measured were 41 MB
// of 20 000 points in parts of 2048, 86 MB of 200 000 in parts of 8192, 243 MB of 1 000 000 in
// parts of 131 072, and 1 113 MB of 10 000 000 in the usual ones.
constexpr int64_t kSmallestParts = 85'000'000, kPartPoint = 1900, kFurtherPartPoint = 1280;
// Of a page of the scan: the boxes of its stretches, and those of the runs of pages above them.
constexpr int64_t kPageOfParts = 2600;
constexpr int64_t kManyPartPoints = 131'072;
// See FitOptions::sample_level.
constexpr int64_t kMostSamples = 60'000;

int64_t OfPoints(int64_t points, int64_t bytes, int64_t bytes_further) {
  const int64_t first = std::min(points, kManyPoints);
  return first * bytes + (points - first) * bytes_further;
}

// Of the whole domain: two samples a face, four times as many for each further level while they
// stay below the points and 60 000. A mesh that comes out coarser than it was asked for has no
// more.
int64_t Samples(int64_t control_faces, int64_t points, int asked_level) {
  if (asked_level == 0) return control_faces / 2;
  const int64_t least = 2 * control_faces;
  const int64_t most = std::min({kMostSamples, 4 * points, least << (2 * (asked_level - 1))});
  return std::max(least, most);
}

}  // namespace

int64_t EstimateMemory(const JobRequest& job) {
  if (job.parts) return EstimateMemoryOfParts(PartSizes::Of(job.parts->points), job.size.points);
  if (job.size.base_bytes > 0) {
    return kProgramBytes + kUpdatedVertex * job.base_vertices + kUpdatedPoint * job.size.points +
           2 * job.size.base_bytes;
  }
  const ReconstructOptions& options = job.options;
  const bool mesh = job.size.triangles > 0;
  const int64_t points = std::min(WorkedPoints(job), kMostPoints);
  const int64_t wanted = ExpectedControlFaces(job);
  int64_t control_faces =
      options.control.user_mesh ? wanted : std::max<int64_t>(wanted, kFewestMade);
  const Topology topology = options.control.topology;
  const bool made_of_points = !mesh && !options.control.user_mesh;
  if (made_of_points && (topology == Topology::kAuto || topology == Topology::kSpherical)) {
    control_faces =
        std::max<int64_t>(control_faces, SphericalControlFaces(static_cast<int>(wanted)));
  }
  const int level = options.max_level.value_or(LevelAsDenseAs(static_cast<double>(points), wanted));
  const int64_t faces = std::min(control_faces << (2 * level), options.max_surface_faces);
  const int64_t telling = std::min(faces, kTelling * points);
  const int neighbors = options.scan.neighbors.k;
  const int64_t unusual = kNeighbor * std::max(0, neighbors - kUsualNeighbors) +
                          kMissingNeighbor * std::max(0, kFewNeighbors - neighbors);
  const bool implicit =
      made_of_points && (topology == Topology::kAuto || topology == Topology::kArbitrary);
  const int64_t extra = (job.size.layout.stations ? kStationOfPoint : 0) +
                        (job.size.layout.normals || mesh ? kNormalOfPoint : 0) + unusual +
                        (job.size.layout.colors ? kColorOfPoint : 0);
  const int64_t analysis = OfPoints(points, kAnalyzedPoint + extra, kFurtherAnalyzedPoint + extra) +
                           (implicit ? kNode * MostImplicitNodes(points) : 0);
  const int64_t fit = OfPoints(points, kFittedPoint, kFurtherFittedPoint) +
                      kSample * Samples(control_faces, points, options.fit.sample_level);
  const int64_t surface = kSampledPoint * points +
                          std::max(kFace * std::min(telling, kFacesAtOnce), kCodedFace * telling) +
                          kFilledFace * (faces - telling) +
                          (job.size.layout.colors ? kColoredFace * faces : 0);
  const int64_t check =
      mesh ? kCheckedVertex * job.size.points + kCheckedTriangle * job.size.triangles : 0;
  return kProgramBytes + std::max({check, analysis, fit, surface});
}

int64_t EstimateMemoryOfParts(const PartSizes& sizes, int64_t points) {
  const int64_t first = std::min(sizes.part_points, kManyPartPoints);
  return kSmallestParts + kPartPoint * first + kFurtherPartPoint * (sizes.part_points - first) +
         kPageOfParts * (points / kPagePoints);
}

}  // namespace rilievo
