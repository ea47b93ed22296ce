#include "core/pipeline/heights_from_pages.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numeric>
#include <utility>
#include <vector>

#include "core/base/status_macros.h"
#include "core/displacement/sample_displacement.h"
#include "core/loop/face_vertices.h"
#include "core/loop/level_rings.h"
#include "core/loop/sub_mesh.h"
#include "core/pipeline/sample_heights.h"

namespace rilievo {
namespace {

// Points this far beyond what a part may reach still tell of its heights: of the coarse points'
// spacings (heights of a block agree with those of the whole from eight spacings of all points on).
constexpr double kHaloSpacings = 8;

using Box = Eigen::AlignedBox3d;

// What no part changes.
struct Whole {
  const ScanSurface& coarse;
  const ControlMesh& mesh;
  const PartCutter& cutter;
  const MeshTopology& topology;
  int level = 0;           // of the heights that are measured
  std::vector<Box> reach;  // of each control face: where its displaced surface lies, unit frame
};

// The limit surface of a face lies in the convex hull of the control points of the faces that touch
// it; heights add what the coarse ones show.
std::vector<Box> ReachOfFaces(const MeshTopology& topology, const DisplacedSurface& coarse) {
  std::vector<Box> around(topology.vertex_count);
  for (const auto face : topology.faces.colwise()) {
    for (const int v : face) {
      for (const int other : face) around[v].extend(coarse.control_mesh.vertices.col(other));
    }
  }
  std::vector<Box> reach(topology.face_count());
  const FaceVertices vertices(topology, coarse.max_level);
  std::vector<int> of_face;
  for (int f = 0; f < topology.face_count(); ++f) {
    vertices.Of(f, of_face);
    double highest = 0;
    for (const int v : of_face) highest = std::max(highest, std::abs(double{coarse.heights[v]}));
    for (const int v : topology.faces.col(f)) reach[f].extend(around[v]);
    reach[f].min().array() -= highest;
    reach[f].max().array() += highest;
  }
  return reach;
}

// The box that the points of these faces are read from.
Box BoxOf(const std::vector<int>& members, const Whole& whole) {
  Box box;
  for (const int f : members) box.extend(whole.reach[f]);
  const double halo = kHaloSpacings * whole.coarse.cloud.median_spacing;
  box.min().array() -= halo;
  box.max().array() += halo;
  const SpatialFrame& frame = whole.coarse.frame;
  return Box(frame.ScanFromUnit(box.min()), frame.ScanFromUnit(box.max()));
}

// Control faces in parts, each within pages of at most `most` points where halving them comes to
// that.
class Partition {
 public:
  Partition(const PagedScan& scan, const Whole& whole, int64_t most)
      : scan_(scan), whole_(whole), most_(most) {}

  std::vector<std::vector<int>> Run() {
    std::vector<int> all(whole_.topology.face_count());
    std::iota(all.begin(), all.end(), 0);
    const int64_t points = PointsOf(all);
    Split(std::move(all), points);
    return std::move(parts_);
  }

 private:
  int64_t PointsAround(const Box& box) const {
    int64_t pages = 0;
    for (const Page& page : scan_.pages()) pages += box.intersects(page.box);
    return pages * kPagePoints;
  }

  double MiddleOf(int face, int axis) const {
    const auto corners = whole_.topology.faces.col(face);
    return whole_.mesh.vertices(axis, corners[0]) + whole_.mesh.vertices(axis, corners[1]) +
           whole_.mesh.vertices(axis, corners[2]);
  }

  int64_t PointsOf(const std::vector<int>& members) const {
    return PointsAround(BoxOf(members, whole_));
  }

