#include "core/displacement/regularize/fill_heights.h"

#include <algorithm>
#include <cmath>

#include "core/base/status_macros.h"
#include "core/loop/child_edges.h"

namespace rilievo {
namespace {

// Ranges over which the slope and the height of a fill decay, in control edges.
constexpr double kSlopeRange = 1.0;
constexpr double kHeightRange = 6.0;
// Conjugate gradient steps: the finest level starts from the coarser one and needs few.
constexpr int kFinestSteps = 20;
constexpr int kMostSteps = 300;
constexpr double kRelativeResidual = 1e-5;

// Calls each(a, b, rim) for the edges of a level in the order of their numbers. `topology`: the
// level itself where it is the first, else the one before it.
template <typename Each>
void ForEachEdge(const MeshTopology& topology, bool first, const Each& each) {
  if (first) {
    for (int e = 0; e < topology.edge_count(); ++e) {
      each(topology.edge_vertices(0, e), topology.edge_vertices(1, e),
           topology.edge_faces(1, e) < 0);
    }
    return;
  }
  const auto middle = [&](int f, int k) {
    return topology.vertex_count + topology.face_edges(k, f);
  };
  ForEachChildEdge(
      topology,
      [&](int f, int k, int corner) {
        each(topology.faces(corner, f), middle(f, k),
             topology.edge_faces(1, topology.face_edges(k, f)) < 0);
      },
      [&](int f, int c) {
        const int before = middle(f, (c + 2) % 3), after = middle(f, c);
        each(std::min(before, after), std::max(before, after), false);
      });
}

// The quadratic form on one level, restricted to the vertices without data and their neighbours.
class PlateProblem {
 public:
  // `edges_of`: see ForEachEdge. `control_edge`: in edges of this level.
  PlateProblem(const MeshTopology& topology, const MeshTopology& edges_of,
               const std::vector<uint8_t>& known, double control_edge)
      : membrane_(1.0 / std::pow(kSlopeRange * control_edge, 2)),
        decay_(membrane_ / std::pow(kHeightRange * control_edge, 2)) {
    const int count = topology.vertex_count;
    place_.assign(count, -1);
    std::vector<uint8_t> near(known.begin(), known.begin() + count);
    for (uint8_t& flag : near) flag = flag == 0;
    std::vector<uint8_t> row(near);
    const bool first = &edges_of == &topology;
    ForEachEdge(edges_of, first, [&](int a, int b, bool) {
      if (near[a] || near[b]) row[a] = row[b] = 1;
    });
    for (int v = 0; v < count; ++v) {
      if (!row[v]) continue;
      place_[v] = static_cast<int>(vertices_.size());
      vertices_.push_back(v);
      free_.push_back(near[v]);
      plate_.push_back(1);
      valence_.push_back(ValenceInRow(topology, v));
    }
    ForEachEdge(edges_of, first, [&](int a, int b, bool rim) {
      if (!row[a] && !row[b]) return;
      // Across the rim the fill is free to bend; without rows along it, single heights there would
      // be extrapolated from the two rows of vertices next to them, with all their noise.
      edges_.push_back({a, b, rim || !topology.boundary_vertex[a] ? 1.0 : 0.0,
                        rim || !topology.boundary_vertex[b] ? 1.0 : 0.0});
    });
    // Vertices two edges away complete the Laplacian of the rows next to them.
    for (Edge& edge : edges_) {
      for (int* end : {&edge.a, &edge.b}) {
        if (place_[*end] < 0) {
          place_[*end] = static_cast<int>(vertices_.size());
          vertices_.push_back(*end);
          free_.push_back(0);
          plate_.push_back(0);
          valence_.push_back(ValenceInRow(topology, *end));
        }
        *end = place_[*end];
      }
    }
    laplacian_.resize(vertices_.size());
  }

  size_t size() const { return vertices_.size(); }
  const std::vector<int>& vertices() const { return vertices_; }

