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
};

struct LocalFitRequest {
  Eigen::Vector3f foot_normal;  // unit normal of the surface near the ray
  float height;                 // about where the ray meets the surface
  float noise;                  // standard deviation of the points off the surface, > 0
  float spacing;                // of the points there, > 0
};

// Most points that the widest window holds, and its radius in spacings: a disc of radius r holds
// (2 r / spacing)^2 points (see OrientedCloud::spacing).
inline constexpr int kMostFitPoints = 160;
inline constexpr float kWidestFitSpacings = 6.32f;

// Fits weighted planes and quadrics height(u, v) in nested windows of growing radius and goes on
// to the wider one while it agrees with what the narrower ones said, within the noise (stagewise
// aggregation, Belomestny and Spokoiny 2007, in the spirit of Lepski's rule): wide windows on
// smooth parts, narrow ones on detail. Points whose normal turns away from the ray's foot count
// less, so that a window does not reach around an edge; points that stand off a window's fit by
// several times the noise are dropped and the window is fitted again.
class LocalFitter {
 public:
  // The points that the next fits draw on: those within kWidestFitSpacings of their rays. Rays
  // that lie close together share them.
  void SetPatch(std::span<const QueuedPoint> points, const RayCloud& cloud);

  // Nothing where too few points take part.
  std::optional<LocalFit> Fit(const Ray& ray, const LocalFitRequest& request);

 private:
  struct Window {
    float height;           // above the requested one
    float variance_factor;  // of the height, in squared noises
  };
  // The patch in the frame of the ray, nearest windows first. Lengths in spacings.
  void Project(const Ray& ray, const LocalFitRequest& request);
  template <int kTerms>
  std::optional<Window> FitWindow(float radius, int inside, float outlier_distance);

  // Structures of arrays, padded to whole lanes with points of weight 0.
  std::vector<float> patch_[6];  // position, normal
  int patch_size_ = 0;
  std::vector<float> far_u_, far_v_, far_height_, far_weight_, far_square_;  // order of the patch
  std::vector<float> u_, v_, height_, weight_;                               // by window
  std::vector<int> inside_;  // points within each window
};

}  // namespace rilievo
