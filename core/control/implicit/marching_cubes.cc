#include "core/control/implicit/marching_cubes.h"

#include <algorithm>
#include <array>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "core/base/parallel_for.h"
#include "core/base/status_macros.h"
#include "core/control/implicit/cell_polygons.h"
#include "core/control/implicit/marching_cubes_transition.h"

namespace rilievo {

const int kCellEdgeCorners[12][2] = {{0, 1}, {2, 3}, {4, 5}, {6, 7}, {0, 2}, {1, 3},
                                     {4, 6}, {5, 7}, {0, 4}, {1, 5}, {2, 6}, {3, 7}};

const int kCellFaces[6][4] = {{0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4},
                              {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}};

namespace {

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

CellTriangles ComputeCell(int negative_corners) {
  CellPolygons<12> polygons;
  const auto is_negative = [&](int corner) { return ((negative_corners >> corner) & 1) != 0; };
  for (const auto& face : kCellFaces) polygons.WalkFace(face, is_negative, EdgeBetween);
  CellTriangles cell;
  for (const std::vector<int>& polygon : polygons.Take()) {
    TriangulateLoop(polygon, 0, static_cast<int>(polygon.size()) - 1, &cell);
  }
  return cell;
}

// A leaf cell that the zero set may cross.
struct LeafCell {
  Eigen::Vector3i low;
  std::array<int, 8> corners;
  bool transition = false;  // touches cells of half its size
  EdgeLoops loops;          // of a transition cell
};

// Appends as std::vector does, without a copy of all whenever it grows, and gives its pieces back
// one by one when they are taken.
template <typename Value>
class PiecewiseList {
 public:
  size_t size() const { return size_; }
  const Value& operator[](size_t i) const { return pieces_[i / kValuesAtOnce][i % kValuesAtOnce]; }
  void Append(const Value& value) {
    if (size_ == pieces_.size() * kValuesAtOnce) pieces_.emplace_back().reserve(kValuesAtOnce);
    pieces_.back().push_back(value);
    ++size_;
  }
  Eigen::Matrix<typename Value::Scalar, 3, Eigen::Dynamic> Take() {
    Eigen::Matrix<typename Value::Scalar, 3, Eigen::Dynamic> all(3, size_);
    Eigen::Index next = 0;
    for (std::vector<Value>& piece : pieces_) {
      for (const Value& value : piece) all.col(next++) = value;
      piece = std::vector<Value>();
    }
    return all;
  }

 private:
  static constexpr size_t kValuesAtOnce = 1 << 17;
  std::vector<std::vector<Value>> pieces_;
  size_t size_ = 0;
};

// Vertices sit on grid edges: edge 3 * node + axis of a level runs from the node along the axis.
class SurfaceBuilder {
 public:
  explicit SurfaceBuilder(const ImplicitFunction& function) : function_(function) {
    for (const GridLevel& level : function.levels) {
      nodes_.push_back(level.grid.Nodes());
      vertex_of_edge_.emplace_back(3 * nodes_.back().size(), -1);
    }
  }

  const std::vector<Eigen::Vector3i>& nodes(int level) const { return nodes_[level]; }

  void AddCell(int level, const LeafCell& cell) {
    if (cell.transition) {
      for (const std::vector<GridEdge>& loop : cell.loops) AddLoop(loop);
      return;
    }
    int negative = 0;
    for (int c = 0; c < 8; ++c) {
      negative |= (function_.levels[level].values[cell.corners[c]] < 0) << c;
    }
    const CellTriangles& triangles = TrianglesOfCell(negative);
    for (int t = 0; t < triangles.count; ++t) {
      Eigen::Vector3i corners;
      for (int k = 0; k < 3; ++k) {
        const int edge = triangles.edges[t][k];
        corners[k] = VertexOn({.level = level,
                               .node = cell.corners[kCellEdgeCorners[edge][0]],
                               .next = cell.corners[kCellEdgeCorners[edge][1]],
                               .axis = edge / 4});
      }
      triangles_.Append(corners);
    }
  }

  ControlMesh Finish() {
    nodes_.clear();
    vertex_of_edge_.clear();
    ControlMesh mesh;
    mesh.vertices = positions_.Take();
    mesh.faces = triangles_.Take();
    return mesh;
  }

 private:
  int AddVertex(const Eigen::Vector3d& position) {
    positions_.Append(position);
    return static_cast<int>(positions_.size()) - 1;
  }

