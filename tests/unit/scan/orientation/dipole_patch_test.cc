#include "core/scan/orientation/dipole_patch.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numeric>
#include <vector>

namespace rilievo {
namespace {

// A square sheet of side 0.1 of 10 x 10 points at height z, that faces along `sign` z.
void AddSheet(double x, double z, double sign, OrientedCloud* cloud) {
  const Eigen::Index begin = cloud->points.cols();
  cloud->points.conservativeResize(3, begin + 100);
  cloud->normals.conservativeResize(3, begin + 100);
  for (int i = 0; i < 100; ++i) {
    cloud->points.col(begin + i) << x + 0.01 * (i % 10), 0.01 * (i / 10), z;
    cloud->normals.col(begin + i) << 0, 0, sign;
  }
  cloud->spacing.resize(static_cast<size_t>(begin + 100), 0.01f);
  cloud->noise.resize(static_cast<size_t>(begin + 100), 0.0f);
}

DipolePatch Sheet(const OrientedCloud& cloud, int which) {
  std::vector<int> points(100);
  std::iota(points.begin(), points.end(), 100 * which);
  return MakeDipolePatch(cloud, points, {which});
}

TEST(DipolePatchTest, ItsSumIsThatOfItsPoints) {
  OrientedCloud cloud;
  AddSheet(0, 0.2, 1, &cloud);
  const DipolePatch face = Sheet(cloud, 0);
  EXPECT_EQ(face.points.size(), 100u);
  EXPECT_NEAR(face.size, 100 * ShareOfSurface(0.01), 1e-9);
  EXPECT_LT((face.sum.position - Eigen::Vector3d(0.045, 0.045, 0.2)).norm(), 1e-6);
  EXPECT_NEAR(face.radius, 0.045 * std::sqrt(2.0), 1e-6);
}

// The two sides of a thin wall agree when they face away from each other.
TEST(DipolePatchTest, SidesOfAWallAgreeWhenTheyFaceApart) {
  OrientedCloud cloud;
  AddSheet(0, 0, -1, &cloud);
  AddSheet(0, 0.02, 1, &cloud);
  AddSheet(0, 0.02, -1, &cloud);
  const double apart = Agreement(Sheet(cloud, 0), Sheet(cloud, 1));
  EXPECT_GT(apart, 0);
  EXPECT_NEAR(Agreement(Sheet(cloud, 0), Sheet(cloud, 2)), -apart, 1e-12);
  EXPECT_NEAR(Agreement(Sheet(cloud, 1), Sheet(cloud, 0)), apart, 1e-12);
}

TEST(DipolePatchTest, TouchesWhatIsNearAndNotWhatIsFar) {
  OrientedCloud cloud;
  AddSheet(0, 0, 1, &cloud);
  AddSheet(0.1, 0, 1, &cloud);
  AddSheet(0.3, 0, 1, &cloud);
  EXPECT_TRUE(Touch(Sheet(cloud, 0), Sheet(cloud, 1)));
  EXPECT_FALSE(Touch(Sheet(cloud, 0), Sheet(cloud, 2)));
}

}  // namespace
}  // namespace rilievo
