#include "core/domain/edit_level.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include "core/loop/refinement.h"
#include "tests/unit/domain/analytic_scenes.h"

namespace rilievo {
namespace {

constexpr int kFinest = 3;

// A sphere of valence 4 and 6 with waves of 2 % of the diagonal.
DisplacedSurface WavySphere() {
  DisplacedSurface surface;
  surface.frame = {{0, 0, 0}, 1};
  surface.control_mesh = OctahedralSphere(0.3, 1);
  surface.max_level = kFinest;
  const LoopRefinement refinement = *RefineTopology(surface.control_mesh, kFinest, RunContext());
  const LimitSurface limit =
      *EvaluateLimit(refinement, surface.control_mesh.vertices, kFinest, RunContext());
  for (const auto position : limit.positions.colwise()) {
    surface.heights.push_back(
        static_cast<float>(0.02 * std::sin(20 * position.x()) * std::cos(15 * position.y())));
  }
  surface.sources.assign(surface.heights.size(), HeightSource::kMeasured);
  return surface;
}

Eigen::Matrix3Xd VerticesOf(const DisplacedSurface& surface, int level) {
  return Tessellate(surface, level, RunContext())->vertices;
}

// Control points, then heights.
TargetsMissed Edit(const Eigen::Matrix3Xd& targets, int level, DisplacedSurface* surface) {
  surface->control_mesh = *ControlMeshThrough(*surface, level, targets, RunContext());
  return *MoveHeightsTo(targets, level, RunContext(), surface);
}

// Heights less what the level's interpolate to.
std::vector<double> DetailOf(const DisplacedSurface& surface, int level) {
  const LoopRefinement refinement = *RefineTopology(surface.control_mesh, kFinest, RunContext());
  DisplacedSurface coarse = surface;
  coarse.max_level = level;
  coarse.heights.resize(static_cast<size_t>(refinement.vertex_count(level)));
  const std::vector<float> smooth = HeightsAtLevel(coarse, refinement, kFinest);
  std::vector<double> detail;
  for (size_t v = 0; v < smooth.size(); ++v) {
    detail.push_back(double{surface.heights[v]} - double{smooth[v]});
  }
  return detail;
}

TEST(EditLevelTest, ARigidMotionMovesTheControlMesh) {
  const Eigen::Isometry3d motion = Eigen::Translation3d(1, 0.2, -0.3) *
                                   Eigen::AngleAxisd(1.2, Eigen::Vector3d(1, 2, 3).normalized());
  const DisplacedSurface before = WavySphere();
  for (const int level : {0, 2, kFinest}) {
    const Eigen::Matrix3Xd targets = motion * VerticesOf(before, level);
    DisplacedSurface moved = before;
    const TargetsMissed missed = Edit(targets, level, &moved);
    EXPECT_LT(missed.max, 1e-6) << "level " << level;
    const Eigen::Matrix3Xd expected = motion * VerticesOf(before, kFinest);
    EXPECT_LT((VerticesOf(moved, kFinest) - expected).colwise().norm().maxCoeff(), 1e-6)
        << "level " << level;
  }
}

TEST(EditLevelTest, VerticesGoWhereTheyArePutAndDetailStays) {
  const DisplacedSurface before = WavySphere();
  for (const int level : {0, 1, 2}) {
    Eigen::Matrix3Xd targets = VerticesOf(before, level);
    // A smooth bump on one side.
    for (auto target : targets.colwise()) {
      const double near = (target - Eigen::Vector3d(0.3, 0, 0)).squaredNorm();
      target.x() += 0.1 * std::exp(-near / 0.02);
    }
    DisplacedSurface after = before;
    const TargetsMissed missed = Edit(targets, level, &after);
    const Eigen::Matrix3Xd apart = VerticesOf(after, level) - targets;
    EXPECT_NEAR(apart.colwise().norm().maxCoeff(), missed.max, 1e-7);
    EXPECT_LT(missed.rms, 1e-3) << "level " << level;
    EXPECT_LE(missed.max, 0.012) << "level " << level;
    const std::vector<double> was = DetailOf(before, level), is = DetailOf(after, level);
    double most = 0, change = 0;
    for (size_t v = 0; v < was.size(); ++v) {
      most = std::max(most, std::abs(was[v]));
      change = std::max(change, std::abs(is[v] - was[v]));
    }
    EXPECT_GT(most, 5e-4);
    EXPECT_LT(change, 1e-7);
    // Far away nothing moves.
    const Eigen::Matrix3Xd fine = VerticesOf(before, kFinest), moved = VerticesOf(after, kFinest);
    for (Eigen::Index v = 0; v < fine.cols(); ++v) {
      if (fine(0, v) >= -0.15) continue;
      EXPECT_LT((moved.col(v) - fine.col(v)).norm(), 3e-3);
    }
  }
}

}  // namespace
}  // namespace rilievo
