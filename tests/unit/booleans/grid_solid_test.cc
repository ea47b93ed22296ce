#include "core/booleans/grid_solid.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <set>
#include <string>
#include <utility>

#include "tests/unit/booleans/solid_shapes.h"

namespace rilievo {
namespace {

using ::testing::HasSubstr;

constexpr double kHalf = static_cast<double>(kStepsOfHalfBox);

TEST(GridSolidTest, TheJointBoxFillsTheGrid) {
  const auto solids = PlaceOnGrid(UnitBox(0, 0, 0), UnitBox(3, 0, 0), {}, RunContext());
  ASSERT_TRUE(solids.ok());
  // From 0 to 4 along x: a step is 2 / kHalf.
  EXPECT_EQ((*solids)[0].points[0].at[0], -kStepsOfHalfBox);
  EXPECT_EQ((*solids)[1].points[1].at[0], kStepsOfHalfBox);
  EXPECT_EQ((*solids)[0].points[0].at[1], -kStepsOfHalfBox / 4);
  std::set<uint32_t> ids;
  for (const GridSolid& solid : *solids) {
    for (const GridPoint& point : solid.points) ids.insert(point.id);
  }
  EXPECT_EQ(ids.size(), 16u);
}

TEST(GridSolidTest, PartnersLieAcross) {
  const auto solids = PlaceOnGrid(SphereMesh(2), UnitBox(0, 0, 0), {}, RunContext());
  ASSERT_TRUE(solids.ok());
  for (const GridSolid& solid : *solids) {
    ASSERT_EQ(solid.partner.size(), static_cast<size_t>(3 * solid.faces.cols()));
    for (uint32_t h = 0; h < solid.partner.size(); ++h) {
      const uint32_t across = solid.partner[h];
      EXPECT_EQ(solid.partner[across], h);
      EXPECT_EQ(Origin(solid.faces, across), Origin(solid.faces, NextHalfEdge(h)));
    }
  }
}

// Each corner of a turned box, and of a thin one, moves along all of its faces by the number of
// steps.
TEST(GridSolidTest, GrowthMovesFacesOutward) {
  const TriangleMesh b = UnitBox(0, 0, 0);
  const TriangleMesh boxes[] = {Moved(b, Askew()),
                                Moved(BoxMesh({0, 0, 0}, {1, .3, .002}), Askew())};
  for (const auto& [a, steps] :
       {std::pair(boxes[0], kGrowthSteps), std::pair(boxes[0], -kGrowthSteps),
        std::pair(boxes[0], 1000.0), std::pair(boxes[1], 1000.0)}) {
    const auto before = PlaceOnGrid(a, b, {}, RunContext()),
               after = PlaceOnGrid(a, b, {0, steps}, RunContext());
    ASSERT_TRUE(before.ok() && after.ok());
    for (int face = 0; face < 12; ++face) {
      const GridTriangle from = (*before)[0].TriangleOf(face), to = (*after)[0].TriangleOf(face);
      const Eigen::Vector3d origin = from[0].position();
      const Eigen::Vector3d normal =
          (from[1].position() - origin).cross(from[2].position() - origin).normalized();
      for (size_t k = 0; k < 3; ++k) {
        const double moved = normal.dot(to[k].position() - from[k].position()) / steps;
        EXPECT_NEAR(moved, 1, 0.01 + 1 / std::abs(steps));
      }
    }
    EXPECT_EQ((*before)[1].points[7].at, (*after)[1].points[7].at);
    for (size_t v = 0; v < 8; ++v) {
      const Eigen::Vector3d there = (*after)[0].points[v].position(),
                            back = (*after)[0].points_otherwise[v].position();
      EXPECT_LE(((there + back) / 2 - (*before)[0].points[v].position()).lpNorm<1>(), 3);
    }
  }
}

TEST(GridSolidTest, ABoxHoldsItsFace) {
  const auto solids =
      PlaceOnGrid(Moved(SphereMesh(3), Askew()), UnitBox(5, 5, 5), {}, RunContext());
  ASSERT_TRUE(solids.ok());
  const GridSolid& sphere = (*solids)[0];
  for (int face = 0; face < sphere.faces.cols(); ++face) {
    const FloatBox box = sphere.BoxOf(face);
    for (const GridPoint& corner : sphere.TriangleOf(face)) {
      for (size_t axis = 0; axis < 3; ++axis) {
        EXPECT_LE(static_cast<double>(box.lo[axis]), static_cast<double>(corner.at[axis]));
        EXPECT_GE(static_cast<double>(box.hi[axis]), static_cast<double>(corner.at[axis]));
        EXPECT_LT(static_cast<double>(box.hi[axis]) - static_cast<double>(box.lo[axis]), kHalf);
      }
    }
  }
}

TEST(GridSolidTest, WhatEnclosesNothingIsNoSolid) {
  TriangleMesh flat = UnitBox(0, 0, 0);
  flat.vertices.row(2).setZero();
  const auto placed = PlaceOnGrid(UnitBox(0, 0, 0), flat, {}, RunContext());
  EXPECT_EQ(placed.status().code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_THAT(std::string(placed.status().message()),
              HasSubstr("the second shape encloses no volume"));
}

}  // namespace
}  // namespace rilievo