  int VertexOn(const GridEdge& edge) {
    int& vertex = vertex_of_edge_[edge.level][3 * static_cast<size_t>(edge.node) + edge.axis];
    if (vertex >= 0) return vertex;
    const GridLevel& level = function_.levels[edge.level];
    const double fa = level.values[edge.node];
    const double fb = level.values[edge.next];
    // Kept off the nodes, so that no triangle collapses to a point.
    const double t = std::clamp(fa / (fa - fb), 0.02, 0.98);
    Eigen::Vector3d lattice = nodes_[edge.level][edge.node].cast<double>();
    lattice[edge.axis] += t;
    vertex = AddVertex(function_.origin + level.cell * lattice);
    return vertex;
  }

  // A fan around the middle: a diagonal might lie in a face of the cell, where another could draw
  // it.
  void AddLoop(const std::vector<GridEdge>& loop) {
    std::vector<int> rim;
    for (const GridEdge& edge : loop) rim.push_back(VertexOn(edge));
    if (rim.size() == 3) {
      triangles_.Append({rim[0], rim[2], rim[1]});
      return;
    }
    Eigen::Vector3d middle = Eigen::Vector3d::Zero();
    for (const int v : rim) middle += positions_[v];
    const int apex = AddVertex(middle / static_cast<double>(rim.size()));
    for (size_t i = 0; i < rim.size(); ++i) {
      triangles_.Append({apex, rim[(i + 1) % rim.size()], rim[i]});
    }
  }

  const ImplicitFunction& function_;
  std::vector<std::vector<Eigen::Vector3i>> nodes_;  // by level
  std::vector<std::vector<int>> vertex_of_edge_;     // by level
  PiecewiseList<Eigen::Vector3d> positions_;
  PiecewiseList<Eigen::Vector3i> triangles_;
};

// Tells leaves that the zero set may cross, and what is needed to cut them.
class LeafReader {
 public:
  LeafReader(const ImplicitFunction& function, int level)
      : levels_(function.levels), level_(level), own_(levels_[level].grid) {
    if (level + 1 < static_cast<int>(levels_.size())) next_.emplace(levels_[level + 1].grid);
  }

  bool Read(const Eigen::Vector3i& low, LeafCell* cell) {
    const bool refined = next_ && next_->FindThreeCubed(2 * low, &finer_);
    if (refined && IsRefined(finer_)) return false;
    if (!own_.FindCell(low, &cell->corners)) return false;
    cell->low = low;
    cell->transition = refined && TouchesSmallerCells(finer_);
    cell->loops.clear();
    if (cell->transition) {
      cell->loops = LoopsOfTransitionCell(levels_, level_, cell->corners, finer_);
      return !cell->loops.empty();
    }
    int below = 0;
    for (const int corner : cell->corners) below += levels_[level_].values[corner] < 0;
    return below > 0 && below < 8;
  }

 private:
  const std::vector<GridLevel>& levels_;
  const int level_;
  SparseGridReader own_;
  std::optional<SparseGridReader> next_;
  FinerNodes finer_;
};

// Nodes whose cells are held at a time: a cell takes 20 times the room of its node's value.
constexpr int64_t kNodesAtOnce = 1 << 17, kNodesPerTask = 1 << 13;

// In the order of the nodes, which are their lower corners; by task.
std::vector<std::vector<LeafCell>> CrossedCells(const ImplicitFunction& function, int level,
                                                std::span<const Eigen::Vector3i> nodes,
                                                const RunContext& context) {
  std::vector<std::vector<LeafCell>> parts((nodes.size() + kNodesPerTask - 1) / kNodesPerTask);
  ParallelFor(static_cast<int64_t>(nodes.size()), kNodesPerTask, context,
              [&](int64_t begin, int64_t end) {
                LeafReader reader(function, level);
                LeafCell cell;
                for (int64_t node = begin; node < end; ++node) {
                  if (!reader.Read(nodes[node], &cell)) continue;
                  parts[begin / kNodesPerTask].push_back(std::move(cell));
                }
              })
      .IgnoreError();
  return parts;
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
  SurfaceBuilder builder(function);
  for (int level = 0; level < static_cast<int>(function.levels.size()); ++level) {
    const std::span nodes(builder.nodes(level));
    for (size_t first = 0; first < nodes.size(); first += kNodesAtOnce) {
      const auto some = nodes.subspan(first, std::min<size_t>(kNodesAtOnce, nodes.size() - first));
      for (const std::vector<LeafCell>& cells : CrossedCells(function, level, some, context)) {
        for (const LeafCell& cell : cells) builder.AddCell(level, cell);
      }
      RILIEVO_RETURN_IF_ERROR(context.CheckStop());
    }
  }
  return builder.Finish();
}

}  // namespace rilievo
