#include "core/displacement/sample_colors.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <cstdint>
#include <utility>

#include "core/base/parallel_for_each.h"
#include "core/base/quantile.h"
#include "core/base/status_macros.h"
#include "core/displacement/feet/point_feet.h"
#include "core/displacement/settings.h"

namespace rilievo {
namespace {

using Color = Eigen::Vector3f;

// Red, green and blue times their weights, and the weights.
using Sum = std::array<int64_t, 4>;

class ColorSampler {
 public:
  ColorSampler(std::vector<PointFoot> feet, std::span<const Rgb> colors, int vertices,
               const RunContext& context)
      : feet_(std::move(feet)),
        given_(colors),
        context_(context),
        colors_(vertices, MeanOf(colors)),
        is_told_(vertices, 0) {}

  absl::Status Run(const LoopRefinement& refinement) {
    for (int step = 0; step < kSampleColors.steps; ++step) {
      if (step == 1) Fill(refinement);
      if (step > 0) RILIEVO_RETURN_IF_ERROR(FindScale());
      RILIEVO_RETURN_IF_ERROR(Step(step == 0));
    }
    return absl::OkStatus();
  }

  std::vector<Rgb> Rounded() const {
    std::vector<Rgb> rounded(colors_.size());
    for (size_t v = 0; v < rounded.size(); ++v) {
      for (int k = 0; k < 3; ++k) {
        rounded[v][k] = static_cast<uint8_t>(std::lround(std::clamp(colors_[v][k], 0.0F, 255.0F)));
      }
    }
    return rounded;
  }

 private:
  static Color MeanOf(std::span<const Rgb> colors) {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (const Rgb& color : colors) sum += Eigen::Vector3d(color[0], color[1], color[2]);
    return (sum / static_cast<double>(std::max<size_t>(1, colors.size()))).cast<float>();
  }

  // Barycentric coordinates of a foot that was found; beyond a rim those of the nearest place.
  static std::array<float, 3> PlaceOf(const PointFoot& foot) {
    std::array<float, 3> place;
    float sum = 0;
    for (size_t k = 0; k < 3; ++k) sum += place[k] = std::max(0.0F, foot.weight[k]);
    for (float& part : place) part = sum > 0 ? part / sum : 1.0F / 3;
    return place;
  }

  // What the point's colour has more than its foot.
  Color Missing(size_t p, const std::array<float, 3>& place) const {
    Color missing(given_[p][0], given_[p][1], given_[p][2]);
    for (size_t k = 0; k < 3; ++k) missing -= place[k] * colors_[feet_[p].corner[k]];
    return missing;
  }

  absl::Status FindScale() {
    std::vector<float> misses(feet_.size(), -1);
    RILIEVO_RETURN_IF_ERROR(
        ParallelForEach(static_cast<int64_t>(feet_.size()), kLightBlock, context_, [&](int64_t p) {
          if (feet_[p].found()) misses[p] = Missing(p, PlaceOf(feet_[p])).norm();
        }));
    std::erase_if(misses, [](float missing) { return missing < 0; });
    if (misses.empty()) return absl::OkStatus();
    scale_ = std::max(kSampleColors.least_scale, kSampleColors.scales * Median(std::move(misses)));
    return absl::OkStatus();
  }

  double TrustIn(const Color& missing, bool is_first) const {
    if (is_first) return 1;
    const double share = missing.norm() / scale_;
    return 1 / ((1 + share * share) * (1 + share * share));
  }

  // Adds to each vertex the mean of what its points miss.
  absl::Status Step(bool is_first) {
    std::vector<Sum> sums(colors_.size(), Sum{});
    const auto add = [](int64_t& sum, double value) {
      std::atomic_ref(sum).fetch_add(std::llround(kSampleColors.units * value),
                                     std::memory_order_relaxed);
    };
    RILIEVO_RETURN_IF_ERROR(
        ParallelForEach(static_cast<int64_t>(feet_.size()), kLightBlock, context_, [&](int64_t p) {
          if (!feet_[p].found()) return;
          const std::array<float, 3> place = PlaceOf(feet_[p]);
          const Color missing = Missing(p, place);
          const double trust = TrustIn(missing, is_first);
          for (size_t k = 0; k < 3; ++k) {
            Sum& sum = sums[feet_[p].corner[k]];
            const double weight = trust * place[k];
            for (int channel = 0; channel < 3; ++channel) {
              add(sum[channel], weight * missing[channel]);
            }
            add(sum[3], weight);
          }
        }));
    for (size_t v = 0; v < sums.size(); ++v) {
      if (sums[v][3] == 0) continue;
      const Color sum(static_cast<float>(sums[v][0]), static_cast<float>(sums[v][1]),
                      static_cast<float>(sums[v][2]));
      colors_[v] += sum / static_cast<float>(sums[v][3]);
      is_told_[v] = 1;
    }
    return absl::OkStatus();
  }

