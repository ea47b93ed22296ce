#include "core/control/iso_surface.h"

#include <algorithm>
#include <array>
#include <vector>

#include "core/base/parallel_for.h"
#include "core/base/status_macros.h"

namespace rilievo {

const int kCellEdgeCorners[12][2] = {{0, 1}, {2, 3}, {4, 5}, {6, 7}, {0, 2}, {1, 3},
                                     {4, 6}, {5, 7}, {0, 4}, {1, 5}, {2, 6}, {3, 7}};

namespace {

// Corners of the six cell faces, counter-clockwise seen from outside the cell.
constexpr int kCellFaces[6][4] = {{0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4},
                                  {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}};

int EdgeBetween(int a, int b) {
  for (int edge = 0; edge < 12; ++edge) {
    if ((kCellEdgeCorners[edge][0] == a && kCellEdgeCorners[edge][1] == b) ||
        (kCellEdgeCorners[edge][0] == b && kCellEdgeCorners[edge][1] == a)) {
      return edge;
    }
  }
  return -1;
}

bool ShareCellFace(int edge_a, int edge_b) {
  for (const auto& face : kCellFaces) {
    int found = 0;
    for (int k = 0; k < 4; ++k) {
      const int edge = EdgeBetween(face[k], face[(k + 1) % 4]);
      found += edge == edge_a || edge == edge_b;
    }
    if (found == 2) return true;
  }
  return false;
}

// Triangulates loop[first..last] such that no diagonal lies in a face of the cell, where another
// cell could draw it too. Returns false when there is no such way.
bool TriangulateLoop(const std::vector<int>& loop, int first, int last, CellTriangles* out) {
  if (last - first < 2) return true;
  for (int apex = first + 1; apex < last; ++apex) {
    const bool inner_a = apex - first > 1;
    const bool inner_b = last - apex > 1;
    if (inner_a && ShareCellFace(loop[first], loop[apex])) continue;
    if (inner_b && ShareCellFace(loop[apex], loop[last])) continue;
    const CellTriangles saved = *out;
    int* triangle = out->edges[out->count++];
    triangle[0] = loop[first];
    triangle[1] = loop[last];
    triangle[2] = loop[apex];
    if (TriangulateLoop(loop, first, apex, out) && TriangulateLoop(loop, apex, last, out)) {
      return true;
    }
    *out = saved;
  }
  return false;
}

// next[e]: the cell edge that follows e on the polygons, clockwise seen from the positive side.
// Walking a cell face counter-clockwise from outside, a step from negative to positive opens a
// segment and the step back, just before the same run of negative corners began, closes it: so
// negative runs stay apart.
std::array<int, 12> LinkSegments(int negative_corners) {
  std::array<int, 12> next;
  next.fill(-1);
  const auto negative = [&](int corner) { return ((negative_corners >> corner) & 1) != 0; };
  for (const auto& face : kCellFaces) {
    for (int k = 0; k < 4; ++k) {
      if (!negative(face[k]) || negative(face[(k + 1) % 4])) continue;
      int start = k;
      while (negative(face[(start + 3) % 4])) start = (start + 3) % 4;
      const int leave = EdgeBetween(face[k], face[(k + 1) % 4]);
      const int enter = EdgeBetween(face[(start + 3) % 4], face[start]);
      next[leave] = enter;
    }
  }
  return next;
}

CellTriangles ComputeCell(int negative_corners) {
  CellTriangles cell;
  std::array<int, 12> next = LinkSegments(negative_corners);
  for (int edge = 0; edge < 12; ++edge) {
    if (next[edge] < 0) continue;
    std::vector<int> loop;
    for (int e = edge; next[e] >= 0;) {
      loop.push_back(e);
      const int following = next[e];
      next[e] = -1;
      e = following;
    }
    TriangulateLoop(loop, 0, static_cast<int>(loop.size()) - 1, &cell);
  }
  return cell;
}

// Vertices sit on grid edges: edge 3 * node + axis runs from the node along the axis.
class SurfaceBuilder {
 public:
  SurfaceBuilder(const ImplicitFunction& function, std::vector<Eigen::Vector3i> nodes)
      : function_(function), nodes_(std::move(nodes)), vertex_of_edge_(3 * nodes_.size(), -1) {}

