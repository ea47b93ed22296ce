#include "core/domain/fold_guard.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>

#include "tests/unit/domain/analytic_scenes.h"

namespace rilievo {
namespace {

struct Folding {
  ControlMesh mesh = TorusMesh(0.25, 0.1, 24, 12);
  DomainSamples samples = *BuildDomainSamples(mesh, 2, RunContext());
  SampledSurface surface;
  Folding() { Sample(mesh.vertices); }
  void Sample(const Eigen::Matrix3Xd& points) {
    EXPECT_TRUE(SampleSurface(samples, points, RunContext(), &surface).ok());
  }
  // Faces with a fold.
  int Folded() const {
    const std::vector<uint8_t> folded = FindFolds(samples, surface, RunContext());
    return static_cast<int>(std::count(folded.begin(), folded.end(), 1));
  }
  // Vertex 30 pulled along the surface, over its neighbours and beyond.
  Eigen::Matrix3Xd Pulled(double rows = 3) const {
    Eigen::Matrix3Xd points = mesh.vertices;
    points.col(30) += rows * (mesh.vertices.col(42) - mesh.vertices.col(30));
    return points;
  }
};

TEST(FoldGuard, SeesAFoldOnlyWhereItIs) {
  Folding folding;
  EXPECT_EQ(folding.Folded(), 0);
  folding.Sample(folding.Pulled());
  EXPECT_GT(folding.Folded(), 0);
  // The limit surface over a face depends on its corners' rings: the pulled vertex reaches 24.
  EXPECT_LE(folding.Folded(), 24);
}

TEST(FoldGuard, TakesBackAsMuchAsNeeded) {
  Folding folding;
  const std::vector<uint8_t> none = FindFolds(folding.samples, folding.surface, RunContext());
  Eigen::Matrix3Xd points = folding.Pulled();
  // A harmless move far from the fold.
  points.col(200).z() += 1e-3;
  folding.Sample(points);
  ASSERT_TRUE(UndoFolds(folding.samples, folding.mesh.vertices, none, RunContext(), &points,
                        &folding.surface)
                  .ok());
  EXPECT_EQ(folding.Folded(), 0);
  EXPECT_DOUBLE_EQ(points(2, 200), folding.mesh.vertices(2, 200) + 1e-3);
  // Part of the move remains, and the surface returned is that of the points returned.
  EXPECT_GT((points.col(30) - folding.mesh.vertices.col(30)).norm(), 1e-3);
  const SampledSurface returned = folding.surface;
  folding.Sample(points);
  EXPECT_EQ(returned.positions, folding.surface.positions);
}

TEST(FoldGuard, LeavesOldFoldsToTheFit) {
  Folding folding;
  const Eigen::Matrix3Xd folded_start = folding.Pulled();
  folding.Sample(folded_start);
  const std::vector<uint8_t> folded_before =
      FindFolds(folding.samples, folding.surface, RunContext());
  Eigen::Matrix3Xd points = folded_start;
  points.col(30) += 0.1 * (folding.mesh.vertices.col(30) - points.col(30));
  const Eigen::Matrix3Xd moved = points;
  folding.Sample(points);
  ASSERT_TRUE(UndoFolds(folding.samples, folded_start, folded_before, RunContext(), &points,
                        &folding.surface)
                  .ok());
  EXPECT_EQ(points, moved);
}

}  // namespace
}  // namespace rilievo
