#include "core/codec/container/deformed_surface.h"

#include <algorithm>
#include <array>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "core/codec/mesh/crease_coder.h"
#include "core/loop/crease_topology.h"

namespace rilievo {
namespace {

// About what a file can hold.
constexpr double kMostDiagonals = 1e6;
// Digits lost on the way through text, fraction of the diagonal.
constexpr double kDigitsLost = 1e-9;

using FaceCorners = std::array<int, 3>;

// The same for every corner that a face may begin with.
std::vector<FaceCorners> SortedFaces(const Eigen::Matrix3Xi& faces) {
  std::vector<FaceCorners> sorted;
  sorted.reserve(static_cast<size_t>(faces.cols()));
  for (const auto face : faces.colwise()) {
    FaceCorners corners = {face[0], face[1], face[2]};
    std::rotate(corners.begin(), std::min_element(corners.begin(), corners.end()), corners.end());
    sorted.push_back(corners);
  }
  std::sort(sorted.begin(), sorted.end());
  return sorted;
}

absl::Status CheckCage(const ControlMesh& cage, const SpatialFrame& frame,
                       const Eigen::Matrix3Xi& own) {
  const Eigen::Index vertex_count = own.maxCoeff() + 1;  // every vertex is used
  if (cage.vertices.cols() != vertex_count || cage.faces.cols() != own.cols()) {
    return absl::InvalidArgumentError(
        absl::StrCat("the cage has ", cage.vertices.cols(), " vertices and ", cage.faces.cols(),
                     " faces, the control mesh ", vertex_count, " and ", own.cols(),
                     "; vertices may move, but none may come or go"));
  }
  if (cage.faces != own) {
    const std::vector<FaceCorners> expected = SortedFaces(own), found = SortedFaces(cage.faces);
    const auto differ = std::mismatch(found.begin(), found.end(), expected.begin());
    if (differ.first != found.end()) {
      const FaceCorners& face = *differ.first;
      return absl::InvalidArgumentError(
          absl::StrCat("face (", face[0], ", ", face[1], ", ", face[2],
                       "), vertices counted from 0, is not a face of the control mesh; keep the "
                       "order of the vertices"));
    }
  }
  for (Eigen::Index v = 0; v < vertex_count; ++v) {
    if (!cage.vertices.col(v).allFinite()) {
      return absl::InvalidArgumentError(absl::StrCat("vertex ", v, " of the cage is not finite"));
    }
    const double diagonals =
        (cage.vertices.col(v) - frame.center).cwiseAbs().maxCoeff() / frame.diagonal;
    if (!(diagonals <= kMostDiagonals)) {
      return absl::InvalidArgumentError(absl::StrCat(
          "vertex ", v, " of the cage is ", diagonals,
          " diagonals of the surface away from it, at most ", kMostDiagonals, " are possible"));
    }
  }
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<ControlMesh> ControlMeshOfCage(const ControlMesh& cage, const SpatialFrame& frame,
                                              const Eigen::Matrix3Xi& own) {
  RILIEVO_RETURN_IF_ERROR(CheckCage(cage, frame, own));
  ControlMesh mesh = cage;
  mesh.faces = own;
  mesh.vertices = (cage.vertices.colwise() - frame.center) / frame.diagonal;
  for (Crease& crease : mesh.creases) {
    if (crease.sharpness > 0) crease.sharpness = StoredSharpness(crease.sharpness);
  }
  SortTags(&mesh.creases, &mesh.corners);
  return mesh;
}

Eigen::Matrix3Xd WithoutRounding(const Eigen::Matrix3Xd& moved, const Eigen::Matrix3Xd& own,
                                 double diagonal) {
  Eigen::Matrix3Xd kept = moved;
  if (moved.cols() != own.cols()) return kept;
  const double close = kDigitsLost * diagonal;
  for (Eigen::Index v = 0; v < own.cols(); ++v) {
    const Eigen::Array3d as_float = own.col(v).cast<float>().cast<double>();
    const Eigen::Array3d vertex = moved.col(v);
    const bool same =
        ((vertex - own.col(v).array()).abs() <= close || (vertex - as_float).abs() <= close).all();
    if (same) kept.col(v) = own.col(v);
  }
  return kept;
}

DssMetadata OfAnotherShape(const DssMetadata& metadata) {
  DssMetadata kept;
  kept.generator = metadata.generator;
  kept.measured_share = metadata.measured_share;
  kept.smoothed_share = metadata.smoothed_share;
  kept.filled_share = metadata.filled_share;
  kept.topology = metadata.topology;
  kept.options = metadata.options;
  kept.place = metadata.place;
  kept.colors = metadata.colors;
  kept.all_smoothed = metadata.all_smoothed;
  kept.plain_levels = metadata.plain_levels;
  return kept;
}

absl::StatusOr<DecodedSurface> WithControlMesh(const DecodedSurface& decoded,
                                               const ControlMesh& cage) {
  const DisplacedSurface& before = decoded.surface;
  DecodedSurface moved;
  DisplacedSurface& surface = moved.surface;
  RILIEVO_ASSIGN_OR_RETURN(surface.control_mesh,
                           ControlMeshOfCage(cage, before.frame, before.control_mesh.faces));
  surface.control_mesh.diagonals = before.control_mesh.diagonals;
  if (surface.control_mesh.creases != before.control_mesh.creases ||
      surface.control_mesh.corners != before.control_mesh.corners) {
    RILIEVO_ASSIGN_OR_RETURN(const MeshTopology topology,
                             BuildMeshTopology(cage.faces, static_cast<int>(cage.vertices.cols())));
    RILIEVO_RETURN_IF_ERROR(BuildCreaseTopology(surface.control_mesh, topology).status());
  }
  surface.frame = before.frame;
  surface.max_level = before.max_level;
  surface.heights = before.heights;
  surface.sources = before.sources;
  surface.colors = before.colors;
  moved.metadata = OfAnotherShape(decoded.metadata);
  moved.format_version = decoded.format_version;
  moved.declared_max_level = decoded.declared_max_level;
  return moved;
}

}  // namespace rilievo
