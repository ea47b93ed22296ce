// Moving least squares along a normal ray, for scans whose noise shows between their points.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>
#include <vector>

#include "core/displacement/neighbor_queue.h"

namespace rilievo {

struct LocalFit {
  float height;     // of the surface where the ray meets it
  float deviation;  // expected standard deviation of `height` under the noise given
  float points;     // effective number of points it rests on
};

// Fits weighted planes and quadrics height(u, v) in nested windows of growing radius and goes on
// to the wider one while it agrees with what the narrower ones said, within the noise (stagewise
// aggregation, Belomestny and Spokoiny 2007, in the spirit of Lepski's rule): wide windows on
// smooth parts, narrow ones on detail. Points whose normal turns away from the ray's foot count
// less, so that a window does not reach around an edge; points that stand off a window's fit by
// several times the noise are dropped and the window is fitted again.
class LocalFitter {
 public:
  // `queue` in any order, `complete_radius`: all points this near to the ray are in it.
  // `foot_normal`: unit normal of the surface near the ray. `noise`: standard deviation of the
  // points off the surface, > 0. `start`: an estimate of the height. Fails when fewer than
  // kLeastFitPoints points take part.
  std::optional<LocalFit> Fit(std::span<const QueuedPoint> queue, const RayCloud& cloud,
                              const Ray& ray, const Eigen::Vector3f& foot_normal, float noise,
                              float start, float complete_radius);

 private:
  struct Window {
    float height, variance_factor, residual, points;
  };
  bool Load(std::span<const QueuedPoint> queue, const RayCloud& cloud,
            const Eigen::Vector3f& foot_normal, float start);
  std::optional<Window> FitWindow(float radius, bool quadric, float outlier_distance);
  template <int kTerms>
  std::optional<Window> SolveWindow(float radius, float outlier_distance);

  // Structure of arrays, in ascending distance from the ray, padded with weight 0 to full lanes.
  std::vector<int> order_;
  std::vector<float> distance_, u_, v_, height_, weight_, drop_;
  int count_ = 0;
};

inline constexpr int kLeastFitPoints = 5;
// Most points a window takes.
inline constexpr int kMostFitPoints = 160;

}  // namespace rilievo
