#include "core/codec/heights/height_weights.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "core/surface/stored_surface.h"

namespace rilievo {
namespace {

constexpr int kProbes = 2;
// Small faces have details of their own: with weights below this share of the mean their largest
// errors doubled, for 1 % fewer bytes.
constexpr double kLeastShare = 0.25;

// Signs from a counter (SplitMix64): the same on every machine.
double RandomSign(uint64_t counter) {
  uint64_t x = (counter + 1) * 0x9e3779b97f4a7c15u;
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9u;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebu;
  return (x >> 63) != 0 ? 1.0 : -1.0;
}

double FaceArea(const ControlMesh& mesh, int face) {
  const Eigen::Vector3d a = mesh.vertices.col(mesh.faces(0, face));
  const Eigen::Vector3d ab = mesh.vertices.col(mesh.faces(1, face)) - a;
  const Eigen::Vector3d ac = mesh.vertices.col(mesh.faces(2, face)) - a;
  return ab.cross(ac).norm() / 2;
}

// Weights of the finest level gathered on the vertices of each coarser level: entry v of level l
// is the mean over what v's basis function covers.
void PoolWeights(const LoopRefinement& refinement, int max_level, std::vector<double>& weights,
                 std::vector<double>& pooled) {
  for (int l = max_level; l >= 1; --l) {
    const MeshTopology& topology = refinement.levels[l - 1];
    const int count = topology.vertex_count;
    std::vector<double> sum(weights.begin(), weights.begin() + count), share(count, 1);
    for (int e = 0; e < topology.edge_count(); ++e) {
      const double weight = weights[count + e];
      pooled[count + e] = weight;
      for (int side = 0; side < 2; ++side) {
        sum[topology.edge_vertices(side, e)] += weight / 2;
        share[topology.edge_vertices(side, e)] += 0.5;
      }
    }
    for (int v = 0; v < count; ++v) weights[v] = sum[v] / share[v];
  }
  std::copy_n(weights.begin(), refinement.levels[0].vertex_count, pooled.begin());
}

}  // namespace

std::vector<double> HeightWeights(const ControlMesh& mesh, const LoopRefinement& refinement,
                                  int max_level, const std::vector<uint8_t>& rings,
                                  double mean_of_whole) {
  const int last = std::max(0, max_level - 1);  // its faces, or their four children each
  const MeshTopology& topology = refinement.levels[last];
  std::vector<double> weights(refinement.vertex_count(max_level), 0);
  std::vector<double> areas(mesh.faces.cols());
  for (int f = 0; f < mesh.faces.cols(); ++f) areas[f] = FaceArea(mesh, f);
  for (int f = 0; f < topology.face_count(); ++f) {
    const double area = areas[f >> 2 * last];
    for (int k = 0; k < 3; ++k) {
      weights[topology.faces(k, f)] += area;
      if (max_level > 0) weights[topology.vertex_count + topology.face_edges(k, f)] += 3 * area;
    }
  }
  double mean = mean_of_whole, sum = 0;
  if (mean_of_whole == 0) {
    for (double weight : weights) mean += weight / static_cast<double>(weights.size());
  }
  for (size_t v = 0; v < weights.size(); ++v) {
    const double share = rings[v] == 0 ? 1 : rings[v] <= kRimRings ? kRimShare : 0;
    weights[v] = share * std::max(weights[v], kLeastShare * mean);
    sum += weights[v];
  }
  const double scale = mean_of_whole > 0 ? mean_of_whole : sum;
  if (scale > 0) {
    for (double& weight : weights) weight /= scale;
  }
  return weights;
}

double MeanHeightWeight(const ControlMesh& mesh, const MeshTopology& topology, int max_level) {
  double area = 0;
  for (int f = 0; f < mesh.faces.cols(); ++f) area += FaceArea(mesh, f);
  // A face of the level before counts with three at its corners, and three times that at its edges.
  const double counted = max_level == 0 ? 3 : 12 * std::ldexp(1.0, 2 * (max_level - 1));
  return counted * area / static_cast<double>(VertexCountAt(topology, max_level));
}

CoefficientGains GainsOf(const HeightLifting& lifting, const LoopRefinement& refinement,
                         const std::vector<double>& weights) {
  const int max_level = lifting.max_level();
  CoefficientGains gains;
  gains.of_vertex.assign(weights.size(), 0);
  std::vector<double> pool = weights;
  PoolWeights(refinement, max_level, pool, gains.of_vertex);
  std::vector<double> probe(weights.size());
  for (int l = 0; l <= max_level; ++l) {
    double energy = 0;
    for (int round = 0; round < kProbes; ++round) {
      std::fill(probe.begin(), probe.end(), 0.0);
      for (int v = lifting.begin(l); v < lifting.end(l); ++v) {
        probe[v] = RandomSign(static_cast<uint64_t>(v) * kProbes + round);
      }
      lifting.Synthesize(probe);
      for (size_t v = 0; v < probe.size(); ++v) energy += weights[v] * probe[v] * probe[v];
    }
    energy /= kProbes;
    double pooled = 0;
    for (int v = lifting.begin(l); v < lifting.end(l); ++v) pooled += gains.of_vertex[v];
    const double scale = pooled > 0 ? energy / pooled : 0;
    for (int v = lifting.begin(l); v < lifting.end(l); ++v) gains.of_vertex[v] *= scale;
    gains.of_level.push_back(scale);
  }
  return gains;
}

CoefficientGains GainsOf(const std::vector<double>& of_level, const HeightLifting& lifting,
                         const LoopRefinement& refinement, const std::vector<double>& weights) {
  CoefficientGains gains{std::vector<double>(weights.size(), 0), of_level};
  std::vector<double> pool = weights;
  PoolWeights(refinement, lifting.max_level(), pool, gains.of_vertex);
  for (int l = 0; l <= lifting.max_level(); ++l) {
    for (int v = lifting.begin(l); v < lifting.end(l); ++v) gains.of_vertex[v] *= of_level[l];
  }
  return gains;
}

}  // namespace rilievo
