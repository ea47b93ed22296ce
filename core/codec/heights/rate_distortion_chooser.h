// Which coefficients an encoder writes: those that lower error + lambda * bits.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <utility>
#include <vector>

#include "core/codec/heights/height_coder.h"
#include "core/codec/heights/height_layout.h"
#include "core/loop/refinement.h"

namespace rilievo {

// Chooses the coefficient with the least of error + lambda * bits, asking the models that will code
// it what each would cost now.
class RateDistortionChooser {
 public:
  RateDistortionChooser(const LoopRefinement& refinement, int level, const Dequantizer& dequantizer,
                        double lambda, const std::vector<double>& targets,
                        const std::vector<double>& gains, double mean_gain)
      : dequantizer_(dequantizer),
        lambda_(lambda),
        targets_(targets),
        gains_(gains),
        gain_scale_(mean_gain > 0 ? 1 / mean_gain : 0) {
    if (level >= 2) FindActive(refinement, level);
  }

  // Whether no coefficient of vertices [begin, end) is worth its bits.
  bool Empty(int begin, int end) const {
    if (!active_.empty()) {
      return std::find(active_[0].begin(), active_[0].end(), 1) == active_[0].end();
    }
    return std::all_of(targets_.begin() + begin, targets_.begin() + end, [&](double target) {
      return std::abs(target) < kLeastWorth * dequantizer_.step;
    });
  }

  bool Active(int j, int f) const { return active_[j][f] != 0; }

  int32_t Choose(int v, const HeightModels::Coefficients& model,
                 const HeightModels::Coefficients::Contexts& contexts) {
    const double y = std::abs(targets_[v]) / dequantizer_.step;
    const int32_t low = static_cast<int32_t>(std::min<double>(y, kMaxCoefficient - 1));
    const bool rounds_up = y - low >= kLeastRest;
    if (low == 0 && !rounds_up) return 0;
    HeightModels::Coefficients::Prices prices(model, contexts);
    double best_cost = std::numeric_limits<double>::infinity();
    int32_t best = 0;
    const auto consider = [&](int32_t candidate) {
      const double cost =
          Error(v, y, candidate) +
          lambda_ * (prices.Bits(static_cast<uint32_t>(candidate)) + (candidate != 0 ? 1 : 0));
      if (cost < best_cost) {
        best_cost = cost;
        best = candidate;
      }
    };
    if (rounds_up) consider(low + 1);
    consider(low);
    if (low > 0 && low <= kMostDropped) consider(0);
    return targets_[v] < 0 ? -best : best;
  }

 private:
  double Error(int v, double y, int32_t magnitude) const {
    const double decoded = static_cast<double>(dequantizer_.Value(magnitude)) / dequantizer_.step;
    return gains_[v] * gain_scale_ * (y - decoded) * (y - decoded);
  }

  // Rough cost of a block: a few bits for each coefficient, against the error it saves.
  void FindActive(const LoopRefinement& refinement, int level) {
    const MeshTopology& topology = refinement.levels[level - 1];
    const int leaf = level - 2;
    std::vector<double> saved(refinement.levels[leaf].face_count(), 0);
    for (int e = 0; e < topology.edge_count(); ++e) {
      const int v = topology.vertex_count + e;
      const double y = std::abs(targets_[v]) / dequantizer_.step;
      if (y < kLeastWorth) continue;
      const int32_t magnitude = static_cast<int32_t>(std::min<double>(y + 0.4, kMaxCoefficient));
      const double bits = 3.5 + 2 * std::log2(magnitude);
      const double gain = Error(v, y, 0) - Error(v, y, magnitude) - lambda_ * bits;
      if (gain > 0) saved[topology.edge_faces(0, e) >> 2] += gain;
    }
    active_.resize(level - 1);
    for (int j = leaf; j >= 0; --j) {
      active_[j].resize(refinement.levels[j].face_count());
      std::vector<double> above(j > 0 ? refinement.levels[j - 1].face_count() : 0, 0);
      for (size_t f = 0; f < active_[j].size(); ++f) {
        const double gain = saved[f] - lambda_ * (j == leaf ? 1.5 : 1.0);
        active_[j][f] = gain > 0;
        if (gain > 0 && j > 0) above[f >> 2] += gain;
      }
      saved = std::move(above);
    }
    // What is cut off above is off below.
    for (int j = 1; j <= leaf; ++j) {
      for (size_t f = 0; f < active_[j].size(); ++f) {
        if (active_[j - 1][f >> 2] == 0) active_[j][f] = 0;
      }
    }
  }

  static constexpr double kLeastWorth = 0.6;  // steps; what is smaller becomes zero
  static constexpr double kLeastRest = 0.4;   // steps; what is less is not rounded up
  static constexpr int32_t kMostDropped = 2;  // larger ones do not become zero

  Dequantizer dequantizer_;
  double lambda_;
  const std::vector<double>& targets_;
  const std::vector<double>& gains_;
  double gain_scale_;
  std::vector<std::vector<uint8_t>> active_;
};

}  // namespace rilievo
