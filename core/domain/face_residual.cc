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
  FaceResidual(const DomainSamples& samples, int face, const std::vector<int>& points,
               const SampleTargets& targets)
      : samples_(OwnedSamples(samples, face)), stencils_(samples.stencils), targets_(targets) {
    size_t entries = 0;
    int rows = 0;
    for (const int sample : samples_) {
      entries += EntriesOf(sample).size();
      rows += targets.row_count[static_cast<size_t>(sample)];
    }
    blocks_.reserve(entries);
    for (const int sample : samples_) {
      for (const int vertex : EntriesOf(sample)) {
        const auto place = std::lower_bound(points.begin(), points.end(), vertex);
        blocks_.push_back(static_cast<int>(place - points.begin()));
      }
    }
    set_num_residuals(rows);
    mutable_parameter_block_sizes()->assign(points.size(), 3);
  }

  bool Evaluate(double const* const* control_points, double* residuals,
                double** jacobians) const override {
    for (size_t k = 0; jacobians != nullptr && k < parameter_block_sizes().size(); ++k) {
      if (jacobians[k] != nullptr) std::fill_n(jacobians[k], 3 * num_residuals(), 0.0);
    }
    int row = 0;
    const int* blocks = blocks_.data();
    for (const int sample : samples_) {
      const size_t count = EntriesOf(sample).size();
      const double* const weights =
          stencils_.position.data() + stencils_.begin[static_cast<size_t>(sample)];
      Eigen::Vector3d miss = -targets_.positions.col(sample);
      for (size_t e = 0; e < count; ++e) {
        miss += weights[e] * Eigen::Map<const Eigen::Vector3d>(control_points[blocks[e]]);
      }
      for (int r = 0; r < targets_.row_count[static_cast<size_t>(sample)]; ++r, ++row) {
        const Eigen::Vector3d direction = targets_.weighted_directions.block<3, 1>(3 * r, sample);
        residuals[row] = direction.dot(miss);
        if (jacobians == nullptr) continue;
        for (size_t e = 0; e < count; ++e) {
          double* const jacobian = jacobians[blocks[e]];
          if (jacobian == nullptr) continue;
          Eigen::Map<Eigen::Vector3d>(jacobian + 3 * row) = weights[e] * direction;
        }
      }
      blocks += count;
    }
    return true;
  }

 private:
  // The control vertices of a sample's stencil.
  std::span<const int> EntriesOf(int sample) const {
    const auto begin = static_cast<size_t>(stencils_.begin[static_cast<size_t>(sample)]);
    const auto end = static_cast<size_t>(stencils_.begin[static_cast<size_t>(sample) + 1]);
    return {stencils_.control_vertices.data() + begin, end - begin};
  }

  const std::span<const int> samples_;
  const LimitStencils& stencils_;
  const SampleTargets& targets_;
  std::vector<int> blocks_;  // of each entry of the samples' stencils in turn: its parameter block
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
                                                      const std::vector<int>& points,
                                                      const SampleTargets& targets) {
  if (OwnedSamples(samples, face).empty()) return nullptr;
  return std::make_unique<FaceResidual>(samples, face, points, targets);
}

}  // namespace rilievo