  // Half the gradient of the form at `heights`, on the free vertices; 0 on the others.
  void Gradient(const std::vector<double>& heights, std::vector<double>* gradient) {
    std::fill(laplacian_.begin(), laplacian_.end(), 0.0);
    std::fill(gradient->begin(), gradient->end(), 0.0);
    for (const Edge& edge : edges_) {
      const double step = heights[edge.b] - heights[edge.a];
      laplacian_[edge.a] += edge.in_row_a * step;
      laplacian_[edge.b] -= edge.in_row_b * step;
    }
    for (size_t i = 0; i < size(); ++i) {
      (*gradient)[i] += decay_ * heights[i];
      laplacian_[i] *= plate_[i] / (valence_[i] * valence_[i]);
    }
    for (const Edge& edge : edges_) {
      const double bend = edge.in_row_b * laplacian_[edge.b] - edge.in_row_a * laplacian_[edge.a];
      const double stretch = membrane_ * (heights[edge.b] - heights[edge.a]) / 6.0;
      (*gradient)[edge.a] += bend - stretch;
      (*gradient)[edge.b] -= bend - stretch;
    }
    for (size_t i = 0; i < size(); ++i) {
      if (!free_[i]) (*gradient)[i] = 0;
    }
  }

 private:
  struct Edge {
    int a, b;
    double in_row_a, in_row_b;  // 1 where the edge takes part in the Laplacian of that end
  };
  // On the rim the Laplacian goes along it.
  static int ValenceInRow(const MeshTopology& topology, int vertex) {
    return topology.boundary_vertex[vertex] ? 2 : topology.valence[vertex];
  }
  double membrane_, decay_;
  std::vector<int> place_, vertices_;
  std::vector<uint8_t> free_;
  std::vector<double> plate_, valence_;
  std::vector<Edge> edges_;
  std::vector<double> laplacian_;
};

double Dot(const std::vector<double>& a, const std::vector<double>& b) {
  double sum = 0;
  for (size_t i = 0; i < a.size(); ++i) sum += a[i] * b[i];
  return sum;
}

// Conjugate gradients on the quadratic form: gradient(h + p) - gradient(h) is its matrix times p.
absl::Status Relax(PlateProblem* problem, int steps, const RunContext& context,
                   std::vector<double>* heights) {
  const size_t size = problem->size();
  std::vector<double> residual(size), image(size);
  problem->Gradient(*heights, &residual);
  for (double& value : residual) value = -value;
  std::vector<double> direction = residual;
  double square = Dot(residual, residual);
  const double enough = square * kRelativeResidual * kRelativeResidual;
  for (int step = 0; step < steps && square > enough && square > 0; ++step) {
    RILIEVO_RETURN_IF_ERROR(context.CheckStop());
    problem->Gradient(direction, &image);
    const double curvature = Dot(direction, image);
    if (!(curvature > 0)) break;
    const double length = square / curvature;
    for (size_t i = 0; i < size; ++i) {
      (*heights)[i] += length * direction[i];
      residual[i] -= length * image[i];
    }
    const double next = Dot(residual, residual);
    const double keep = next / square;
    for (size_t i = 0; i < size; ++i) direction[i] = residual[i] + keep * direction[i];
    square = next;
  }
  return absl::OkStatus();
}

}  // namespace

absl::Status FillHeights(const LoopRefinement& refinement, const std::vector<uint8_t>& known,
                         const RunContext& context, std::vector<float>* heights) {
  const int finest = refinement.max_level();
  for (size_t v = 0; v < known.size(); ++v) {
    if (!known[v]) (*heights)[v] = 0;
  }
  if (std::find(known.begin(), known.end(), 0) == known.end()) return absl::OkStatus();
  if (std::find(known.begin(), known.end(), 1) == known.end()) return absl::OkStatus();
  for (int level = 0; level <= finest; ++level) {
    const MeshTopology& topology = refinement.levels[level];
    if (level > 0) {
      const MeshTopology& coarse = refinement.levels[level - 1];
      for (int edge = 0; edge < coarse.edge_count(); ++edge) {
        const int vertex = coarse.vertex_count + edge;
        if (known[vertex]) continue;
        const auto ends = coarse.edge_vertices.col(edge);
        (*heights)[vertex] = 0.5f * ((*heights)[ends[0]] + (*heights)[ends[1]]);
      }
    }
    PlateProblem problem(topology, refinement.levels[std::max(0, level - 1)], known,
                         std::ldexp(1.0, level));
    std::vector<double> local(problem.size());
    for (size_t i = 0; i < local.size(); ++i) local[i] = (*heights)[problem.vertices()[i]];
    const int steps = std::min(kMostSteps, kFinestSteps << (finest - level));
    RILIEVO_RETURN_IF_ERROR(Relax(&problem, steps, context, &local));
    for (size_t i = 0; i < local.size(); ++i) {
      const int vertex = problem.vertices()[i];
      if (!known[vertex]) (*heights)[vertex] = static_cast<float>(local[i]);
    }
  }
  return absl::OkStatus();
}

}  // namespace rilievo