  void AddCell(const std::array<int, 8>& corners) {
    int negative = 0;
    for (int c = 0; c < 8; ++c) negative |= (function_.values[corners[c]] < 0) << c;
    const CellTriangles& cell = TrianglesOfCell(negative);
    for (int t = 0; t < cell.count; ++t) {
      for (const int edge : cell.edges[t]) triangles_.push_back(VertexOn(corners, edge));
    }
  }

  ControlMesh Finish() {
    ControlMesh mesh;
    mesh.vertices = Eigen::Map<Eigen::Matrix3Xd>(positions_.data(), 3, positions_.size() / 3);
    mesh.faces = Eigen::Map<Eigen::Matrix3Xi>(triangles_.data(), 3, triangles_.size() / 3);
    return mesh;
  }

 private:
  int VertexOn(const std::array<int, 8>& corners, int edge) {
    const int a = corners[kCellEdgeCorners[edge][0]];
    const int b = corners[kCellEdgeCorners[edge][1]];
    int& vertex = vertex_of_edge_[3 * static_cast<size_t>(a) + edge / 4];
    if (vertex >= 0) return vertex;
    vertex = static_cast<int>(positions_.size() / 3);
    const double fa = function_.values[a];
    const double fb = function_.values[b];
    // Kept off the nodes, so that no triangle collapses to a point.
    const double t = std::clamp(fa / (fa - fb), 0.02, 0.98);
    const Eigen::Vector3d lattice =
        nodes_[a].cast<double>() + t * (nodes_[b] - nodes_[a]).cast<double>();
    const Eigen::Vector3d position = function_.origin + function_.cell * lattice;
    positions_.insert(positions_.end(), position.data(), position.data() + 3);
    return vertex;
  }

  const ImplicitFunction& function_;
  std::vector<Eigen::Vector3i> nodes_;
  std::vector<int> vertex_of_edge_;
  std::vector<double> positions_;
  std::vector<int> triangles_;
};

// The corner numbers of every crossed cell, 8 a cell, in the order of their first corners.
std::vector<std::array<int, 8>> CrossedCells(const ImplicitFunction& function,
                                             const std::vector<Eigen::Vector3i>& nodes,
                                             const RunContext& context) {
  constexpr int64_t kBlock = 1 << 14;
  std::vector<std::vector<std::array<int, 8>>> parts((nodes.size() + kBlock - 1) / kBlock);
  ParallelFor(static_cast<int64_t>(nodes.size()), kBlock, context, [&](int64_t begin, int64_t end) {
    for (int64_t node = begin; node < end; ++node) {
      std::array<int, 8> corners;
      if (!function.grid.FindCell(nodes[node], &corners)) continue;
      int below = 0;
      for (const int corner : corners) below += function.values[corner] < 0;
      if (below > 0 && below < 8) parts[begin / kBlock].push_back(corners);
    }
  }).IgnoreError();
  std::vector<std::array<int, 8>> cells;
  for (const auto& part : parts) cells.insert(cells.end(), part.begin(), part.end());
  return cells;
}

}  // namespace

const CellTriangles& TrianglesOfCell(int negative_corners) {
  static const std::vector<CellTriangles> table = [] {
    std::vector<CellTriangles> cells(256);
    for (int i = 0; i < 256; ++i) cells[i] = ComputeCell(i);
    return cells;
  }();
  return table[negative_corners];
}

absl::StatusOr<ControlMesh> ExtractIsoSurface(const ImplicitFunction& function,
                                              const RunContext& context) {
  std::vector<Eigen::Vector3i> nodes = function.grid.Nodes();
  const std::vector<std::array<int, 8>> cells = CrossedCells(function, nodes, context);
  RILIEVO_RETURN_IF_ERROR(context.CheckStop());
  SurfaceBuilder builder(function, std::move(nodes));
  for (const auto& corners : cells) builder.AddCell(corners);
  return builder.Finish();
}

}  // namespace rilievo