  // Both halves, across the longest extent of their box.
  std::array<std::vector<int>, 2> Halves(std::vector<int> members) const {
    Eigen::Index axis = 0;
    BoxOf(members, whole_).sizes().maxCoeff(&axis);
    const auto along = [&](int f) { return std::pair(MiddleOf(f, static_cast<int>(axis)), f); };
    std::sort(members.begin(), members.end(), [&](int a, int b) { return along(a) < along(b); });
    const auto half = members.begin() + static_cast<std::ptrdiff_t>(members.size() / 2);
    std::array<std::vector<int>, 2> halves = {std::vector<int>(members.begin(), half),
                                              std::vector<int>(half, members.end())};
    for (std::vector<int>& part : halves) std::sort(part.begin(), part.end());
    return halves;
  }

  // Halves that read nearly as much as the whole, as where the halo is most of it, are not worth
  // their work.
  void Split(std::vector<int> members, int64_t points) {
    constexpr double kWorth = 0.8;
    if (members.size() > 1 && points > most_) {
      std::array<std::vector<int>, 2> halves = Halves(members);
      const std::array<int64_t, 2> of_half = {PointsOf(halves[0]), PointsOf(halves[1])};
      if (static_cast<double>(std::max(of_half[0], of_half[1])) <
          kWorth * static_cast<double>(points)) {
        for (size_t side = 0; side < 2; ++side) Split(std::move(halves[side]), of_half[side]);
        return;
      }
    }
    parts_.push_back(std::move(members));
  }

