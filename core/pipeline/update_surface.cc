#include "core/pipeline/update_surface.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <set>
#include <utility>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "core/base/quantile.h"
#include "core/base/status_macros.h"
#include "core/codec/container/dss.h"
#include "core/codec/container/encode_update.h"
#include "core/codec/container/open_dss.h"
#include "core/displacement/sample_displacement.h"
#include "core/geometry/vertex_normals.h"
#include "core/loop/face_vertices.h"
#include "core/loop/level_rings.h"
#include "core/loop/refinement.h"
#include "core/pipeline/analyze_block.h"
#include "core/pipeline/certificate.h"
#include "core/pipeline/code_surface.h"
#include "core/pipeline/points_on_surface.h"
#include "core/pipeline/settings.h"
#include "core/scan/scan_surface.h"
#include "core/surface/stored_surface.h"

namespace rilievo {
namespace {

// What no step changes.
struct Updated {
  OpenedDss file;
  DisplacedSurface surface;          // before
  std::vector<int64_t> chunk_bytes;  // as decoded
  Shape triangles;                   // of its finest level
  MeshTopology control;
};

absl::StatusOr<Updated> OpenUpdated(std::span<const uint8_t> dss, int64_t most_vertices,
                                    const RunContext& context) {
  const auto check_count = [&](int64_t vertices) {
    return vertices <= most_vertices ? absl::OkStatus()
                                     : absl::InvalidArgumentError(absl::StrCat(
                                           "the surface has ", vertices, " vertices or more, and ",
                                           most_vertices, " are announced"));
  };
  // Before anything is made of the control mesh.
  RILIEVO_ASSIGN_OR_RETURN(const DssHeader header, ReadDssHeader(dss));
  RILIEVO_RETURN_IF_ERROR(check_count(header.vertex_count));
  Updated opened;
  RILIEVO_ASSIGN_OR_RETURN(opened.file, OpenDss(dss, /*check_groups=*/false));
  RILIEVO_RETURN_IF_ERROR(check_count(VertexCountAt(opened.file.topology, header.max_level)));
  RILIEVO_RETURN_IF_ERROR(CheckUpdatedFile(opened.file));
  RILIEVO_ASSIGN_OR_RETURN(DecodedSurface decoded, DecodeDss(dss, context));
  opened.surface = std::move(decoded.surface);
  opened.chunk_bytes = std::move(decoded.chunk_bytes);
  opened.control = opened.file.topology;
  RILIEVO_ASSIGN_OR_RETURN(opened.triangles, FinestTriangles(opened.surface, context));
  return opened;
}

// What the file states of its scan tells, a standard deviation.
double ErrorOfSurface(const OpenedDss& file, double noise) {
  const DssDistance& stated = file.header.metadata.scan_to_surface;
  const double error = std::max(stated.rms, stated.p95 / 2);
  return std::max(ErrorUnderNoise(error, noise, kUpdateSurface.leverage), HeightStepOf(file));
}

absl::Status CheckPlace(const PointsOnSurface& points, double max_height) {
  const float middle = Median(points.away);
  if (middle <= max_height) return absl::OkStatus();
  return absl::FailedPreconditionError(absl::StrFormat(
      "half of the scan's points lie %.3g or more of the diagonal away from the surface, whose "
      "heights reach %.3g; bring the scan into the frame and unit of the surface (rilievo align), "
      "or reconstruct it anew",
      middle, max_height));
}

// By vertex, 1 where a triangle of a marked patch touches it.
std::vector<uint8_t> VerticesOf(const std::vector<uint8_t>& patches, int triangles_each,
                                const Shape& surface) {
  std::vector<uint8_t> marked(surface.vertices.cols(), 0);
  for (Eigen::Index t = 0; t < surface.triangles.cols(); ++t) {
    if (patches[t / triangles_each] == 0) continue;
    for (const int v : surface.triangles.col(t)) marked[v] = 1;
  }
  return marked;
}

// The patches that touch marked ones, these among them.
std::vector<uint8_t> Dilated(const std::vector<uint8_t>& patches, int triangles_each,
                             const Shape& surface) {
  const std::vector<uint8_t> marked = VerticesOf(patches, triangles_each, surface);
  std::vector<uint8_t> wider = patches;
  for (Eigen::Index t = 0; t < surface.triangles.cols(); ++t) {
    for (const int v : surface.triangles.col(t)) wider[t / triangles_each] |= marked[v];
  }
  return wider;
}

// By vertex, 1 where all its triangles lie in marked patches.
std::vector<uint8_t> InnerVertices(std::vector<uint8_t> patches, int triangles_each,
                                   const Shape& surface) {
  for (uint8_t& patch : patches) patch = patch == 0;
  std::vector<uint8_t> inner = VerticesOf(patches, triangles_each, surface);
  for (uint8_t& vertex : inner) vertex = vertex == 0;
  return inner;
}

// How much of the new height a vertex gets: from none outside to all of it at `edges` edges from
// there.
std::vector<float> WeightsWithin(const std::vector<uint8_t>& inner, int edges,
                                 const Shape& surface) {
  std::vector<int> depth(inner.size(), edges + 1);
  for (size_t v = 0; v < inner.size(); ++v) {
    if (inner[v] == 0) depth[v] = 0;
  }
  for (int step = 0; step <= edges; ++step) {
    for (const auto triangle : surface.triangles.colwise()) {
      const int least = std::min({depth[triangle[0]], depth[triangle[1]], depth[triangle[2]]});
      if (least != step) continue;
      for (const int v : triangle) depth[v] = std::min(depth[v], step + 1);
    }
  }
  std::vector<float> weights;
  for (const int d : depth) {
    weights.push_back(static_cast<float>(d) / static_cast<float>(edges + 1));
  }
  return weights;
}

// The control faces that triangles of marked patches lie on, ascending.
std::vector<int> FacesUnder(const std::vector<uint8_t>& patches, int triangles_each,
                            const Shape& surface) {
  std::set<int> faces;
  for (size_t p = 0; p < patches.size(); ++p) {
    if (patches[p] == 0) continue;
    faces.insert(static_cast<int>(p) * triangles_each / surface.children_per_face);
  }
  return {faces.begin(), faces.end()};
}

// The points over some control faces, with what the scan stages know of them; none where they are
// too few to tell anything. The side of each is that of the triangle under it.
absl::StatusOr<OrientedCloud> AnalyzeOver(const std::vector<int>& faces,
                                          const PointsOnSurface& points, const Shape& surface,
                                          const RunContext& context) {
  std::vector<uint8_t> wanted(surface.triangles.cols() / surface.children_per_face, 0);
  for (const int face : faces) wanted[face] = 1;
  std::vector<int> chosen;
  for (size_t i = 0; i < points.triangle.size(); ++i) {
    if (wanted[points.triangle[i] / surface.children_per_face] != 0) {
      chosen.push_back(static_cast<int>(i));
    }
  }
  PointCloud block;
  block.points = points.points(Eigen::all, chosen);
  block.sights.normals.resize(3, static_cast<Eigen::Index>(chosen.size()));
  for (size_t i = 0; i < chosen.size(); ++i) {
    const int triangle = points.triangle[chosen[i]];
    block.sights.normals.col(static_cast<Eigen::Index>(i)) =
        FaceCross(surface.vertices, surface.triangles, triangle).normalized().cast<float>();
  }
  ScanOptions options;
  options.sights = {SightRule::kIgnore, SightRule::kUse};
  // Islands are as small as they would have to be in the whole.
  options.outliers.min_component_share = std::min(
      0.1, options.outliers.min_component_share * static_cast<double>(points.points.cols()) /
               static_cast<double>(std::max<size_t>(1, chosen.size())));
  absl::StatusOr<CheckedScan> checked = CheckScan(block, CheckOptions(), context);
  if (absl::IsInvalidArgument(checked.status())) return OrientedCloud();
  RILIEVO_RETURN_IF_ERROR(checked.status());
  block = PointCloud();
  absl::StatusOr<ScanSurface> analyzed = AnalyzeScan(*std::move(checked), options, context);
  if (absl::IsInvalidArgument(analyzed.status())) return OrientedCloud();
  RILIEVO_RETURN_IF_ERROR(analyzed.status());
  return CloudInScanFrame(*std::move(analyzed));
}

// Heights of the points over the vertices of some control faces.
struct HeightsAnew {
  DisplacementField field;
  std::vector<int> vertex_of;  // of the whole, each vertex of the field; -1 outside of the faces
};

absl::StatusOr<HeightsAnew> MeasureAnew(const Updated& updated, const std::vector<int>& faces,
                                        const PointsOnSurface& points, const RunContext& context) {
  const DisplacedSurface& surface = updated.surface;
  const int level = surface.max_level;
  RILIEVO_ASSIGN_OR_RETURN(const PartCutter cutter,
                           PartCutter::Make(surface.control_mesh, updated.control));
  const SubMesh sub = cutter.Cut(faces, kUpdateSurface.rings);
  RILIEVO_ASSIGN_OR_RETURN(const OrientedCloud cloud,
                           AnalyzeOver(sub.faces, points, updated.triangles, context));
  if (cloud.points.cols() == 0) return HeightsAnew();
  RILIEVO_ASSIGN_OR_RETURN(const LoopRefinement refinement,
                           RefineToVertices(sub.mesh, level, context));
  const VertexRings control_rings = BuildVertexRings(refinement.levels.front());
  const LevelRings rings =
      level == 0 ? LevelRings(control_rings) : LevelRings::After(refinement.levels[level - 1]);
  RILIEVO_ASSIGN_OR_RETURN(const LimitSurface limit,
                           EvaluateLimit(refinement, sub.mesh.vertices, level, context));
  HeightsAnew anew;
  RILIEVO_ASSIGN_OR_RETURN(anew.field, SampleDisplacement(cloud, refinement, rings, limit,
                                                          DisplacementOptions(), context));
  anew.vertex_of = VerticesThere(FaceVertices(refinement.levels.front(), level),
                                 FaceVertices(updated.control, level), sub.faces);
  return anew;
}

// Where nothing of the scan lies on or beside a patch, its heights are measured no more.
void FillUnseen(const ScannedPatches& patches, const Shape& surface, HeightUpdate* update) {
  std::vector<uint8_t> unseen = Dilated(patches.seen, patches.triangles_each, surface);
  for (uint8_t& patch : unseen) patch = patch == 0;
  const std::vector<uint8_t> inner = InnerVertices(unseen, patches.triangles_each, surface);
  for (size_t v = 0; v < inner.size(); ++v) {
    if (inner[v] == 0 || update->told[v] != 0 || update->sources[v] == HeightSource::kFilled) {
      continue;
    }
    update->told[v] = 1;
    update->sources[v] = HeightSource::kFilled;
  }
}

// Heights and sources of `anew` where patches are contradicted, and around.
void TakeAnew(const HeightsAnew& anew, const ScannedPatches& patches,
              const std::vector<uint8_t>& around, const Shape& surface, HeightUpdate* update) {
  const int each = patches.triangles_each;
  const std::vector<uint8_t> inner = InnerVertices(around, each, surface);
  const std::vector<uint8_t> core = VerticesOf(patches.contradicted, each, surface);
  const auto edges = static_cast<int>(std::lround(std::sqrt(each)));  // along a patch
  const std::vector<float> weights = WeightsWithin(inner, edges, surface);
  for (size_t i = 0; i < anew.vertex_of.size(); ++i) {
    const int v = anew.vertex_of[i];
    if (v < 0 || inner[v] == 0) continue;
    // Around the places, what the scan does not show stays.
    if (anew.field.source[i] == HeightSource::kFilled && core[v] == 0) continue;
    float& height = update->heights[v];
    height += weights[v] * (anew.field.heights[i] - height);
    update->told[v] = 1;
    update->sources[v] = anew.field.source[i];
  }
}

absl::Status CheckReached(const std::vector<uint8_t>& contradicting, const PointsOnSurface& before,
                          const PointsOnSurface& after, double most) {
  int64_t all = 0, unreached = 0;
  for (size_t i = 0; i < contradicting.size(); ++i) {
    if (contradicting[i] == 0 || std::abs(before.across[i]) <= most) continue;
    ++all;
    unreached += std::abs(after.across[i]) > most ? 1 : 0;
  }
  if (static_cast<double>(unreached) <= kUpdateSurface.most_unreached * static_cast<double>(all)) {
    return absl::OkStatus();
  }
  return absl::FailedPreconditionError(absl::StrFormat(
      "%d of %d points that contradict the surface lie where its heights do not reach (5 %% of the "
      "diagonal, less where it is curved); reconstruct it anew from a whole scan",
      unreached, all));
}

// The triangles of marked patches alone.
Shape PartOf(const Shape& surface, const std::vector<uint8_t>& patches, int triangles_each) {
  std::vector<int> chosen;
  for (int t = 0; t < surface.triangles.cols(); ++t) {
    if (patches[t / triangles_each] != 0) chosen.push_back(t);
  }
  return {surface.vertices, surface.triangles(Eigen::all, chosen)};
}

int GroupsWith(const std::vector<uint8_t>& told, const Updated& updated) {
  const FaceGroups& groups = updated.file.groups;
  const Shape& surface = updated.triangles;
  std::set<int> changed;
  for (Eigen::Index t = 0; t < surface.triangles.cols() && groups.count() > 0; ++t) {
    for (const int v : surface.triangles.col(t)) {
      if (told[v] != 0) changed.insert(groups.group_of[t / surface.children_per_face]);
    }
  }
  return static_cast<int>(changed.size());
}

}  // namespace

absl::StatusOr<SurfaceUpdate> UpdateSurface(std::span<const uint8_t> dss, const PointCloud& scan,
                                            const UpdateOptions& options,
                                            const RunContext& context) {
  context.Report(Stage::kNeighbors, 0);
  RILIEVO_ASSIGN_OR_RETURN(Updated updated, OpenUpdated(dss, options.most_vertices, context));
  const DisplacedSurface& surface = updated.surface;
  const Shape& triangles = updated.triangles;
  RILIEVO_ASSIGN_OR_RETURN(PointsOnSurface points,
                           LayOnSurface(scan, surface.frame, triangles, context));
  RILIEVO_RETURN_IF_ERROR(CheckPlace(points, DisplacementOptions().max_height));
  SurfaceUpdate result;
  UpdateReport& report = result.report;
  report.points = points.points.cols();
  report.non_finite = points.non_finite;
  report.noise = points.noise;
  report.before = report.after = SummaryOf(points.away);
  report.heights = static_cast<int64_t>(surface.heights.size());
  report.groups = updated.file.groups.count();
  const double error = ErrorOfSurface(updated.file, points.noise);
  const ScannedPatches patches = CompareWithSurface(points, triangles, error);
  const int each = patches.triangles_each;

  HeightUpdate update;
  update.told.resize(surface.heights.size(), 0);
  update.heights = surface.heights;
  update.sources = surface.sources;
  std::vector<uint8_t> around = patches.contradicted;
  for (int ring = 0; ring < kUpdateSurface.rings; ++ring) around = Dilated(around, each, triangles);
  const std::vector<int> faces = FacesUnder(around, each, triangles);
  context.Report(Stage::kDisplacement, 0);
  if (!faces.empty()) {
    RILIEVO_ASSIGN_OR_RETURN(const HeightsAnew anew, MeasureAnew(updated, faces, points, context));
    TakeAnew(anew, patches, around, triangles, &update);
  }
  if (options.whole) FillUnseen(patches, triangles, &update);
  report.heights_anew = std::count(update.told.begin(), update.told.end(), 1);
  if (report.heights_anew == 0) {
    result.dss.assign(dss.begin(), dss.end());
    result.chunk_bytes = std::move(updated.chunk_bytes);
    return result;
  }
  for (size_t v = 0; v < update.told.size(); ++v) {
    report.heights_filled += update.told[v] != 0 && update.sources[v] == HeightSource::kFilled;
  }
  report.groups_changed = GroupsWith(update.told, updated);
  const double step = HeightStepOf(updated.file);
  update.step = step > 0 ? std::min(step, kMaxStep) : kUpdateSurface.usual_step;
  update.generator = "rilievo " RILIEVO_VERSION;
  RILIEVO_ASSIGN_OR_RETURN(const std::vector<uint8_t> chunk,
                           EncodeUpdate(dss, surface, update, context));
  result.dss.assign(dss.begin(), dss.end());
  result.dss.insert(result.dss.end(), chunk.begin(), chunk.end());
  report.update_bytes = static_cast<int64_t>(chunk.size());

  // The bytes that go out are decoded, and held against the points once more.
  context.Report(Stage::kMeasure, 0);
  absl::StatusOr<DecodedSurface> decoded = DecodeDss(result.dss, context);
  if (absl::IsDataLoss(decoded.status())) {
    return absl::InternalError(
        absl::StrCat("the update does not decode: ", decoded.status().message()));
  }
  RILIEVO_RETURN_IF_ERROR(decoded.status());
  result.chunk_bytes = std::move(decoded->chunk_bytes);
  RILIEVO_ASSIGN_OR_RETURN(const Shape now, FinestTriangles(decoded->surface, context));
  std::vector<uint8_t> contradicting, again;
  for (const int triangle : points.triangle) {
    contradicting.push_back(patches.contradicted[triangle / each]);
    again.push_back(around[triangle / each]);
  }
  report.contradicting = std::count(contradicting.begin(), contradicting.end(), 1);
  PointsOnSurface after = points;
  const Shape there = PartOf(now, Dilated(around, each, triangles), each);
  RILIEVO_RETURN_IF_ERROR(LayAgain(there, again, context, &after));
  const double most = 3 * std::hypot(points.noise, error);
  RILIEVO_RETURN_IF_ERROR(CheckReached(contradicting, points, after, most));
  report.after = SummaryOf(after.away);
  return result;
}

}  // namespace rilievo
