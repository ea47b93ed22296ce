#include "core/control/simplify/quadric.h"

#include <gtest/gtest.h>

namespace rilievo {
namespace {

using Eigen::Vector3d;

TEST(Quadric, IsTheSumOfSquaredDistances) {
  const Vector3d n1 = Vector3d(1, 2, 2) / 3, n2 = Vector3d(0, 3, 4) / 5;
  const Vector3d p1(0.1, -0.2, 0.3), p2(0.5, 0.1, -0.4), p3(-0.3, 0.2, 0.1);
  Quadric a, b;
  a.AddPlane(n1, p1, 2.0);
  b.AddPlane(n2, p2, 0.5);
  b.AddPoint(p3, 0.7);
  a += b;
  for (const Vector3d& x : {Vector3d(0, 0, 0), Vector3d(1, -1, 2), p1, p3}) {
    const double d1 = n1.dot(x - p1), d2 = n2.dot(x - p2);
    EXPECT_NEAR(a(x), 2 * d1 * d1 + 0.5 * d2 * d2 + 0.7 * (x - p3).squaredNorm(), 1e-14);
  }
}

TEST(Quadric, ItsMinimumIsWhereThreePlanesMeet) {
  const Vector3d corner(0.3, -0.1, 0.2);
  Quadric quadric;
  quadric.AddPlane(Vector3d(1, 0, 0), corner, 1);
  quadric.AddPlane(Vector3d(0.6, 0.8, 0), corner, 2);
  quadric.AddPlane(Vector3d(0, 0.6, 0.8), corner, 3);
  EXPECT_LT((quadric.Minimum(Vector3d::Zero()) - corner).norm(), 1e-12);
}

TEST(Quadric, FallsBackWhereThePlaceIsOpen) {
  Quadric plane;
  plane.AddPlane(Vector3d::UnitZ(), Vector3d(0, 0, 1), 1);
  EXPECT_EQ(plane.Minimum(Vector3d(4, 5, 6)), Vector3d(4, 5, 6));
  plane.AddPoint(Vector3d(2, 3, 1), 1e-3);
  EXPECT_LT((plane.Minimum(Vector3d::Zero()) - Vector3d(2, 3, 1)).norm(), 1e-9);
}

}  // namespace
}  // namespace rilievo
