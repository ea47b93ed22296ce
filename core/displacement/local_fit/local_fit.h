// Moving least squares along a normal ray, for scans whose noise shows between their points.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>
#include <vector>

#include "core/displacement/local_fit/normal_equations.h"
#include "core/displacement/local_fit/scale_ladder.h"
#include "core/displacement/rays/neighbor_queue.h"

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
  // Standard deviation of `height` where it is already a measurement, to be improved only by what
  // agrees with it; 0: it is a guess.
  float deviation = 0;
};

// Radius of the widest window.
inline constexpr float kWidestFitSpacings = 6.32f;

// What was seen around a ray, from which its height follows.
struct MultiscaleFit {
  ScaleLadder ladder;
  float height = 0, spacing = 0;  // the requested height; the unit of the ladder
};

// What the window chosen of a view's ladder says of the height.
LocalFit SelectFit(const MultiscaleFit& view, const FitWindow& window);

// Fits weighted planes and quadrics height(u, v) in nested windows of growing radius. Points whose
// normal turns away from the ray's foot count less, so that a window does not reach around an edge;
// points that stand off a window's fit by several times the noise are dropped and the window is
// fitted again. Where many of the nearest normals turn away and the points bend as they do there is
// an edge: its other side is fitted as well, and the ray meets the lower of the two where they meet
// convexly, the higher where concavely. Planes are for guesses where no quadric stands.
class LocalFitter {
 public:
  // The points that the next fits draw on: those within kWidestFitSpacings of their rays. Rays
  // that lie close together share them.
  void SetPatch(std::span<const QueuedPoint> points, const RayCloud& cloud);

  MultiscaleFit FitScales(const Ray& ray, const LocalFitRequest& request);

 private:
  // The other side of an edge near the ray.
  struct OtherSide {
    Eigen::Vector3f normal;
    bool convex;
  };
  std::optional<OtherSide> FindOtherSide(const LocalFitRequest& request) const;
  // `first`, `last`: of the sizes of windows.
  ScaleLadder FitScalesOfSide(const Ray& ray, const LocalFitRequest& request, int first, int last);
  // Where normals turn away as at an edge: the one window of the side that is met, none where
  // neither side stands. Nothing where the points do not bend as the normals do. Projected for the
  // request before, and for another after.
  std::optional<ScaleLadder> FitScalesAtEdge(const Ray& ray, const LocalFitRequest& request,
                                             const OtherSide& other_side);
  ScaleLadder FitAllScales(const Ray& ray, const LocalFitRequest& request);
  // Of two sides and their meeting, what the ray meets of the one that describes the points around
  // it best; null where that is the first side, as if there were no other.
  const FitWindow* Choose(const FitWindow& side, const FitWindow& other, bool convex,
                          float noise) const;
  // The patch in the frame of the ray, nearest windows first. Lengths in spacings.
  void Project(const Ray& ray, const LocalFitRequest& request);
  template <int kTerms>
  bool DropOutliers(float scale, int inside, float most,
                    const Eigen::Matrix<double, kTerms, 1>& fit);
  template <int kTerms>
  bool Accumulate(float scale, int inside, const std::vector<float>& weights,
                  NormalEquations<kTerms>* equations) const;
  template <int kTerms>
  std::optional<FitWindow> Fit(float radius, int inside, float outlier_distance);

  // Structures of arrays, padded to whole lanes with points of weight 0.
  std::vector<float> patch_[6];  // position, normal
  int patch_size_ = 0;
  std::vector<float> far_u_, far_v_, far_height_, far_weight_, far_square_;
  std::vector<int> far_window_;                               // the narrowest that holds each point
  std::vector<float> u_, v_, height_, weight_, kept_weight_;  // by window
  std::vector<int> inside_;                                   // points within each window
};

}  // namespace rilievo
