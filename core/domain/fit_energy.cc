#include "core/domain/fit_energy.h"

#include <numeric>
#include <utility>

#include "core/base/parallel_for.h"
#include "core/base/parallel_for_each.h"
#include "core/base/status_macros.h"
#include "core/domain/fairness.h"

namespace rilievo {

absl::StatusOr<FitEnergy> FitEnergy::Build(const DomainSamples& samples,
                                           std::vector<double> weights,
                                           const SampleTargets& targets,
                                           const RunContext& context) {
  FitEnergy energy(samples, std::move(weights), targets);
  energy.AddUmbrellas();
  energy.FindUses();
  RILIEVO_RETURN_IF_ERROR(context.CheckStop());
  return energy;
}

void FitEnergy::AddUmbrellas() {
  umbrella_begin_ = {0};
  for (int v = 0; v < samples_.control_vertex_count(); ++v) {
    const Umbrella umbrella = UmbrellaOf(samples_, v);
    const size_t neighbors = umbrella.vertices.size() - 1;
    for (size_t k = 0; neighbors > 0 && k <= neighbors; ++k) {
      umbrella_vertices_.push_back(umbrella.vertices[k]);
      umbrella_weights_.push_back(k == 0 ? -1.0 : 1.0 / static_cast<double>(neighbors));
    }
    umbrella_begin_.push_back(static_cast<int>(umbrella_vertices_.size()));
  }
}

void FitEnergy::FindUses() {
  const LimitStencils& stencils = samples_.stencils;
  use_begin_.assign(static_cast<size_t>(samples_.control_vertex_count()) + 1, 0);
  for (const int v : stencils.control_vertices) ++use_begin_[static_cast<size_t>(v) + 1];
  for (const int v : umbrella_vertices_) ++use_begin_[static_cast<size_t>(v) + 1];
  std::partial_sum(use_begin_.begin(), use_begin_.end(), use_begin_.begin());
  uses_.resize(static_cast<size_t>(use_begin_.back()));
  std::vector<int> next(use_begin_.begin(), use_begin_.end() - 1);
  const auto add_rows = [&](int first, const std::vector<int>& begin,
                            const std::vector<int>& vertices, const std::vector<double>& weights) {
    for (size_t row = 0; row + 1 < begin.size(); ++row) {
      for (int e = begin[row]; e < begin[row + 1]; ++e) {
        uses_[next[vertices[e]]++] = {first + static_cast<int>(row), weights[e]};
      }
    }
  };
  add_rows(0, stencils.begin, stencils.control_vertices, stencils.position);
  add_rows(samples_.size(), umbrella_begin_, umbrella_vertices_, umbrella_weights_);
}

// Half of the row's part of 2 E; `pull` is the derivative of it by the row's sum.
double FitEnergy::Pull(int row, const Eigen::Matrix4Xd& points, Eigen::Vector4d* pull) const {
  const auto sum = [&](int begin, int end, const int* vertices, const double* weights) {
    Eigen::Vector4d at = Eigen::Vector4d::Zero();
    for (int e = begin; e < end; ++e) at += weights[e] * points.col(vertices[e]);
    return at;
  };
  const int v = row - samples_.size();
  if (v >= 0) {
    const Eigen::Vector4d at = sum(umbrella_begin_[v], umbrella_begin_[v + 1],
                                   umbrella_vertices_.data(), umbrella_weights_.data());
    *pull = fairness_ * fairness_weights_[v] * at;
    return 0.5 * pull->dot(at);
  }
  const LimitStencils& stencils = samples_.stencils;
  const Eigen::Vector3d miss = sum(stencils.begin[row], stencils.begin[row + 1],
                                   stencils.control_vertices.data(), stencils.position.data())
                                   .head<3>() -
                               targets_.positions.col(row);
  Eigen::Vector3d pulled = Eigen::Vector3d::Zero();
  for (int r = 0; r < targets_.row_count[row]; ++r) {
    const Eigen::Vector3d direction = targets_.weighted_directions.block<3, 1>(3 * r, row);
    pulled += direction.dot(miss) * direction;
  }
  *pull << pulled, 0;
  return 0.5 * pulled.dot(miss);
}

absl::Status FitEnergy::Evaluate(const Eigen::Matrix3Xd& control_points, const RunContext& context,
                                 double* energy, Eigen::Matrix3Xd* gradient) const {
  Eigen::Matrix4Xd points(4, control_points.cols());
  points.topRows<3>() = control_points;
  points.row(3).setZero();
  const int rows = samples_.size() + samples_.control_vertex_count();
  Eigen::Matrix4Xd pulls(4, rows);
  std::vector<double> parts(static_cast<size_t>((rows + kSearchBlock - 1) / kSearchBlock), 0);
  RILIEVO_RETURN_IF_ERROR(ParallelFor(rows, kSearchBlock, context, [&](int64_t begin, int64_t end) {
    double part = 0;
    Eigen::Vector4d pull;
    for (int64_t row = begin; row < end; ++row) {
      part += Pull(static_cast<int>(row), points, &pull);
      pulls.col(row) = pull;
    }
    parts[static_cast<size_t>(begin / kSearchBlock)] = part;
  }));
  *energy = std::accumulate(parts.begin(), parts.end(), 0.0);
  if (gradient == nullptr) return absl::OkStatus();
  gradient->resize(3, control_points.cols());
  return ParallelForEach(control_points.cols(), kHeavyBlock, context, [&](int64_t v) {
    Eigen::Vector4d sum = Eigen::Vector4d::Zero();
    for (int k = use_begin_[v]; k < use_begin_[v + 1]; ++k) {
      sum += uses_[k].weight * pulls.col(uses_[k].row);
    }
    gradient->col(v) = sum.head<3>();
  });
}

absl::Status FitEnergy::DiagonalBlocks(const RunContext& context, Eigen::Matrix3Xd* blocks) const {
  const int count = samples_.control_vertex_count();
  blocks->resize(3, 3 * count);
  return ParallelForEach(count, kHeavyBlock, context, [&](int64_t v) {
    Eigen::Matrix3d block = Eigen::Matrix3d::Zero();
    for (int k = use_begin_[v]; k < use_begin_[v + 1]; ++k) {
      const auto [row, weight] = uses_[k];
      if (row >= samples_.size()) {
        const double share = fairness_weights_[row - samples_.size()];
        block.diagonal().array() += weight * weight * fairness_ * share;
        continue;
      }
      for (int r = 0; r < targets_.row_count[row]; ++r) {
        const Eigen::Vector3d direction =
            weight * targets_.weighted_directions.block<3, 1>(3 * r, row);
        block += direction * direction.transpose();
      }
    }
    blocks->middleCols<3>(3 * v) = block;
  });
}

}  // namespace rilievo
