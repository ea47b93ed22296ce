// Closed-form shapes whose distance to any point is known exactly: the ground truth of the tests.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

namespace rilievo {

// A surface in its own frame (unit: about the size of the shape). The surface is the zero set of
// Field(), cut to the points that pass Contains() when it is open.
class AnalyticShape {
 public:
  virtual ~AnalyticShape() = default;

  virtual std::string name() const = 0;
  virtual bool closed() const { return true; }
  virtual int components() const { return 1; }
  // Sum over the components; 0 for an open patch.
  virtual int genus() const = 0;
  // Encloses the surface, tightly but for a few per cent.
  virtual Eigen::AlignedBox3d bounds() const = 0;
  double diagonal() const { return bounds().diagonal().norm(); }

  // Continuous, positive outside (above an open surface), negative inside, zero on the surface.
  virtual double Field(const Eigen::Vector3d& x) const = 0;
  virtual Eigen::Vector3d Gradient(const Eigen::Vector3d& x) const = 0;
  // A lower bound of the distance from x, where the field is `field`, to the zero set: how far a
  // ray may step safely. By default for fields that never overestimate the distance.
  virtual double SafeStep(const Eigen::Vector3d&, double field) const { return std::abs(field); }
  // Whether a point of the zero set belongs to the surface.
  virtual bool Contains(const Eigen::Vector3d&) const { return true; }

  // The nearest point of the surface, to 1e-12 of the diagonal. Closed formula where there is one;
  // else Newton on the conditions of the nearest point, which for points farther from the surface
  // than its smallest radius of curvature takes the best of several starts.
  virtual Eigen::Vector3d ClosestPoint(const Eigen::Vector3d& x) const = 0;
  // Signed as Field().
  double Distance(const Eigen::Vector3d& x) const;
  // Unit normal of the surface at ClosestPoint(x), pointing outward (upward when open). On a sharp
  // edge, that of one of its faces.
  virtual Eigen::Vector3d Normal(const Eigen::Vector3d& x) const;
};

using ShapePtr = std::unique_ptr<AnalyticShape>;

ShapePtr MakeSphere(const Eigen::Vector3d& center = Eigen::Vector3d::Zero(), double radius = 1.0);

// Around the z axis through `center`; 0 < tube_radius < ring_radius. Genus 1.
ShapePtr MakeTorus(const Eigen::Vector3d& center = Eigen::Vector3d::Zero(),
                   double ring_radius = 0.7, double tube_radius = 0.28);

// Smooth union of two tori lying side by side: genus 2, analytic everywhere.
ShapePtr MakeGenus2();

// A height field over [-1, 1]^2 with hills of several sizes: one open patch.
ShapePtr MakeTerrain();

// A box of 1.6 x 1.2 x 0.8 with a round hole of radius 0.35 along z: sharp edges, genus 1.
ShapePtr MakeCutBox();

// A machined bracket: an L with a chamfer in its inner corner and three round holes, 0.4 thick.
// Genus 3.
ShapePtr MakeBracket();

// A comb of three walls on a base, 0.08, 0.02 and 0.04 thick: 4 %, 1 % and 2 % of the diagonal.
ShapePtr MakeThinWalls();

// A sphere beside a torus: two components, genus 1 in all.
ShapePtr MakePair();

// r(direction) around the origin, bumpy: the kind of object in table 1 of Jeong and Kim 2002, met
// once by each ray from the centre. Genus 0.
ShapePtr MakeStar();

// The names MakeShape() knows: sphere, torus, genus2, terrain, cutbox, pair, star, bracket,
// thinwalls.
std::vector<std::string> ShapeNames();
// INVALID_ARGUMENT that lists the names for an unknown one.
absl::StatusOr<ShapePtr> MakeShape(absl::string_view name);

}  // namespace rilievo
