#include "core/scan/winding_number.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "core/scan/outward_sign.h"

namespace rilievo {
namespace {

constexpr int kCount = 5000;

Eigen::Vector3d SpherePoint(int i) {
  const double z = 1 - 2 * (i + 0.5) / kCount;
  const double turn = 2 * M_PI * i * 0.6180339887498949;
  return {std::sqrt(1 - z * z) * std::cos(turn), std::sqrt(1 - z * z) * std::sin(turn), z};
}

TEST(WindingNumberTest, OneInsideASphereAndNoneOutside) {
  std::vector<SurfacePatch> patches;
  for (int i = 0; i < kCount; ++i) {
    const double area = 4 * M_PI / kCount;
    patches.push_back({SpherePoint(i), area * SpherePoint(i), area / (2 * M_PI)});
  }
  EXPECT_NEAR(WindingNumber(patches, {0.1, 0.2, -0.3}), 1, 0.01);
  EXPECT_NEAR(WindingNumber(patches, {1.5, 0, 0}), 0, 0.01);
}

TEST(OutwardSignTest, FindsTheOutsideOfASphereEitherWay) {
  OrientedCloud cloud;
  cloud.points.resize(3, kCount);
  std::vector<int> members(kCount);
  for (int i = 0; i < kCount; ++i) {
    cloud.points.col(i) = SpherePoint(i);
    members[i] = i;
  }
  cloud.spacing.assign(kCount, 0.05f);
  cloud.noise.assign(kCount, 0.0f);
  cloud.median_spacing = 0.05;
  cloud.normals = cloud.points;
  EXPECT_EQ(OutwardSign(cloud, members), 1);
  cloud.normals = -cloud.points;
  EXPECT_EQ(OutwardSign(cloud, members), -1);
}

}  // namespace
}  // namespace rilievo
