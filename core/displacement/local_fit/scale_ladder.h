// What windows of growing radius say of one height.
#pragma once

#include <array>
#include <optional>

namespace rilievo {

// Of a surface along a ray. Lengths in spacings of the points there.
struct FitWindow {
  float height;            // above the requested one
  float slope_u, slope_v;  // of the surface at the ray
  float variance_factor;   // of the height, in squared noises along the ray
};

// The sizes of windows, narrowest first: a disc of radius r holds (2 r / spacing)^2 points (see
// OrientedCloud::spacing).
struct WindowSize {
  float points;
  bool quadric;  // a plane else
};
inline constexpr std::array<WindowSize, 6> kWindowSizes = {
    {{8, false}, {16, false}, {28, true}, {52, true}, {92, true}, {160, true}}};
inline constexpr int kWindowCount = static_cast<int>(kWindowSizes.size());

// Windows that hold more and more of the points around one ray, the narrowest first: each is made
// of the points of those before it and more.
struct ScaleLadder {
  // Level 0 is what was measured before, or the one window of an edge, level w + 1 the window of
  // size w.
  static constexpr int kMostLevels = kWindowCount + 1;

  float noise = 0;  // standard deviation of the points along the ray, in spacings, > 0
  int count = 0;
  std::array<FitWindow, kMostLevels> windows{};
  std::array<int, kMostLevels> levels{};  // the place of each window among all sizes there are

  void Add(int level, const FitWindow& window);
};

// Goes to wider windows while the wider window agrees with what the narrower ones said, within the
// noise (stagewise aggregation, Belomestny and Spokoiny 2007, in the spirit of Lepski's rule): wide
// windows on smooth parts, narrow ones on detail. Nothing from an empty ladder. For a ray that
// stands for itself; see SelectScalesTogether for the rays of a region.
std::optional<FitWindow> SelectScale(const ScaleLadder& ladder);

// Whether a window is so far off that nothing wider needs to be looked at.
bool IsOut(const FitWindow& window, const FitWindow& narrower, float noise);

}  // namespace rilievo
