#include "core/codec/mesh/prepare_control_mesh.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "core/codec/bytes/stored_step.h"
#include "core/codec/mesh/border_coder.h"
#include "core/codec/mesh/control_mesh_coder.h"
#include "core/codec/mesh/crease_coder.h"
#include "core/codec/mesh/gate_geometry.h"

namespace rilievo {
namespace {

void RenumberTags(const ControlMesh& mesh, const std::vector<int>& number, ControlMesh& canonical) {
  const int count = static_cast<int>(number.size());
  const auto renumbered = [&](int v) { return v >= 0 && v < count ? number[v] : v; };
  for (const Crease& crease : mesh.creases) {
    const int a = renumbered(crease.a), b = renumbered(crease.b);
    canonical.creases.push_back({std::min(a, b), std::max(a, b), crease.sharpness});
  }
  std::sort(
      canonical.creases.begin(), canonical.creases.end(),
      [](const Crease& p, const Crease& q) { return std::pair(p.a, p.b) < std::pair(q.a, q.b); });
  for (int corner : mesh.corners) canonical.corners.push_back(renumbered(corner));
  std::sort(canonical.corners.begin(), canonical.corners.end());
  for (const auto& [first, second] : mesh.diagonals) {
    const auto [a, b] = std::minmax({renumbered(first), renumbered(second)});
    canonical.diagonals.push_back({a, b});
  }
  std::sort(canonical.diagonals.begin(), canonical.diagonals.end());
}

}  // namespace

absl::StatusOr<ControlMesh> CanonicalControlMesh(const ControlMesh& mesh) {
  RILIEVO_ASSIGN_OR_RETURN(const MeshTopology topology,
                           BuildMeshTopology(mesh.faces, static_cast<int>(mesh.vertices.cols())));
  const CodingOrder order = FindCodingOrder(topology);
  if (static_cast<Eigen::Index>(order.vertices.size()) != mesh.vertices.cols() ||
      static_cast<Eigen::Index>(order.corners.size()) != mesh.faces.cols()) {
    return absl::InternalError("the walk over the control mesh has missed a part of it");
  }
  ControlMesh canonical;
  canonical.vertices.resize(3, mesh.vertices.cols());
  std::vector<int> number(order.vertices.size());
  for (size_t i = 0; i < order.vertices.size(); ++i) {
    number[order.vertices[i]] = static_cast<int>(i);
    canonical.vertices.col(static_cast<Eigen::Index>(i)) = mesh.vertices.col(order.vertices[i]);
  }
  canonical.faces.resize(3, mesh.faces.cols());
  for (size_t f = 0; f < order.corners.size(); ++f) {
    const int face = order.corners[f] / 3, first = order.corners[f] % 3;
    for (int k = 0; k < 3; ++k) {
      canonical.faces(k, static_cast<Eigen::Index>(f)) = number[mesh.faces((first + k) % 3, face)];
    }
  }
  RenumberTags(mesh, number, canonical);
  return canonical;
}

absl::StatusOr<ControlMesh> QuantizeControlMesh(const ControlMesh& mesh, double step,
                                                int border_digits) {
  if (!(step > 0) || !std::isfinite(step)) {
    return absl::InvalidArgumentError(
        absl::StrCat("position_step is ", step, ", must be positive and finite"));
  }
  const double stored = StoredStep(step);
  std::vector<uint8_t> on_boundary;
  if (border_digits > 0) {
    RILIEVO_ASSIGN_OR_RETURN(MeshTopology topology,
                             BuildMeshTopology(mesh.faces, static_cast<int>(mesh.vertices.cols())));
    on_boundary = std::move(topology.boundary_vertex);
  }
  ControlMesh quantized = mesh;
  for (Crease& crease : quantized.creases) {
    if (crease.sharpness > 0) crease.sharpness = StoredSharpness(crease.sharpness);
  }
  for (Eigen::Index v = 0; v < quantized.vertices.cols(); ++v) {
    const int digits = !on_boundary.empty() && on_boundary[v] != 0 ? border_digits : 0;
    const double fine = BorderStep(stored, digits);
    for (int axis = 0; axis < 3; ++axis) {
      const double steps = std::nearbyint(mesh.vertices(axis, v) / fine);
      if (!(std::abs(std::ldexp(steps, -digits)) <= kMaxCoordinate)) {
        return absl::InvalidArgumentError(absl::StrCat(
            "coordinate ", axis, " of control point ", v, " is ", mesh.vertices(axis, v),
            ", must be within ", kMaxCoordinate, " position steps of ", step));
      }
      quantized.vertices(axis, v) = steps * fine;
    }
  }
  return quantized;
}

absl::StatusOr<ControlMesh> PrepareControlMesh(const ControlMesh& mesh, double position_step,
                                               int border_digits) {
  RILIEVO_ASSIGN_OR_RETURN(const ControlMesh canonical, CanonicalControlMesh(mesh));
  return QuantizeControlMesh(canonical, position_step, border_digits);
}

}  // namespace rilievo
