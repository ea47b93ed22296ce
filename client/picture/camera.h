// Where a picture is taken from, and where points of the scene fall on it.
#pragma once

#include <Eigen/Core>

namespace rilievo {

enum class UpAxis { kY, kZ };

// The camera looks at the middle of the scene and is as near as keeps all of it in the frame.
struct Camera {
  double turn_degrees = 35;           // around the up axis
  double elevation_degrees = 25;      // above the horizon, [-90, 90]
  bool perspective = true;            // else orthographic
  double field_of_view_degrees = 30;  // (1, 120), of the shorter side
  UpAxis up = UpAxis::kZ;
};

// A vertex on the picture. `nearness` grows towards the camera and is linear on the picture along
// straight lines of the scene (1 / depth in perspective, minus depth else).
struct Projected {
  float x, y;  // pixels from the left and from the top
  float nearness;
};

class Projection {
 public:
  // Frames the finite columns of `points` on width x height pixels with a margin of 4 %.
  Projection(const Camera& camera, const Eigen::Matrix3Xd& points, int width, int height);

  Projected Project(const Eigen::Vector3d& point) const;
  // The nearness of what lies a little closer, by 0.4 % of the depth or of the scene.
  float Nearer(float nearness) const {
    return perspective_ ? 1.004f * nearness : nearness + 0.004f;
  }
  // Rows: right, up, towards the camera.
  const Eigen::Matrix3d& view_from_scene() const { return view_from_scene_; }
  // Towards the camera from `point`, unit, in view axes.
  Eigen::Vector3d TowardsCamera(const Eigen::Vector3d& point) const;
  // Size of a sample in the middle of the scene, in units of half the scene's view-box diagonal.
  double scaled_units_per_sample() const;
  // Coordinate towards the camera, in the same units, of what has this nearness.
  float HeightFromNearness(float nearness) const;

 private:
  bool perspective_;
  Eigen::Matrix3d view_from_scene_;
  Eigen::Vector3d center_;   // of the view frame, in view axes
  double scale_ = 1;         // scene is divided by it first
  double distance_ = 0;      // of the camera from the centre, scaled
  double focal_pixels_ = 1;  // pixels a scaled unit at distance one (or at all, orthographic)
  double half_width_, half_height_;
};

// Points of the narrowest upright cylinder around the middle of `points` that holds them, seen from
// the camera: framed by them, the scene keeps its place and size at every turn.
Eigen::Matrix3Xd CylinderAround(const Eigen::Matrix3Xd& points, const Camera& camera);

}  // namespace rilievo
