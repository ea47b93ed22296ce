#include "core/pipeline/heights_from_pages.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numeric>
#include <set>
#include <utility>
#include <vector>

#include "core/base/status_macros.h"
#include "core/displacement/sample_displacement.h"
#include "core/loop/face_vertices.h"
#include "core/loop/level_rings.h"
#include "core/loop/refinement.h"
#include "core/loop/sub_mesh.h"
#include "core/paging/part_journal.h"
#include "core/pipeline/block_surfels.h"
#include "core/pipeline/sample_heights.h"

namespace rilievo {
namespace {

// Points this far beyond what a part may reach still tell of its heights: of the coarse points'
// spacings (heights of a block agree with those of the whole from eight spacings of all points on).
constexpr double kHaloSpacings = 8;

using Box = Eigen::AlignedBox3d;

// What no part changes.
struct Whole {
  const PagedScan& scan;
  const ScanSurface& coarse;
  const ControlMesh& mesh;
  const PartCutter& cutter;
  const MeshTopology& topology;
  const ReconstructOptions& options;
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

// The box that the points of these faces are read from; unit frame.
Box BoxOf(const std::vector<int>& members, const Whole& whole) {
  Box box;
  for (const int f : members) box.extend(whole.reach[f]);
  const double halo = kHaloSpacings * whole.coarse.cloud.median_spacing;
  box.min().array() -= halo;
  box.max().array() += halo;
  return box;
}

Box InScan(const Box& box, const SpatialFrame& frame) {
  return Box(frame.ScanFromUnit(box.min()), frame.ScanFromUnit(box.max()));
}

// Control faces in parts, each within pages of at most `most` points where halving them comes to
// that.
class Partition {
 public:
  Partition(const Whole& whole, int64_t most) : whole_(whole), most_(most) {}

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
    for (const Page& page : whole_.scan.pages()) pages += box.intersects(page.box);
    return pages * kPagePoints;
  }

  double MiddleOf(int face, int axis) const {
    const auto corners = whole_.topology.faces.col(face);
    return whole_.mesh.vertices(axis, corners[0]) + whole_.mesh.vertices(axis, corners[1]) +
           whole_.mesh.vertices(axis, corners[2]);
  }

  int64_t PointsOf(const std::vector<int>& members) const {
    return PointsAround(InScan(BoxOf(members, whole_), whole_.coarse.frame));
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

  const Whole& whole_;
  int64_t most_;
  std::vector<std::vector<int>> parts_;
};

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

absl::Status MeasureFaces(const Whole& whole, const std::vector<int>& members, const Box& box,
                          const OrientedCloud& cloud, const RunContext& context,
                          ScratchHeights* heights) {
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
    RILIEVO_ASSIGN_OR_RETURN(field, SampleDisplacement(cloud, refinement, rings, limit,
                                                       whole.options.displacement, context));
  }
  return WritePart(part, FaceVertices(refinement.levels.front(), whole.level), field, heights);
}

// Part `part`, whose control faces are `members`. `boxes`: of all parts. The checksum of its
// surfels.
absl::StatusOr<uint64_t> MeasurePart(const Whole& whole, const std::vector<int>& members,
                                     size_t part, const std::vector<Box>& boxes,
                                     const RunContext& context, MeasuredPages* measured) {
  const SpatialFrame& frame = whole.coarse.frame;
  OrientedCloud cloud;
  uint64_t sum = 0;
  {
    std::vector<int64_t> ranks;
    RILIEVO_ASSIGN_OR_RETURN(Eigen::Matrix3Xd points,
                             whole.scan.PointsIn(InScan(boxes[part], frame), context, &ranks));
    for (auto point : points.colwise()) point = frame.UnitFromScan(point);
    const std::vector<uint8_t> own = PointsToTellOf(points, part, boxes);
    RILIEVO_ASSIGN_OR_RETURN(
        AnalyzedBlock block,
        AnalyzeBlock(points, whole.scan.size(), whole.coarse, whole.options, context));
    if (block.cloud.points.cols() > 0) {
      RILIEVO_ASSIGN_OR_RETURN(sum, WriteSurfels(block, part, own, ranks, &measured->surfels));
    }
    cloud = std::move(block.cloud);
  }
  RILIEVO_RETURN_IF_ERROR(
      MeasureFaces(whole, members, boxes[part], cloud, context, &measured->heights));
  return sum;
}

// Parts that an earlier run has finished, and whose heights and surfels are as they were.
absl::StatusOr<std::set<int>> PartsThatAreThere(const PartJournal& journal,
                                                const std::vector<std::vector<int>>& parts,
                                                MeasuredPages* measured) {
  if (journal.finished().empty()) return std::set<int>();
  RILIEVO_ASSIGN_OR_RETURN(std::set<int> there, measured->surfels.Adopt(journal.finished()));
  std::erase_if(there, [&](int part) {
    if (part < 0 || static_cast<size_t>(part) >= parts.size()) return true;
    const std::vector<int>& members = parts[static_cast<size_t>(part)];
    return !std::all_of(members.begin(), members.end(),
                        [&](int face) { return measured->heights.Has(face); });
  });
  return there;
}

}  // namespace

absl::StatusOr<MeasuredPages> MeasureHeightsFromPages(
    const PagedScan& scan, const ScanSurface& coarse, const DisplacedSurface& surface,
    const PartCutter& cutter, int level, int64_t part_points, const ReconstructOptions& options,
    const PipelineContext& context) {
  const MeshTopology& topology = cutter.topology();
  RILIEVO_ASSIGN_OR_RETURN(ScratchHeights heights,
                           ScratchHeights::Create(scan.scratch_folder(), topology, level));
  RILIEVO_ASSIGN_OR_RETURN(ScratchSurfels surfels, ScratchSurfels::Create(scan));
  MeasuredPages measured{std::move(heights), std::move(surfels), 0};
  const Whole whole{scan,    coarse, surface.control_mesh,           cutter, topology,
                    options, level,  ReachOfFaces(topology, surface)};
  const std::vector<std::vector<int>> parts = Partition(whole, part_points).Run();
  std::vector<Box> boxes;
  for (const std::vector<int>& members : parts) boxes.push_back(BoxOf(members, whole));
  const PipelineContext silent = context.Silent();
  RILIEVO_ASSIGN_OR_RETURN(PartJournal journal, PartJournal::Open(scan.scratch_folder()));
  RILIEVO_ASSIGN_OR_RETURN(const std::set<int> there, PartsThatAreThere(journal, parts, &measured));
  size_t done = there.size();
  const auto share_done = [&] {
    return static_cast<double>(done) / static_cast<double>(parts.size());
  };
  const StageScope scope(Stage::kDisplacement, context, share_done());
  for (size_t part = 0; part < parts.size(); ++part) {
    if (there.count(static_cast<int>(part)) != 0) continue;
    RILIEVO_ASSIGN_OR_RETURN(const uint64_t sum,
                             MeasurePart(whole, parts[part], part, boxes, silent, &measured));
    RILIEVO_RETURN_IF_ERROR(journal.Add(static_cast<int>(part), sum));
    ReleaseToOsAfter(scan.size());
    ++done;
    context.Report(Stage::kDisplacement, share_done());
  }
  RILIEVO_RETURN_IF_ERROR(measured.heights.Finish());
  RILIEVO_ASSIGN_OR_RETURN(measured.points_of_surface,
                           CompleteSurfels(scan, coarse, silent, &measured.surfels));
  return measured;
}

}  // namespace rilievo