  // Colours for vertices without points: coarser levels collect what their finer vertices have,
  // then hand it down.
  void Fill(const LoopRefinement& refinement) {
    std::vector<Color> collected(colors_);
    std::vector<float> weight(is_told_.begin(), is_told_.end());
    for (int level = refinement.max_level() - 1; level >= 0; --level) {
      const MeshTopology& topology = refinement.levels[level];
      for (int e = 0; e < topology.edge_count(); ++e) {
        const int v = topology.vertex_count + e;
        for (const int end : topology.edge_vertices.col(e)) {
          if (is_told_[end] != 0 || weight[v] == 0) continue;
          const float more = weight[v] / 2;
          collected[end] =
              (weight[end] * collected[end] + more * collected[v]) / (weight[end] + more);
          weight[end] += more;
        }
      }
    }
    SpreadOver(refinement.levels.front(), &collected, &weight);
    for (int v = 0; v < refinement.levels.front().vertex_count; ++v) Take(v, collected[v]);
    for (int level = 0; level < refinement.max_level(); ++level) {
      const MeshTopology& topology = refinement.levels[level];
      for (int v = 0; v < topology.vertex_count; ++v) {
        if (weight[v] > 0) Take(v, collected[v]);
      }
      for (int e = 0; e < topology.edge_count(); ++e) {
        const int a = topology.edge_vertices(0, e), b = topology.edge_vertices(1, e);
        Take(topology.vertex_count + e, (colors_[a] + colors_[b]) / 2);
      }
    }
  }

  void Take(int v, const Color& color) {
    if (is_told_[v] == 0) colors_[v] = color;
  }

  // Rings of control vertices without any colour around take the means of those before.
  static void SpreadOver(const MeshTopology& control, std::vector<Color>* colors,
                         std::vector<float>* weight) {
    for (bool changed = true; changed;) {
      changed = false;
      std::vector<Color> sum(control.vertex_count, Color::Zero());
      std::vector<int> count(control.vertex_count, 0);
      for (int e = 0; e < control.edge_count(); ++e) {
        for (int side = 0; side < 2; ++side) {
          const int from = control.edge_vertices(side, e), to = control.edge_vertices(1 - side, e);
          if ((*weight)[from] == 0 || (*weight)[to] > 0) continue;
          sum[to] += (*colors)[from];
          ++count[to];
        }
      }
      for (int v = 0; v < control.vertex_count; ++v) {
        if (count[v] == 0) continue;
        (*colors)[v] = sum[v] / static_cast<float>(count[v]);
        (*weight)[v] = 1;
        changed = true;
      }
    }
  }

  const std::vector<PointFoot> feet_;
  const std::span<const Rgb> given_;
  const RunContext& context_;
  double scale_ = 0;
  std::vector<Color> colors_;
  std::vector<uint8_t> is_told_;
};

}  // namespace

absl::StatusOr<std::vector<Rgb>> SampleColors(const OrientedCloud& cloud,
                                              std::span<const Rgb> colors,
                                              const LoopRefinement& refinement,
                                              const LevelRings& rings, const LimitSurface& limit,
                                              const DisplacementOptions& options,
                                              const RunContext& context) {
  RILIEVO_ASSIGN_OR_RETURN(std::vector<PointFoot> feet,
                           FindFeet(cloud, refinement, rings, limit, options, context));
  ColorSampler sampler(std::move(feet), colors, static_cast<int>(limit.positions.cols()), context);
  RILIEVO_RETURN_IF_ERROR(sampler.Run(refinement));
  return sampler.Rounded();
}

}  // namespace rilievo
