#include <cmath>
#include <numbers>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/base/run_concurrently.h"
#include "core/base/status_macros.h"
#include "core/control/creases/line_corners.h"
#include "core/control/creases/sharp_edges.h"
#include "core/control/settings.h"
#include "core/control/shape_control_mesh.h"
#include "core/control/topology/bridge_gaps.h"
#include "core/control/topology/close_holes.h"
#include "core/geometry/mesh_topology.h"
#include "core/loop/crease_topology.h"
#include "core/meshes/scan_of_mesh.h"
#include "core/meshes/split_edges.h"
#include "core/pipeline/certificate.h"
#include "core/pipeline/option_lengths.h"
#include "core/pipeline/settings.h"
#include "core/pipeline/shape_input.h"
#include "core/points/settings.h"

namespace rilievo {
namespace {

absl::Status CheckMeshOptions(const ReconstructOptions& options) {
  if (options.control.topology != Topology::kAuto || options.control.user_mesh) {
    return absl::InvalidArgumentError(
        "topology: a mesh has a topology and a control mesh of its own; leave it auto");
  }
  if (options.control.boundary == BoundaryRule::kClose) {
    return absl::InvalidArgumentError(
        "boundary: a mesh keeps its borders; leave it keep or exact, and close them in the mesh");
  }
  return absl::OkStatus();
}

std::vector<Rgb> ColorsOfVertices(const CheckedMesh& mesh, const std::vector<Rgb>& given) {
  std::vector<Rgb> colors;
  if (given.empty()) return colors;
  colors.reserve(mesh.source_vertex.size());
  for (const int source : mesh.source_vertex) colors.push_back(given[source]);
  return colors;
}

// The ends of its creases, two columns each.
Eigen::Matrix3Xd LinesOf(const ControlMesh& mesh) {
  Eigen::Matrix3Xd ends(3, static_cast<Eigen::Index>(2 * mesh.creases.size()));
  Eigen::Index column = 0;
  for (const Crease& crease : mesh.creases) {
    for (const int v : {crease.a, crease.b}) ends.col(column++) = mesh.vertices.col(v);
  }
  return ends;
}

// The edges of its borders likewise; where a border turns sharply, `*mesh` gets a corner.
absl::StatusOr<KnownBorders> BordersOf(double spacing, ControlMesh* mesh) {
  RILIEVO_ASSIGN_OR_RETURN(const MeshTopology topology,
                           BuildMeshTopology(mesh->faces, static_cast<int>(mesh->vertices.cols())));
  std::vector<int> ends, corners;
  for (const std::vector<int>& loop : BoundaryLoops(topology)) {
    for (size_t i = 0; i < loop.size(); ++i) {
      ends.push_back(loop[i]);
      ends.push_back(loop[(i + 1) % loop.size()]);
    }
    const CreaseChain line{loop, std::vector<int>(loop.size()), true};  // edges are not asked for
    for (const int i : CornersOfLine(mesh->vertices, line, kCommon.sharp_angle, spacing / 2)) {
      corners.push_back(i);
    }
  }
  mesh->corners.insert(mesh->corners.end(), corners.begin(), corners.end());
  SortTags(&mesh->creases, &mesh->corners);
  return KnownBorders{mesh->vertices(Eigen::all, ends), mesh->vertices(Eigen::all, corners)};
}

// What is known of its sharp lines goes into the cloud of the scan.
absl::StatusOr<ControlMeshResult> ControlOfMesh(CheckedMesh mesh, ScanSurface* scan,
                                                const ControlOptions& options,
                                                const RunContext& context) {
  const int target_faces = ControlFacesFor(options, scan->cloud);
  const double area = std::numbers::pi / 4 * scan->cloud.median_spacing *
                      scan->cloud.median_spacing * static_cast<double>(scan->cloud.points.cols());
  const double share = area / (kShapeControlMesh.finer_than_control * target_faces);
  const double edge = std::sqrt(4 / std::numbers::sqrt3 * share);
  ControlMesh shape{std::move(mesh.vertices), std::move(mesh.triangles)};
  RILIEVO_ASSIGN_OR_RETURN(
      shape,
      SplitLongEdges(std::move(shape), kShapeMesh.longest_edge * edge,
                     kShapeMesh.needle_pieces * kShapeControlMesh.finer_than_control * target_faces,
                     context));
  if (options.creases == CreaseRule::kAuto) {
    RILIEVO_RETURN_IF_ERROR(TagSharpEdges(scan->cloud.median_spacing, context, &shape));
    scan->cloud.sharp_lines = LinesOf(shape);
  }
  if (options.boundary == BoundaryRule::kExact) {
    RILIEVO_ASSIGN_OR_RETURN(scan->borders, BordersOf(scan->cloud.median_spacing, &shape));
  }
  context.Report(Stage::kControlMesh, 0.3);
  ControlMeshResult control;
  control.topology = Topology::kMesh;
  control.reason = "a mesh was given";
  RILIEVO_ASSIGN_OR_RETURN(
      control.mesh, ShapeControlMesh(std::move(shape), scan->cloud, scan->index, options.creases,
                                     target_faces, kShapeMesh.border_weight, context));
  if (options.bridge_gaps_below > 0) {
    RILIEVO_ASSIGN_OR_RETURN(
        control.mesh, BridgeGaps(std::move(control.mesh), options.bridge_gaps_below, context));
  }
  if (options.close_holes_below > 0) {
    RILIEVO_ASSIGN_OR_RETURN(
        control.mesh, CloseHoles(std::move(control.mesh), options.close_holes_below, context));
  }
  RILIEVO_RETURN_IF_ERROR(AddTopologyFigures(&control));
  context.Report(Stage::kControlMesh, 1);
  return control;
}

}  // namespace

absl::StatusOr<ShapedInput> ShapeMesh(const PointCloud& mesh, PointCloud* spent,
                                      const ReconstructOptions& options,
                                      const PipelineContext& context) {
  RILIEVO_RETURN_IF_ERROR(CheckMeshOptions(options));
  RILIEVO_RETURN_IF_ERROR(CheckSights(mesh.sights, mesh.points.cols()));
  CheckedMesh checked;
  const auto check = [&]() -> absl::Status {
    const StageScope scope(Stage::kCheck, context);
    RILIEVO_ASSIGN_OR_RETURN(checked, CheckMesh(mesh, context));
    return absl::OkStatus();
  };
  std::string hash;
  const auto make_hash = [&]() -> absl::Status {
    hash = HashOfScan(mesh);
    return absl::OkStatus();
  };
  RILIEVO_RETURN_IF_ERROR(RunConcurrently(context, check, make_hash));
  const std::vector<Rgb> colors = ColorsOfVertices(checked, mesh.sights.colors);
  if (spent != nullptr) *spent = PointCloud();
  const MeshFigures figures = checked.figures;
  RILIEVO_ASSIGN_OR_RETURN(ReconstructOptions fractions,
                           WithoutLengths(options, checked.frame.diagonal));
  std::optional<StageScope> scope(std::in_place, Stage::kNeighbors, context);
  // A level that is asked for is one over so many control faces as callers can tell.
  const int64_t points =
      options.max_level
          ? FewestPointsOnMesh(checked.triangles.cols())
          : PointsOnMesh(checked, fractions.encode.max_error.value_or(kShapeMesh.most_sagitta));
  RILIEVO_ASSIGN_OR_RETURN(ScanSurface scan, ScanOfMesh(checked, colors, points, context));
  Shape given_mesh{checked.vertices, checked.triangles};
  scope.emplace(Stage::kControlMesh, context);
  RILIEVO_ASSIGN_OR_RETURN(ControlMeshResult control,
                           ControlOfMesh(std::move(checked), &scan, fractions.control, context));
  return ShapedInput{std::move(scan), std::move(control),   std::move(fractions), std::move(hash),
                     figures,         std::move(given_mesh)};
}

}  // namespace rilievo
