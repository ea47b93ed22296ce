// What windows of growing radius say of one height, and how far to follow the wider ones.
#pragma once

#include <array>
#include <optional>
#include <span>

namespace rilievo {

// Of a surface along a ray. Lengths in spacings of the points there.
struct FitWindow {
  float height;            // above the requested one
  float slope_u, slope_v;  // of the surface at the ray
  float variance_factor;   // of the height, in squared noises along the ray
};

// Windows that hold more and more of the points around one ray, the narrowest first: each is made
// of the points of those before it and more.
struct WindowLadder {
  static constexpr int kMostRungs = 7;

  float noise = 0;  // standard deviation of the points along the ray, in spacings, > 0
  int count = 0;
  std::array<FitWindow, kMostRungs> windows{};
  std::array<int, kMostRungs> rungs{};  // the place of each window among all sizes there are

  void Add(int rung, const FitWindow& window);
};

// How much the windows of each size may be followed in a region. What two nested windows of a
// smooth surface say differs by no more than the noise explains: in the mean square by the
// difference of their variances. Where it differs by more, the wider one is off by detail that it
// spans, and its weight falls with the share of the noise in the difference (after James and Stein
// 1961), which many rays together show and one alone does not.
class LadderTrust {
 public:
  LadderTrust() = default;  // all are followed
  explicit LadderTrust(std::span<const WindowLadder> region);

  // The weight of windows of that size, [0, 1].
  float of(int rung) const { return weights_[rung]; }

 private:
  std::array<float, WindowLadder::kMostRungs> weights_ = {1, 1, 1, 1, 1, 1, 1};
};

// Climbs the ladder while the wider window agrees with what the narrower ones said, within the
// noise (stagewise aggregation, Belomestny and Spokoiny 2007, in the spirit of Lepski's rule): wide
// windows on smooth parts, narrow ones on detail. Nothing from an empty ladder.
std::optional<FitWindow> Climb(const WindowLadder& ladder, const LadderTrust& trust);

// Whether a window is so far off that nothing wider needs to be looked at.
bool IsOut(const FitWindow& window, const FitWindow& narrower, float noise);

}  // namespace rilievo
