#include "core/control/implicit/grid_hierarchy.h"

#include <gtest/gtest.h>

#include <array>
#include <random>

namespace rilievo {
namespace {

constexpr int kLevels = 4;
constexpr int kBand = 3;

struct Scene {
  Eigen::Matrix3Xd points;
  std::vector<uint8_t> wanted;
  std::vector<SparseGrid> refined;
  std::vector<GridLevel> levels;
};

// Points in the unit cube that ask for random levels; the coarsest cell is 1/16.
Scene RandomScene() {
  Scene scene;
  std::mt19937 random(5);
  scene.points = Eigen::Matrix3Xd::NullaryExpr(
      3, 40, [&] { return std::uniform_real_distribution<double>(0, 1)(random); });
  for (int i = 0; i < 40; ++i) scene.wanted.push_back(static_cast<uint8_t>(random() % kLevels));
  scene.refined = CellsToRefine(scene.points, scene.wanted, Eigen::Vector3d::Zero(), 1.0 / 16,
                                kLevels, kBand, RunContext{})
                      .value();
  GridLevel coarsest;
  coarsest.cell = 1.0 / 16;
  coarsest.grid.AddBox(Eigen::Vector3i::Constant(-5), Eigen::Vector3i::Constant(21));
  coarsest.grid.Seal();
  for (const Eigen::Vector3i& node : coarsest.grid.Nodes()) {
    coarsest.values.push_back(static_cast<float>(node.x() + 2 * node.y() - 3 * node.z()));
  }
  scene.levels.push_back(std::move(coarsest));
  for (const SparseGrid& cells : scene.refined) {
    scene.levels.push_back(RefineCells(scene.levels.back(), cells, RunContext{}).value());
  }
  return scene;
}

TEST(ImplicitLevelsTest, EveryPointLiesDeepInCellsOfItsLevel) {
  const Scene scene = RandomScene();
  for (int i = 0; i < scene.points.cols(); ++i) {
    const GridLevel& level = scene.levels[scene.wanted[i]];
    const Eigen::Vector3i at = level.CellOf(Eigen::Vector3d::Zero(), scene.points.col(i));
    for (int c = 0; c < 8; ++c) {
      const Eigen::Vector3i corner(c & 1, (c >> 1) & 1, c >> 2);
      const Eigen::Vector3i reach = (2 * corner - Eigen::Vector3i::Ones()) * (kBand - 1) + corner;
      EXPECT_GE(level.grid.Find(at + reach), 0);
    }
  }
}

// The 26 cells around a refined one exist on its level, so none of them is more than one level off.
TEST(ImplicitLevelsTest, CellsThatTouchDifferByOneLevel) {
  const Scene scene = RandomScene();
  for (int l = 1; l + 1 < kLevels; ++l) {
    std::array<int, 8> corners;
    for (const Eigen::Vector3i& cell : scene.refined[l].Nodes()) {
      for (int n = 0; n < 27; ++n) {
        const Eigen::Vector3i around = cell + Eigen::Vector3i(n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1);
        EXPECT_TRUE(scene.levels[l].grid.FindCell(around, &corners));
      }
    }
  }
}

TEST(ImplicitLevelsTest, TheMiddleTellsWhichCellsAreRefined) {
  const Scene scene = RandomScene();
  for (int l = 0; l + 1 < kLevels; ++l) {
    int refined = 0;
    for (const Eigen::Vector3i& cell : scene.levels[l].grid.Nodes()) {
      const bool is_refined =
          scene.levels[l + 1].grid.Find(2 * cell + Eigen::Vector3i::Ones()) >= 0;
      EXPECT_EQ(is_refined, scene.refined[l].Find(cell) >= 0);
      refined += is_refined;
    }
    EXPECT_EQ(refined, scene.refined[l].size());
  }
}

// A linear function is handed down exactly.
TEST(ImplicitLevelsTest, ValuesAreInterpolated) {
  const Scene scene = RandomScene();
  for (const GridLevel& level : scene.levels) {
    const std::vector<Eigen::Vector3i> nodes = level.grid.Nodes();
    for (size_t n = 0; n < nodes.size(); ++n) {
      const Eigen::Vector3d at = 16 * level.cell * nodes[n].cast<double>();
      EXPECT_FLOAT_EQ(level.values[n], static_cast<float>(at.x() + 2 * at.y() - 3 * at.z()));
    }
  }
  EXPECT_NEAR(scene.levels[0].ValueAt(Eigen::Vector3d::Zero(), {0.5, 0.25, 0.1}), 11.2, 1e-5);
  EXPECT_EQ(scene.levels[0].ValueAt(Eigen::Vector3d::Zero(), {9, 9, 9}), 0);
}

TEST(ImplicitLevelsTest, TheFinerValueCounts) {
  Scene scene = RandomScene();
  for (float& value : scene.levels[1].values) value += 100;
  ASSERT_TRUE(InjectValues(scene.levels[1], RunContext{}, &scene.levels[0]).ok());
  const std::vector<Eigen::Vector3i> nodes = scene.levels[0].grid.Nodes();
  for (size_t n = 0; n < nodes.size(); ++n) {
    const float own = static_cast<float>(nodes[n].x() + 2 * nodes[n].y() - 3 * nodes[n].z());
    const bool finer = scene.levels[1].grid.Find(2 * nodes[n]) >= 0;
    EXPECT_FLOAT_EQ(scene.levels[0].values[n], finer ? own + 100 : own);
  }
}

}  // namespace
}  // namespace rilievo
