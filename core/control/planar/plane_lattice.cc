#include "core/control/planar/plane_lattice.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>
#include <vector>

#include "core/base/status_macros.h"
#include "core/control/simplify/collapse_guards.h"
#include "core/control/simplify/mesh_subset.h"
#include "core/control/simplify/relax_mesh.h"
#include "core/control/simplify/simplify_mesh.h"
#include "core/geometry/connected_parts.h"
#include "core/geometry/mesh_topology.h"
#include "core/geometry/vertex_normals.h"

namespace rilievo {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using SlotFace = std::array<int64_t, 3>;

constexpr int kSmallestIsland = 6;     // faces
constexpr double kFarthestDraw = 0.6;  // edges a vertex moves to reach the border
constexpr double kMinRoundness = 0.3;  // of a face whose vertex was drawn to the border
constexpr int kLatticeRounds = 4;

// Vertices in rows, every other one shifted by half an edge.
struct Lattice {
  Vector2d origin;
  double edge;
  int64_t columns, rows;

  Lattice(const OccupiedArea& area, double edge_in) : origin(area.origin), edge(edge_in) {
    columns = static_cast<int64_t>(std::ceil(area.columns * area.cell / edge)) + 2;
    rows = static_cast<int64_t>(std::ceil(area.rows * area.cell / row_height())) + 2;
  }
  double row_height() const { return edge * std::numbers::sqrt3 / 2; }
  // Slots far outnumber the vertices used where the points are islands far apart.
  int64_t Slot(int64_t column, int64_t row) const { return row * columns + column; }
  Vector2d Position(int64_t slot) const {
    const int64_t row = slot / columns, column = slot % columns;
    return origin +
           Vector2d((static_cast<double>(column) - 0.5 * static_cast<double>(row & 1)) * edge,
                    static_cast<double>(row) * row_height());
  }
};

// Columns to go on from a slot at that depth before a face may lie inside again; 1 at least. The
// raster tells distances to within two of its cells.
int64_t ColumnsOutside(const Lattice& lattice, const OccupiedArea& area, double depth) {
  const double columns = (-depth - 2 * area.cell) / lattice.edge - 2;
  return std::max<int64_t>(1, std::min(static_cast<double>(lattice.columns), columns));
}

// By slots of the lattice.
absl::StatusOr<std::vector<SlotFace>> FacesInside(const Lattice& lattice, const OccupiedArea& area,
                                                  const RunContext& context) {
  std::vector<SlotFace> faces;
  for (int64_t r = 0; r + 1 < lattice.rows; ++r) {
    if (r % 64 == 0) RILIEVO_RETURN_IF_ERROR(context.CheckStop());
    for (int64_t c = 0; c + 1 < lattice.columns;) {
      const int64_t a = lattice.Slot(c, r), b = lattice.Slot(c + 1, r);
      const int64_t d = lattice.Slot(c, r + 1), e = lattice.Slot(c + 1, r + 1);
      const std::array<SlotFace, 2> pair =
          (r & 1) != 0 ? std::array<SlotFace, 2>{SlotFace{a, b, d}, {b, e, d}}
                       : std::array<SlotFace, 2>{SlotFace{a, b, e}, {a, e, d}};
      double depth = -std::numeric_limits<double>::infinity();
      for (const SlotFace& face : pair) {
        const Vector2d center =
            (lattice.Position(face[0]) + lattice.Position(face[1]) + lattice.Position(face[2])) / 3;
        const double at_center = area.Depth(center);
        if (at_center > 0) faces.push_back(face);
        depth = std::max(depth, at_center);
      }
      c += depth > 0 ? 1 : ColumnsOutside(lattice, area, depth);
    }
  }
  return faces;
}

// The slots in use become vertices, in their order.
ControlMesh WithVertices(const Lattice& lattice, const std::vector<SlotFace>& slot_faces) {
  std::vector<int64_t> slots;
  slots.reserve(3 * slot_faces.size());
  for (const SlotFace& face : slot_faces) slots.insert(slots.end(), face.begin(), face.end());
  std::sort(slots.begin(), slots.end());
  slots.erase(std::unique(slots.begin(), slots.end()), slots.end());
  ControlMesh mesh;
  mesh.vertices.resize(3, static_cast<int64_t>(slots.size()));
  for (size_t v = 0; v < slots.size(); ++v) {
    mesh.vertices.col(static_cast<int64_t>(v)) << lattice.Position(slots[v]), 0;
  }
  mesh.faces.resize(3, static_cast<int64_t>(slot_faces.size()));
  for (size_t f = 0; f < slot_faces.size(); ++f) {
    for (int k = 0; k < 3; ++k) {
      const auto slot = std::lower_bound(slots.begin(), slots.end(), slot_faces[f][k]);
      mesh.faces(k, static_cast<int64_t>(f)) = static_cast<int>(slot - slots.begin());
    }
  }
  return mesh;
}

// Without the parts of fewer faces than an island has; where only a vertex joins two, each has one
// of its own.
absl::StatusOr<ControlMesh> WithoutSpecks(const ControlMesh& lattice) {
  const ControlMesh mesh = SplitFans(lattice).mesh;
  RILIEVO_ASSIGN_OR_RETURN(const MeshTopology topology,
                           BuildMeshTopology(mesh.faces, static_cast<int>(mesh.vertices.cols())));
  std::vector<uint8_t> keep(static_cast<size_t>(mesh.faces.cols()), 1);
  int parts = 0;
  const std::vector<int> part = ConnectedParts(
      keep, [&](int f) { return topology.face_neighbors.col(f); }, &parts);
  std::vector<int> size(static_cast<size_t>(parts), 0);
  for (const int p : part) ++size[p];
  for (size_t f = 0; f < keep.size(); ++f) keep[f] = size[part[f]] >= kSmallestIsland;
  return KeepFaces(mesh, keep).mesh;
}

double SignedRoundness(const ControlMesh& mesh, int face) {
  const Eigen::Matrix3d corners = mesh.vertices(Eigen::all, mesh.faces.col(face));
  const Vector3d cross = FaceCross(mesh.vertices, mesh.faces, face);
  return std::copysign(Roundness(corners.col(0), corners.col(1), corners.col(2), cross), cross.z());
}

// Moves boundary vertices along the depth's slope to where it is zero, as far as the faces allow.
absl::Status DrawToBorder(const OccupiedArea& area, double edge, ControlMesh* mesh) {
  RILIEVO_ASSIGN_OR_RETURN(const MeshTopology topology,
                           BuildMeshTopology(mesh->faces, static_cast<int>(mesh->vertices.cols())));
  std::vector<std::vector<int>> around(static_cast<size_t>(topology.vertex_count));
  for (int f = 0; f < topology.face_count(); ++f) {
    for (const int v : topology.faces.col(f)) around[v].push_back(f);
  }
  const double step = area.cell;
  for (int v = 0; v < topology.vertex_count; ++v) {
    if (topology.boundary_vertex[v] == 0) continue;
    const Vector2d start = mesh->vertices.col(v).head<2>();
    Vector2d target = start;
    for (int round = 0; round < 3; ++round) {
      const Vector2d slope(
          area.Depth(target + Vector2d(step, 0)) - area.Depth(target - Vector2d(step, 0)),
          area.Depth(target + Vector2d(0, step)) - area.Depth(target - Vector2d(0, step)));
      if (slope.norm() < 0.2 * step) break;
      target -= area.Depth(target) * slope.normalized();
    }
    Vector2d move = target - start;
    if (move.norm() > kFarthestDraw * edge) move *= kFarthestDraw * edge / move.norm();
    for (int attempt = 0; attempt < 4; ++attempt, move *= 0.6) {
      mesh->vertices.col(v).head<2>() = start + move;
      const bool fine = std::all_of(around[v].begin(), around[v].end(), [&](int f) {
        return SignedRoundness(*mesh, f) > kMinRoundness;
      });
      if (fine) break;
      mesh->vertices.col(v).head<2>() = start;
    }
  }
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<ControlMesh> TriangulateArea(const OccupiedArea& area, double edge,
                                            const RunContext& context) {
  const Lattice lattice(area, edge);
  RILIEVO_ASSIGN_OR_RETURN(const std::vector<SlotFace> slot_faces,
                           FacesInside(lattice, area, context));
  RILIEVO_ASSIGN_OR_RETURN(ControlMesh mesh, WithoutSpecks(WithVertices(lattice, slot_faces)));
  RILIEVO_RETURN_IF_ERROR(context.CheckStop());
  if (mesh.faces.cols() == 0) return mesh;
  RILIEVO_RETURN_IF_ERROR(DrawToBorder(area, edge, &mesh));
  RelaxTangentially(&mesh, kLatticeRounds);
  RILIEVO_RETURN_IF_ERROR(context.CheckStop());
  ImproveValence(&mesh);
  RILIEVO_RETURN_IF_ERROR(DrawToBorder(area, edge, &mesh));
  RelaxTangentially(&mesh, kLatticeRounds);
  return mesh;
}

}  // namespace rilievo
