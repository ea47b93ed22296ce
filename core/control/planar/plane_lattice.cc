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
#include "core/control/simplify/relax_mesh.h"
#include "core/control/simplify/simplify_mesh.h"

namespace rilievo {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using Face = std::array<int, 3>;
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

int Root(std::vector<int>* parent, int i) {
  while ((*parent)[i] != i) i = (*parent)[i] = (*parent)[(*parent)[i]];
  return i;
}

// The faces of `around` (all hold `vertex`) that do not belong to the largest fan.
std::vector<int> SmallerFans(const std::vector<Face>& faces, const std::vector<int>& around,
                             int vertex) {
  const int count = static_cast<int>(around.size());
  std::vector<int> parent(around.size());
  std::iota(parent.begin(), parent.end(), 0);
  for (int i = 0; i < count; ++i) {
    for (int j = 0; j < i; ++j) {
      int shared = 0;
      for (const int v : faces[around[i]]) {
        const Face& other = faces[around[j]];
        shared += v != vertex && std::find(other.begin(), other.end(), v) != other.end() ? 1 : 0;
      }
      if (shared > 0) parent[Root(&parent, i)] = Root(&parent, j);
    }
  }
  std::vector<int> size(around.size(), 0);
  for (int i = 0; i < count; ++i) ++size[Root(&parent, i)];
  const auto largest = static_cast<int>(std::max_element(size.begin(), size.end()) - size.begin());
  std::vector<int> smaller;
  for (int i = 0; i < count; ++i) {
    if (Root(&parent, i) != largest) smaller.push_back(around[i]);
  }
  return smaller;
}

void Erase(const std::vector<uint8_t>& erased, std::vector<Face>* faces) {
  size_t kept = 0;
  for (size_t f = 0; f < faces->size(); ++f) {
    if (erased[f] == 0) (*faces)[kept++] = (*faces)[f];
  }
  faces->resize(kept);
}

// Until no vertex joins two fans.
void RemoveBowTies(int vertex_count, std::vector<Face>* faces) {
  for (bool changed = true; changed;) {
    std::vector<std::vector<int>> around(static_cast<size_t>(vertex_count));
    for (size_t f = 0; f < faces->size(); ++f) {
      for (const int v : (*faces)[f]) around[v].push_back(static_cast<int>(f));
    }
    std::vector<uint8_t> erased(faces->size(), 0);
    changed = false;
    for (int v = 0; v < vertex_count; ++v) {
      if (around[v].size() < 2) continue;
      for (const int f : SmallerFans(*faces, around[v], v)) {
        erased[f] = 1;
        changed = true;
      }
    }
    Erase(erased, faces);
  }
}

void RemoveIslands(int vertex_count, std::vector<Face>* faces) {
  std::vector<int> parent(static_cast<size_t>(vertex_count));
  std::iota(parent.begin(), parent.end(), 0);
  for (const Face& face : *faces) {
    parent[Root(&parent, face[0])] = Root(&parent, face[1]);
    parent[Root(&parent, face[1])] = Root(&parent, face[2]);
  }
  std::vector<int> size(static_cast<size_t>(vertex_count), 0);
  for (const Face& face : *faces) ++size[Root(&parent, face[0])];
  std::vector<uint8_t> erased(faces->size());
  for (size_t f = 0; f < faces->size(); ++f) {
    erased[f] = size[Root(&parent, (*faces)[f][0])] < kSmallestIsland ? 1 : 0;
  }
  Erase(erased, faces);
}

// Of `mesh` these faces, and the vertices they use.
ControlMesh Compact(const ControlMesh& mesh, const std::vector<Face>& faces) {
  std::vector<int> renumbered(static_cast<size_t>(mesh.vertices.cols()), -1);
  for (const Face& face : faces) {
    for (const int v : face) renumbered[v] = 0;
  }
  ControlMesh compact;
  int count = 0;
  compact.vertices.resize(3, std::count(renumbered.begin(), renumbered.end(), 0));
  for (size_t v = 0; v < renumbered.size(); ++v) {
    if (renumbered[v] < 0) continue;
    compact.vertices.col(count) = mesh.vertices.col(static_cast<int64_t>(v));
    renumbered[v] = count++;
  }
  compact.faces.resize(3, static_cast<int64_t>(faces.size()));
  for (size_t f = 0; f < faces.size(); ++f) {
    for (int k = 0; k < 3; ++k) compact.faces(k, static_cast<int64_t>(f)) = renumbered[faces[f][k]];
  }
  return compact;
}

double SignedRoundness(const ControlMesh& mesh, int face) {
  const Vector3d a = mesh.vertices.col(mesh.faces(0, face));
  const Vector3d b = mesh.vertices.col(mesh.faces(1, face));
  const Vector3d c = mesh.vertices.col(mesh.faces(2, face));
  const double edges = (b - a).squaredNorm() + (c - b).squaredNorm() + (a - c).squaredNorm();
  return 2 * std::numbers::sqrt3 * (b - a).cross(c - a).z() / edges;
}

// Moves boundary vertices along the depth's slope to where it is zero, as far as the faces allow.
void DrawToBorder(const OccupiedArea& area, double edge, ControlMesh* mesh) {
  const auto vertex_count = static_cast<size_t>(mesh->vertices.cols());
  std::vector<std::vector<int>> around(vertex_count);
  std::vector<std::pair<int, int>> edges;
  for (int f = 0; f < mesh->faces.cols(); ++f) {
    for (int k = 0; k < 3; ++k) {
      around[mesh->faces(k, f)].push_back(f);
      edges.push_back(std::minmax(mesh->faces(k, f), mesh->faces((k + 1) % 3, f)));
    }
  }
  std::sort(edges.begin(), edges.end());
  std::vector<uint8_t> boundary(vertex_count, 0);
  for (size_t i = 0, j = 0; i < edges.size(); i = j) {
    for (j = i + 1; j < edges.size() && edges[j] == edges[i];) ++j;
    if (j == i + 1) boundary[edges[i].first] = boundary[edges[i].second] = 1;
  }
  const double step = area.cell;
  for (int v = 0; v < static_cast<int>(vertex_count); ++v) {
    if (boundary[v] == 0) continue;
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
}

}  // namespace

absl::StatusOr<ControlMesh> TriangulateArea(const OccupiedArea& area, double edge,
                                            const RunContext& context) {
  const Lattice lattice(area, edge);
  RILIEVO_ASSIGN_OR_RETURN(const std::vector<SlotFace> slot_faces,
                           FacesInside(lattice, area, context));
  const ControlMesh whole = WithVertices(lattice, slot_faces);
  std::vector<Face> faces;
  faces.reserve(slot_faces.size());
  for (const auto face : whole.faces.colwise()) faces.push_back({face[0], face[1], face[2]});
  RemoveBowTies(static_cast<int>(whole.vertices.cols()), &faces);
  RemoveIslands(static_cast<int>(whole.vertices.cols()), &faces);
  RILIEVO_RETURN_IF_ERROR(context.CheckStop());
  ControlMesh mesh = Compact(whole, faces);
  if (faces.empty()) return mesh;
  DrawToBorder(area, edge, &mesh);
  RelaxTangentially(&mesh, kLatticeRounds);
  RILIEVO_RETURN_IF_ERROR(context.CheckStop());
  ImproveValence(&mesh);
  DrawToBorder(area, edge, &mesh);
  RelaxTangentially(&mesh, kLatticeRounds);
  return mesh;
}

}  // namespace rilievo
