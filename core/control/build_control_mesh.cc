#include "core/control/build_control_mesh.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/ablation.h"
#include "core/base/quantile.h"
#include "core/base/status_macros.h"
#include "core/control/arbitrary_control_mesh.h"
#include "core/control/choose_topology.h"
#include "core/control/planar/planar_control_mesh.h"
#include "core/control/settings.h"
#include "core/control/spherical/spherical_control_mesh.h"
#include "core/control/topology/bridge_gaps.h"
#include "core/control/topology/close_holes.h"
#include "core/control/topology/trim_surface.h"
#include "core/control/user_control_mesh.h"
#include "core/geometry/mesh_topology.h"

namespace rilievo {
namespace {

absl::StatusOr<TopologyChoice> Choose(const OrientedCloud& cloud, const ControlOptions& options,
                                      const RunContext& context) {
  if (options.user_mesh) return TopologyChoice{Topology::kUser, "a control mesh was given"};
  if (options.topology == Topology::kAuto) return ChooseTopology(cloud, context);
  return TopologyChoice{options.topology, absl::StrCat("topology ", TopologyName(options.topology),
                                                       " was asked for")};
}

// A star that is chosen here and not asked for closes nothing that an open scan leaves open.
absl::Status CheckStarHasNoOpenings(const OrientedCloud& cloud, const PointIndex& index,
                                    const RunContext& context) {
  RILIEVO_ASSIGN_OR_RETURN(
      const ControlMesh star,
      SphericalControlMesh(cloud, static_cast<int>(cloud.points.cols()), context));
  RILIEVO_ASSIGN_OR_RETURN(const ControlMesh trimmed,
                           TrimSurface(star, cloud, index, BoundaryRule::kKeep, context));
  if (trimmed.faces.cols() == star.faces.cols()) return absl::OkStatus();
  return absl::FailedPreconditionError(
      "it would close openings of the scan, which boundary keep leaves open");
}

// Of a topology that leaves the cloud as it is: any but kArbitrary.
absl::StatusOr<ControlMesh> RegularMesh(Topology topology, const OrientedCloud& cloud,
                                        const PointIndex& index, const SpatialFrame& frame,
                                        const ControlOptions& options, int target_faces,
                                        const RunContext& context) {
  if (topology == Topology::kPlanar) {
    return PlanarControlMesh(cloud, options.boundary, target_faces, context);
  }
  if (topology == Topology::kSpherical) {
    if (options.topology == Topology::kAuto && options.boundary == BoundaryRule::kKeep) {
      RILIEVO_RETURN_IF_ERROR(CheckStarHasNoOpenings(cloud, index, context));
    }
    return SphericalControlMesh(cloud, target_faces, context);
  }
  ControlMesh mesh = *options.user_mesh;
  for (auto vertex : mesh.vertices.colwise()) vertex = frame.UnitFromScan(vertex);
  return CheckUserControlMesh(mesh, cloud, context);
}

}  // namespace

int64_t TellingPoints(const OrientedCloud& cloud, int64_t points, double closer) {
  const size_t count = cloud.noise.size();
  if (count == 0 || IsLeftOut(Mechanism::kTellingPoints)) return points;
  double telling = 0;
  std::vector<float> ratios;
  for (size_t begin = 0; begin < count; begin += kBuildControlMesh.stretch) {
    const size_t end = std::min(count, begin + kBuildControlMesh.stretch);
    ratios.clear();
    for (size_t i = begin; i < end; ++i) ratios.push_back(cloud.noise[i] / cloud.spacing[i]);
    const double thick = std::max(1.0, Median(ratios) / closer);
    telling += static_cast<double>(end - begin) / std::pow(thick, 3);
  }
  const double share = telling / static_cast<double>(count);
  return std::max(std::min(points, kBuildControlMesh.telling_at_least),
                  static_cast<int64_t>(share * static_cast<double>(points)));
}

int DefaultControlFaces(int64_t points) {
  const int64_t usual =
      std::min(points / kBuildControlMesh.points_per_face, kBuildControlMesh.usual_faces);
  return static_cast<int>(
      std::clamp<int64_t>(std::max(usual, points / kBuildControlMesh.many_points_per_face),
                          kBuildControlMesh.fewest_faces, kControlOptions.most_control_faces));
}

int UsefulControlFaces(int target_faces, int64_t points) {
  return static_cast<int>(std::min<int64_t>(
      target_faces,
      std::max(kBuildControlMesh.fewest_faces, kBuildControlMesh.most_faces_per_point * points)));
}

int ControlFacesFor(const ControlOptions& options, const OrientedCloud& cloud) {
  return options.target_faces > 0
             ? UsefulControlFaces(options.target_faces, cloud.points.cols())
             : DefaultControlFaces(TellingPoints(cloud, cloud.points.cols(), 1));
}

absl::Status AddTopologyFigures(ControlMeshResult* result) {
  const TopologySummary summary =
      SummarizeTopology(result->mesh.faces, static_cast<int>(result->mesh.vertices.cols()));
  if (!summary.manifold() || !summary.oriented) {
    return absl::InternalError(
        absl::StrCat("topology ", TopologyName(result->topology),
                     " made a control mesh that is not an oriented manifold"));
  }
  result->components = static_cast<int>(summary.components);
  result->boundary_loops = static_cast<int>(summary.boundary_loops);
  result->genus = static_cast<int>(summary.genus);
  return absl::OkStatus();
}

absl::StatusOr<ControlMeshResult> BuildControlMesh(OrientedCloud cloud, NeighborGraph graph,
                                                   const PointIndex& index,
                                                   const SpatialFrame& frame,
                                                   const ControlOptions& options,
                                                   const RunContext& context) {
  RILIEVO_RETURN_IF_ERROR(options.Validate());
  RILIEVO_RETURN_IF_ERROR(context.CheckStop());
  context.Report(Stage::kControlMesh, 0);
  RILIEVO_ASSIGN_OR_RETURN(const TopologyChoice choice, Choose(cloud, options, context));
  ControlMeshResult result;
  result.topology = choice.topology;
  result.reason = choice.reason;
  const int target_faces = ControlFacesFor(options, cloud);
  if (result.topology != Topology::kArbitrary) {
    auto mesh = RegularMesh(result.topology, cloud, index, frame, options, target_faces, context);
    const bool may_fall_back = options.topology == Topology::kAuto && !options.user_mesh;
    if (absl::IsFailedPrecondition(mesh.status()) && may_fall_back) {
      result.reason = absl::StrCat("arbitrary after ", TopologyName(result.topology),
                                   " was tried: ", mesh.status().message());
      result.topology = Topology::kArbitrary;
    } else {
      RILIEVO_ASSIGN_OR_RETURN(result.mesh, std::move(mesh));
    }
  }
  if (result.topology == Topology::kArbitrary) {
    RILIEVO_ASSIGN_OR_RETURN(
        ArbitraryMesh made,
        ArbitraryControlMesh(std::move(cloud), std::move(graph), index, options.boundary,
                             options.creases, target_faces, context));
    result.mesh = std::move(made.mesh);
    cloud = std::move(made.cloud);
  }
  result.cloud = std::move(cloud);
  if (options.bridge_gaps_below > 0) {
    RILIEVO_ASSIGN_OR_RETURN(
        result.mesh, BridgeGaps(std::move(result.mesh), options.bridge_gaps_below, context));
  }
  if (options.close_holes_below > 0) {
    RILIEVO_ASSIGN_OR_RETURN(
        result.mesh, CloseHoles(std::move(result.mesh), options.close_holes_below, context));
  }
  RILIEVO_RETURN_IF_ERROR(AddTopologyFigures(&result));
  context.Report(Stage::kControlMesh, 1);
  return result;
}

}  // namespace rilievo
