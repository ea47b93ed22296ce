#include "core/domain/fairness.h"

#include <cmath>

namespace rilievo {
namespace {

// Along a crease, or nothing but the vertex itself in a corner.
std::vector<int> SharpUmbrella(const DomainSamples& samples, int control_vertex) {
  std::vector<int> vertices = {control_vertex};
  if (samples.control_kinds[static_cast<size_t>(control_vertex)] != VertexKind::kCrease) {
    return vertices;
  }
  const MeshTopology& mesh = samples.refinement.levels.front();
  for (const SharpEdge& sharp : samples.refinement.sharp.levels.front().edges) {
    const auto ends = mesh.edge_vertices.col(sharp.edge);
    if (ends[0] == control_vertex) vertices.push_back(ends[1]);
    if (ends[1] == control_vertex) vertices.push_back(ends[0]);
  }
  return vertices;
}

}  // namespace

Umbrella UmbrellaOf(const DomainSamples& samples, int control_vertex) {
  const VertexRings& rings = samples.edge_rings();
  const auto v = static_cast<size_t>(control_vertex);
  const auto begin = rings.neighbors.begin() + rings.neighbor_begin[v];
  const auto end = rings.neighbors.begin() + rings.neighbor_begin[v + 1];
  Umbrella umbrella{{control_vertex}};
  if (samples.is_sharp(control_vertex)) {
    umbrella.vertices = SharpUmbrella(samples, control_vertex);
  } else if (samples.refinement.levels.front().boundary_vertex[v]) {
    // The ring of a boundary vertex runs from one boundary neighbour to the other.
    umbrella.vertices.insert(umbrella.vertices.end(), {*begin, *(end - 1)});
  } else {
    umbrella.vertices.insert(umbrella.vertices.end(), begin, end);
  }
  return umbrella;
}

double FairnessOfRound(double start, double end, int round, int rounds) {
  if (rounds <= 1) return end;
  const double t = static_cast<double>(round) / (rounds - 1);
  if (start > 0 && end > 0) return start * std::pow(end / start, t);
  return start + t * (end - start);
}

}  // namespace rilievo
