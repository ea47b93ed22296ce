#include "core/scan/winding_number.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "core/scan/component_bridges.h"
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

// Two parallel sheets two spacings apart: each link joins one component to the other.
TEST(ComponentBridgesTest, LinksRunFromSheetToSheet) {
  constexpr int kSide = 30;
  OrientedCloud cloud;
  cloud.points.resize(3, 2 * kSide * kSide);
  cloud.normals.resize(3, 2 * kSide * kSide);
  std::vector<int> component;
  for (int i = 0; i < 2 * kSide * kSide; ++i) {
    const int sheet = i / (kSide * kSide), at = i % (kSide * kSide);
    cloud.points.col(i) << 0.01 * (at % kSide), 0.01 * (at / kSide), 0.02 * sheet;
    cloud.normals.col(i) << 0, 0, sheet == 0 ? -1 : 1;
    component.push_back(sheet);
  }
  cloud.spacing.assign(component.size(), 0.0113f);
  cloud.noise.assign(component.size(), 0.0f);
  cloud.median_spacing = 0.0113;
  const auto links = BridgeComponents(cloud, component, 2, RunContext{});
  ASSERT_TRUE(links.ok());
  ASSERT_FALSE(links->empty());
  for (const SignedLink& link : *links) {
    EXPECT_EQ(link.a + link.b, 1);  // components 0 and 1
    EXPECT_TRUE(std::isfinite(link.weight));
  }
}

}  // namespace
}  // namespace rilievo
