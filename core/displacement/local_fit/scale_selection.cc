#include "core/displacement/local_fit/scale_selection.h"

#include <algorithm>
#include <cmath>

namespace rilievo {
namespace {

// The covariance of nested windows in variances of the wider one: 1 for equal weights, 1.16 for the
// weights 1 - r^2 of LocalFitter's quadrics, by simulation with uniform points.
constexpr float kOverlap = 1.16f;
// The bias of the narrower window in differences between the two, for windows that hold 1.8 times
// the points of the one before, on a surface so rough that the bias grows with the points. (With
// their square, as where a quadric spans little detail, it would be 0.45.)
constexpr float kNarrowBias = 1.25f;
// Rays within this many radii of the wider window say how it fares.
constexpr float kReach = 4.0f;
// Of the directions of rays that have detail in common.
constexpr float kLeastAgreement = 0.3f;

// Sums over rays, in squared spacings.
struct Evidence {
  float found = 0;     // squared differences of the wider window to the blend so far
  float expected = 0;  // of them, by noise alone
  float gain = 0;      // variance of the blend less its covariance with the wider window

  void Add(const Evidence& other, float weight) {
    found += weight * other.found;
    expected += weight * other.expected;
    gain += weight * other.gain;
  }

  // The share s of the wider window in the blend that makes least, per ray,
  //   variance(s) + (narrow bias + s * difference of biases)^2,
  // where the squared difference of the biases is what was found beyond the expected.
  float Share() const {
    if (!(found > 0)) return 1;
    const float detail = std::max(0.0f, found - expected);
    return std::clamp((gain - kNarrowBias * detail) / found, 0.0f, 1.0f);
  }
};

const FitWindow* WindowAt(const ScaleLadder& ladder, int level) {
  for (int i = 1; i < ladder.count; ++i) {
    if (ladder.levels[i] == level) return &ladder.windows[i];
  }
  return nullptr;
}

float Covariance(const FitWindow& wider) { return kOverlap * wider.variance_factor; }

// The wider window of that level, where there is one and it is the surer.
const FitWindow* NextWindow(const ScaleLadder& ladder, int level, const FitWindow& blend) {
  const FitWindow* const wider = WindowAt(ladder, level);
  return wider != nullptr && Covariance(*wider) < blend.variance_factor ? wider : nullptr;
}

Evidence EvidenceOf(const FitWindow& blend, const FitWindow& wider, float noise) {
  const float off = wider.height - blend.height, covariance = Covariance(wider);
  const float variance = blend.variance_factor + wider.variance_factor - 2 * covariance;
  return {off * off, noise * noise * std::max(variance, 0.0f),
          noise * noise * (blend.variance_factor - covariance)};
}

void Blend(const FitWindow& wider, float share, FitWindow* blend) {
  const float rest = 1 - share;
  blend->variance_factor = rest * rest * blend->variance_factor +
                           share * share * wider.variance_factor +
                           2 * share * rest * Covariance(wider);
  blend->height += share * (wider.height - blend->height);
  blend->slope_u += share * (wider.slope_u - blend->slope_u);
  blend->slope_v += share * (wider.slope_v - blend->slope_v);
}

// What the groups around say, the nearer the more.
Evidence Around(const RayGroup& center, std::span<const RayGroup> groups,
                std::span<const Evidence> evidence, int level) {
  const float radius = kReach * 0.5f * std::sqrt(kWindowSizes[level - 1].points) * center.spacing;
  Evidence sum;
  for (size_t g = 0; g < groups.size(); ++g) {
    const float square = (groups[g].position - center.position).squaredNorm();
    const float weight = 1 - square / (radius * radius);
    if (weight <= 0 || groups[g].direction.dot(center.direction) < kLeastAgreement) continue;
    sum.Add(evidence[g], weight);
  }
  return sum;
}

}  // namespace

std::vector<std::optional<FitWindow>> SelectScalesTogether(std::span<const ScaleLadder> ladders,
                                                           std::span<const RayGroup> groups) {
  std::vector<std::optional<FitWindow>> blends(ladders.size());
  for (size_t i = 0; i < ladders.size(); ++i) {
    if (ladders[i].count > 0) blends[i] = ladders[i].windows[0];
  }
  std::vector<Evidence> evidence(groups.size());
  for (int level = 1; level < ScaleLadder::kMostLevels; ++level) {
    for (size_t g = 0; g < groups.size(); ++g) {
      evidence[g] = {};
      for (const int ray : groups[g].rays) {
        if (!blends[ray]) continue;
        const FitWindow* const wider = NextWindow(ladders[ray], level, *blends[ray]);
        if (wider == nullptr) continue;
        evidence[g].Add(EvidenceOf(*blends[ray], *wider, ladders[ray].noise), 1);
      }
    }
    for (const RayGroup& group : groups) {
      const float share = Around(group, groups, evidence, level).Share();
      for (const int ray : group.rays) {
        if (!blends[ray]) continue;
        const FitWindow* const wider = NextWindow(ladders[ray], level, *blends[ray]);
        if (wider != nullptr) Blend(*wider, share, &*blends[ray]);
      }
    }
  }
  return blends;
}

}  // namespace rilievo
