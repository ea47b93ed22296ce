#include "core/control/planar/plane_lattice.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>
#include <numeric>
#include <utility>
#include <vector>

#include "core/base/status_macros.h"
#include "core/control/planar/settings.h"
#include "core/control/simplify/half_edge_mesh.h"
#include "core/control/simplify/relax_mesh.h"
#include "core/control/simplify/simplify_mesh.h"
#include "core/control/topology/mesh_subset.h"

namespace rilievo {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using SlotFace = std::array<int64_t, 3>;

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

// With its vertices in the order of the lattice: they are relaxed one after the other.
ControlMesh RowByRow(const ControlMesh& mesh) {
  std::vector<int> order(static_cast<size_t>(mesh.vertices.cols())), place(order.size());
  std::iota(order.begin(), order.end(), 0);
  std::ranges::stable_sort(
      order, {}, [&](int v) { return std::pair(mesh.vertices(1, v), mesh.vertices(0, v)); });
  for (size_t i = 0; i < order.size(); ++i) place[order[i]] = static_cast<int>(i);
  ControlMesh sorted;
  sorted.vertices = mesh.vertices(Eigen::all, order);
  sorted.faces = mesh.faces.unaryExpr([&](int v) { return place[v]; });
  return sorted;
}

// The faces of `mesh` but those of small islands, each fan with a vertex of its own.
ControlMesh WithoutIslands(const ControlMesh& mesh) {
  ControlMesh split = SplitFans(mesh).mesh;
  DisjointSets islands = JoinedVertices(split.faces, static_cast<int>(split.vertices.cols()));
  std::vector<int> size(static_cast<size_t>(split.vertices.cols()), 0);
  for (const auto face : split.faces.colwise()) ++size[islands.Find(face[0])];
  std::vector<uint8_t> keep;
  for (const auto face : split.faces.colwise()) {
    keep.push_back(size[islands.Find(face[0])] >= kPlaneLattice.smallest_island ? 1 : 0);
  }
  return RowByRow(KeepFaces(split, keep).mesh);
}

double SignedRoundness(const ControlMesh& mesh, int face) {
  const Vector3d a = mesh.vertices.col(mesh.faces(0, face));
  const Vector3d b = mesh.vertices.col(mesh.faces(1, face));
  const Vector3d c = mesh.vertices.col(mesh.faces(2, face));
  const double edges = (b - a).squaredNorm() + (c - b).squaredNorm() + (a - c).squaredNorm();
  return 2 * std::numbers::sqrt3 * (b - a).cross(c - a).z() / edges;
}

// Moves boundary vertices along the depth's slope to where it is zero, as far as the faces allow.
absl::Status DrawToBorder(const OccupiedArea& area, double edge, const RunContext& context,
                          ControlMesh* mesh) {
  RILIEVO_ASSIGN_OR_RETURN(
      const HalfEdgeMesh half_edges,
      HalfEdgeMesh::Build(mesh->faces, static_cast<int>(mesh->vertices.cols()), context));
  const double step = area.cell;
  for (int v = 0; v < half_edges.vertex_slots(); ++v) {
    if (!half_edges.OnBoundary(v)) continue;
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
    if (move.norm() > kPlaneLattice.farthest_draw * edge)
      move *= kPlaneLattice.farthest_draw * edge / move.norm();
    for (int attempt = 0; attempt < 4; ++attempt, move *= 0.6) {
      mesh->vertices.col(v).head<2>() = start + move;
      bool fine = true;
      half_edges.ForEachOutgoing(
          v, [&](int h) { fine &= SignedRoundness(*mesh, h / 3) > kPlaneLattice.min_roundness; });
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
  ControlMesh mesh = WithoutIslands(WithVertices(lattice, slot_faces));
  RILIEVO_RETURN_IF_ERROR(context.CheckStop());
  if (mesh.faces.cols() == 0) return mesh;
  RILIEVO_RETURN_IF_ERROR(DrawToBorder(area, edge, context, &mesh));
  RelaxTangentially(&mesh, kPlaneLattice.lattice_rounds);
  RILIEVO_RETURN_IF_ERROR(context.CheckStop());
  ImproveValence(&mesh);
  RILIEVO_RETURN_IF_ERROR(DrawToBorder(area, edge, context, &mesh));
  RelaxTangentially(&mesh, kPlaneLattice.lattice_rounds);
  return mesh;
}

}  // namespace rilievo
