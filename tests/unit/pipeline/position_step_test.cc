#include "core/pipeline/position_step.h"

#include <gtest/gtest.h>

namespace rilievo {
namespace {

// A fan of `count` equal faces with edges of `length`.
ControlMesh Strip(int count, double length) {
  ControlMesh mesh;
  mesh.vertices.resize(3, count + 2);
  mesh.faces.resize(3, count);
  const double height = length * 0.8660254037844386;
  for (int v = 0; v < count + 2; ++v) mesh.vertices.col(v) << v * length / 2, (v % 2) * height, 0;
  for (int f = 0; f < count; ++f) mesh.faces.col(f) << f, f + 1 + f % 2, f + 2 - f % 2;
  return mesh;
}

TEST(PositionStepTest, OnASmoothMeshATenthOfItsShortEdges) {
  EXPECT_NEAR(PositionStepFor(Strip(200, 0.02), 1e-4), 2e-3, 1e-12);
  EXPECT_NEAR(PositionStepFor(Strip(200, 0.02), std::nullopt), 2e-3, 1e-12);
  EXPECT_EQ(PositionStepFor(Strip(200, 0.2), 1e-4), 5e-3);
  EXPECT_EQ(PositionStepFor(Strip(200, 0.001), 1e-4), 4e-4);
}

TEST(PositionStepTest, OnAMachinedPartWhatTheErrorAllows) {
  ControlMesh mesh = Strip(200, 0.02);
  EXPECT_FALSE(IsMachined(mesh));
  for (int v = 0; v < 20; ++v) mesh.creases.push_back({v, v + 2});
  EXPECT_TRUE(IsMachined(mesh));
  EXPECT_NEAR(PositionStepFor(mesh, 3e-4), 1.2e-3, 1e-12);
  EXPECT_EQ(PositionStepFor(mesh, 1e-5), 4e-4);
  EXPECT_NEAR(PositionStepFor(mesh, 1e-2), 2e-3, 1e-12);
  EXPECT_EQ(PositionStepFor(mesh, std::nullopt), 4e-4);
}

}  // namespace
}  // namespace rilievo
