#include <gtest/gtest.h>

#include "tests/unit/surface/whole_folds.h"

namespace rilievo {
namespace {

DisplacedSurface Octahedron(int level, int heights, float height) {
  DisplacedSurface surface;
  surface.frame = {.center = {1e6, 2e6, 0}, .diagonal = 1e-3};
  surface.control_mesh.vertices.resize(3, 6);
  surface.control_mesh.vertices << 1, -1, 0, 0, 0, 0, 0, 0, 1, -1, 0, 0, 0, 0, 0, 0, 1, -1;
  surface.control_mesh.faces.resize(3, 8);
  surface.control_mesh.faces << 0, 2, 1, 3, 2, 1, 3, 0, 2, 1, 3, 0, 0, 2, 1, 3, 4, 4, 4, 4, 5, 5, 5,
      5;
  surface.max_level = level;
  surface.heights.assign(heights, height);
  surface.sources.assign(heights, HeightSource::kMeasured);
  return surface;
}

// Beyond the radius of both curvatures the surface is drawn through a point, and its normals are
// right again: the edges tell.
TEST(CountFoldsTest, HeightsBeyondTheRadiusTurnEveryFaceOver) {
  EXPECT_EQ(CountFolds(Octahedron(0, 6, 0.2f)), 0);
  EXPECT_EQ(CountFolds(Octahedron(2, 66, 0.2f)), 0);
  EXPECT_EQ(CountFolds(Octahedron(2, 66, -2.0f)), 128);
  EXPECT_EQ(CountFolds(Octahedron(0, 6, -2.0f)), 8);
}

// A long spindle: beyond its small radius and within the large one the normals turn.
TEST(CountFoldsTest, HeightsBeyondOneRadiusTurnTheNormals) {
  DisplacedSurface spindle = Octahedron(3, 258, 0.1f);
  spindle.control_mesh.vertices.row(2) *= 100;
  EXPECT_EQ(CountFolds(spindle), 0);
  spindle.heights.assign(258, -2.0f);
  EXPECT_GT(CountFolds(spindle), 400);  // of 512
}

TEST(CountFoldsTest, ASteepSpikeIsNoFold) {
  DisplacedSurface surface = Octahedron(3, 258, 0.0f);
  surface.heights[100] = 3.0f;
  EXPECT_EQ(CountFolds(surface), 0);
}

}  // namespace
}  // namespace rilievo