  const PagedScan& scan_;
  const Whole& whole_;
  int64_t most_;
  std::vector<std::vector<int>> parts_;
};

// The points of a block as a scan of their own, whose sides are those of the coarse points. No
// points where they are too few for a surface.
absl::StatusOr<OrientedCloud> AnalyzeBlock(Eigen::Matrix3Xd points, int64_t points_of_scan,
                                           const Whole& whole, const ReconstructOptions& options,
                                           const RunContext& context) {
  PointCloud block;
  RILIEVO_ASSIGN_OR_RETURN(const std::vector<int> nearest,
                           whole.coarse.index.NearestOfEach(points, context));
  block.points = std::move(points);
  block.sights.normals = whole.coarse.cloud.normals(Eigen::all, nearest).cast<float>();
  ScanOptions scan = options.scan;
  scan.sights = {SightRule::kIgnore, SightRule::kUse};
  // Islands are as large as they would have to be in the whole.
  scan.outliers.min_component_share =
      std::min(0.1, scan.outliers.min_component_share * static_cast<double>(points_of_scan) /
                        static_cast<double>(block.points.cols()));
  CheckOptions check = options.check;
  absl::StatusOr<CheckedScan> checked = CheckScan(block, check, context);
  block = PointCloud();
  if (absl::IsInvalidArgument(checked.status())) return OrientedCloud();
  RILIEVO_RETURN_IF_ERROR(checked.status());
  absl::StatusOr<ScanSurface> analyzed = AnalyzeScan(*std::move(checked), scan, context);
  if (absl::IsInvalidArgument(analyzed.status())) return OrientedCloud();
  RILIEVO_RETURN_IF_ERROR(analyzed.status());
  const SpatialFrame& frame = analyzed->frame;
  OrientedCloud cloud = std::move(analyzed->cloud);
  for (auto point : cloud.points.colwise()) point = frame.ScanFromUnit(point);
  const auto scale = static_cast<float>(frame.diagonal);
  for (float& spacing : cloud.spacing) spacing *= scale;
  for (float& noise : cloud.noise) noise *= scale;
  cloud.median_spacing *= frame.diagonal;
  cloud.median_noise *= frame.diagonal;
  return cloud;
}

// Some control faces with all that their heights depend on.
struct Part {
  SubMesh sub;
  std::vector<int> inner;  // faces of `sub` that are the part itself, ascending
};

Part CutPart(const Whole& whole, const std::vector<int>& members, const Box& box) {
  std::vector<int> within;
  for (int f = 0; f < whole.topology.face_count(); ++f) {
    if (box.intersects(whole.reach[f])) within.push_back(f);
  }
  Part part;
  part.sub = whole.cutter.Cut(within, 0);
  part.inner = PlacesOf(members, part.sub.faces);
  return part;
}

absl::Status WritePart(const Part& part, const FaceVertices& vertices,
                       const DisplacementField& field, ScratchHeights* heights) {
  std::vector<int> of_face;
  std::vector<float> of_vertex;
  std::vector<HeightSource> sources;
  for (const int f : part.inner) {
    vertices.Of(f, of_face);
    of_vertex.clear();
    sources.clear();
    for (const int v : of_face) {
      of_vertex.push_back(field.heights[v]);
      sources.push_back(field.source[v]);
    }
    RILIEVO_RETURN_IF_ERROR(heights->Write(part.sub.faces[f], of_vertex, sources));
  }
  return absl::OkStatus();
}

DisplacementField NoHeights(int64_t vertices) {
  DisplacementField field;
  field.heights.assign(static_cast<size_t>(vertices), 0.0f);
  field.source.assign(static_cast<size_t>(vertices), HeightSource::kFilled);
  return field;
}

absl::Status MeasurePart(const PagedScan& scan, const Whole& whole, const std::vector<int>& members,
                         const ReconstructOptions& options, const RunContext& context,
                         ScratchHeights* heights) {
  const Box in_scan = BoxOf(members, whole);
  const SpatialFrame& frame = whole.coarse.frame;
  const Box box(frame.UnitFromScan(in_scan.min()), frame.UnitFromScan(in_scan.max()));
  RILIEVO_ASSIGN_OR_RETURN(Eigen::Matrix3Xd points, scan.PointsIn(in_scan, context));
  for (auto point : points.colwise()) point = frame.UnitFromScan(point);
  RILIEVO_ASSIGN_OR_RETURN(const OrientedCloud cloud,
                           AnalyzeBlock(std::move(points), scan.size(), whole, options, context));
  const Part part = CutPart(whole, members, box);
  const ControlMesh& mesh = part.sub.mesh;
  RILIEVO_ASSIGN_OR_RETURN(const LoopRefinement refinement,
                           RefineToVertices(mesh, whole.level, context));
  RILIEVO_ASSIGN_OR_RETURN(const LimitSurface limit,
                           EvaluateLimit(refinement, mesh.vertices, whole.level, context));
  DisplacementField field = NoHeights(limit.positions.cols());
  if (cloud.points.cols() > 0) {
    const VertexRings control_rings = BuildVertexRings(refinement.levels.front());
    const LevelRings rings = whole.level == 0
                                 ? LevelRings(control_rings)
                                 : LevelRings::After(refinement.levels[whole.level - 1]);
    RILIEVO_ASSIGN_OR_RETURN(
        field, SampleDisplacement(cloud, refinement, rings, limit, options.displacement, context));
  }
  return WritePart(part, FaceVertices(refinement.levels.front(), whole.level), field, heights);
}

}  // namespace

absl::StatusOr<ScratchHeights> MeasureHeightsFromPages(
    const PagedScan& scan, const ScanSurface& coarse, const DisplacedSurface& surface,
    const PartCutter& cutter, int level, int64_t part_points, const ReconstructOptions& options,
    const PipelineContext& context) {
  const StageScope scope(Stage::kDisplacement, context);
  const MeshTopology& topology = cutter.topology();
  RILIEVO_ASSIGN_OR_RETURN(ScratchHeights heights,
                           ScratchHeights::Create(scan.scratch_folder(), topology, level));
  const Whole whole{coarse, surface.control_mesh,           cutter, topology,
                    level,  ReachOfFaces(topology, surface)};
  const std::vector<std::vector<int>> parts = Partition(scan, whole, part_points).Run();
  const PipelineContext silent = context.Silent();
  for (size_t part = 0; part < parts.size(); ++part) {
    RILIEVO_RETURN_IF_ERROR(MeasurePart(scan, whole, parts[part], options, silent, &heights));
    ReleaseToOsAfter(scan.size());
    context.Report(Stage::kDisplacement,
                   static_cast<double>(part + 1) / static_cast<double>(parts.size()));
  }
  RILIEVO_RETURN_IF_ERROR(heights.Finish());
  return heights;
}

}  // namespace rilievo
