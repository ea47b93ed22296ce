#include "core/domain/fairness.h"

#include <ceres/cost_function.h>

#include <Eigen/Core>
#include <cmath>

namespace rilievo {
namespace {

class FairnessResidual final : public ceres::CostFunction {
 public:
  FairnessResidual(int neighbors, double area_share, const double* weight)
      : neighbors_(neighbors), area_share_(area_share), weight_(weight) {
    set_num_residuals(3);
    mutable_parameter_block_sizes()->assign(static_cast<size_t>(neighbors) + 1, 3);
  }

  bool Evaluate(double const* const* control_points, double* residuals,
                double** jacobians) const override {
    const double scale = std::sqrt(*weight_ * area_share_);
    Eigen::Map<Eigen::Vector3d> umbrella(residuals);
    umbrella.setZero();
    for (int k = 0; k <= neighbors_; ++k) {
      const double factor = k == 0 ? -scale : scale / neighbors_;
      umbrella += factor * Eigen::Map<const Eigen::Vector3d>(control_points[k]);
      if (jacobians == nullptr || jacobians[k] == nullptr) continue;
      Eigen::Map<Eigen::Matrix3d> jacobian(jacobians[k]);
      jacobian = factor * Eigen::Matrix3d::Identity();
    }
    return true;
  }

 private:
  const int neighbors_;
  const double area_share_;
  const double* const weight_;
};

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
  const VertexRings& rings = samples.control_rings;
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

std::unique_ptr<ceres::CostFunction> MakeFairnessResidual(int neighbors, double area_share,
                                                          const double* weight) {
  return std::make_unique<FairnessResidual>(neighbors, area_share, weight);
}

double FairnessOfRound(double start, double end, int round, int rounds) {
  if (rounds <= 1) return end;
  const double t = static_cast<double>(round) / (rounds - 1);
  if (start > 0 && end > 0) return start * std::pow(end / start, t);
  return start + t * (end - start);
}

}  // namespace rilievo
