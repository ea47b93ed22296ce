#include "core/domain/face_residual.h"

#include <ceres/cost_function.h>

#include <algorithm>
#include <span>
#include <utility>

namespace rilievo {
namespace {

std::span<const int> OwnedSamples(const DomainSamples& samples, int face) {
  const int begin = samples.owned_begin[static_cast<size_t>(face)];
  const int end = samples.owned_begin[static_cast<size_t>(face) + 1];
  return {samples.owned.data() + begin, static_cast<size_t>(end - begin)};
}

class FaceResidual final : public ceres::CostFunction {
 public:
  FaceResidual(const DomainSamples& samples, int face, const SampleTargets& targets)
      : samples_(OwnedSamples(samples, face)), targets_(targets) {
    const std::vector<int> points = ControlPointsOfFace(samples, face);
    stencils_.setZero(static_cast<Eigen::Index>(points.size()),
                      static_cast<Eigen::Index>(samples_.size()));
    int rows = 0;
    for (size_t s = 0; s < samples_.size(); ++s) {
      const auto sample = static_cast<size_t>(samples_[s]);
      rows += targets.row_count[sample];
      for (int e = samples.stencils.begin[sample]; e < samples.stencils.begin[sample + 1]; ++e) {
        const int vertex = samples.stencils.control_vertices[static_cast<size_t>(e)];
        const auto place = std::lower_bound(points.begin(), points.end(), vertex);
        stencils_(place - points.begin(), static_cast<Eigen::Index>(s)) =
            samples.stencils.position[static_cast<size_t>(e)];
      }
    }
    set_num_residuals(rows);
    mutable_parameter_block_sizes()->assign(points.size(), 3);
  }

  bool Evaluate(double const* const* control_points, double* residuals,
                double** jacobians) const override {
    int row = 0;
    for (size_t s = 0; s < samples_.size(); ++s) {
      const int sample = samples_[s];
      const auto weights = stencils_.col(static_cast<Eigen::Index>(s));
      Eigen::Vector3d miss = -targets_.positions.col(sample);
      for (Eigen::Index k = 0; k < weights.size(); ++k) {
        miss += weights[k] * Eigen::Map<const Eigen::Vector3d>(control_points[k]);
      }
      for (int r = 0; r < targets_.row_count[static_cast<size_t>(sample)]; ++r, ++row) {
        const Eigen::Vector3d direction = targets_.weighted_directions.block<3, 1>(3 * r, sample);
        residuals[row] = direction.dot(miss);
        if (jacobians == nullptr) continue;
        for (Eigen::Index k = 0; k < weights.size(); ++k) {
          if (jacobians[k] == nullptr) continue;
          Eigen::Map<Eigen::Vector3d>(jacobians[k] + 3 * row) = weights[k] * direction;
        }
      }
    }
    return true;
  }

 private:
  const std::span<const int> samples_;
  const SampleTargets& targets_;
  Eigen::MatrixXd stencils_;  // (control point, sample): a_ij
};

}  // namespace

std::vector<int> ControlPointsOfFace(const DomainSamples& samples, int face) {
  std::vector<int> points;
  for (int sample : OwnedSamples(samples, face)) {
    const auto begin = samples.stencils.control_vertices.begin();
    points.insert(points.end(), begin + samples.stencils.begin[static_cast<size_t>(sample)],
                  begin + samples.stencils.begin[static_cast<size_t>(sample) + 1]);
  }
  std::sort(points.begin(), points.end());
  points.erase(std::unique(points.begin(), points.end()), points.end());
  return points;
}

std::unique_ptr<ceres::CostFunction> MakeFaceResidual(const DomainSamples& samples, int face,
                                                      const SampleTargets& targets) {
  if (OwnedSamples(samples, face).empty()) return nullptr;
  return std::make_unique<FaceResidual>(samples, face, targets);
}

}  // namespace rilievo
