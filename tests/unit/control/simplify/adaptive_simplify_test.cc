#include "core/control/simplify/adaptive_simplify.h"

#include <gtest/gtest.h>

#include "core/control/simplify/uncovered_points.h"
#include "tests/unit/control/pronged_ball.h"

namespace rilievo {
namespace {

constexpr int kNoLimit = 1'000'000;

TEST(AdaptiveSimplifyTest, WhereNothingIsLostItSimplifies) {
  const ControlMesh fine = MarchTetrahedra(SphereField, 40);
  const SimplifyOptions options{.target_faces = 200};
  const auto plain = SimplifyMesh(fine, options, RunContext());
  const auto kept = AdaptiveSimplify({}, fine, options, kNoLimit, RunContext());
  ASSERT_TRUE(kept.ok());
  EXPECT_EQ(plain->vertices, kept->vertices);
  EXPECT_EQ(plain->faces, kept->faces);
}

TEST(AdaptiveSimplifyTest, ProngsThatSimplificationCutsOffComeBack) {
  const ControlMesh fine = MarchTetrahedra(ProngedBallField, 80);
  const OrientedCloud cloud = CloudOf(fine);
  const SimplifyOptions options{.target_faces = 60};
  const auto lost_of = [&](const absl::StatusOr<ControlMesh>& mesh) {
    return FindUncoveredPoints(cloud, *mesh, {.spacings = 1, .noises = 4, .cosine = 0.3},
                               RunContext())
        .value();
  };
  const auto plain = SimplifyMesh(fine, options, RunContext());
  const UncoveredPoints before = lost_of(plain);
  ASSERT_GT(before.points.size(), 20);
  const auto kept = AdaptiveSimplify(before, fine, options, kNoLimit, RunContext());
  ASSERT_TRUE(kept.ok());
  EXPECT_LT(lost_of(kept).points.size(), before.points.size() / 3);
  EXPECT_GT(kept->faces.cols(), plain->faces.cols());
  EXPECT_LE(kept->faces.cols(), plain->faces.cols() + 3 * before.faces);
  const auto fewer = AdaptiveSimplify(before, fine, options, 66, RunContext());
  ASSERT_TRUE(fewer.ok());
  EXPECT_LE(fewer->faces.cols(), 66);
  EXPECT_GT(fewer->faces.cols(), plain->faces.cols());
}

}  // namespace
}  // namespace rilievo
