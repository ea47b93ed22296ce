#include "core/domain/fairness.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

#include "core/base/ablation.h"
#include "core/base/parallel_for_each.h"
#include "core/base/status_macros.h"
#include "core/domain/settings.h"
#include "core/points/settings.h"

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

absl::StatusOr<std::vector<double>> FairnessWeights(const OrientedCloud& cloud,
                                                    const PointIndex& index,
                                                    const SampledSurface& surface,
                                                    const AreaShares& areas,
                                                    const RunContext& context) {
  std::vector<double> weights = areas.control_vertices;
  if (IsLeftOut(Mechanism::kStiffness)) return weights;
  const double usual = areas.area / static_cast<double>(weights.size());
  const auto weigh = [&](int64_t v) {
    std::array<int, kCommon.near_points> near;
    std::array<double, kCommon.near_points> squared;
    const int count =
        index.Nearest(surface.positions.col(v), std::min(kCommon.near_points, index.size()),
                      near.data(), squared.data());
    double noise = 0;
    for (int k = 0; k < count; ++k) noise += double{cloud.noise[near[k]]} / count;
    const double edge = std::sqrt(std::max(areas.area * weights[v], usual));
    const double thick = noise / (kFairness.thick_against_faces * edge);
    if (thick > 1) weights[v] *= std::pow(thick, kFairness.stiffening);
  };
  RILIEVO_RETURN_IF_ERROR(
      ParallelForEach(static_cast<int64_t>(weights.size()), kHeavyBlock, context, weigh));
  return weights;
}

double FairnessOfRound(double start, double end, int round, int rounds) {
  if (rounds <= 1) return end;
  const double t = static_cast<double>(round) / (rounds - 1);
  if (start > 0 && end > 0) return start * std::pow(end / start, t);
  return start + t * (end - start);
}

}  // namespace rilievo
