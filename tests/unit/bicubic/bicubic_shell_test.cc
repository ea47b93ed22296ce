#include "core/bicubic/bicubic_shell.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <string>
#include <utility>

#include "core/bicubic/cubic_spline.h"
#include "core/geometry/mesh_topology.h"
#include "tests/unit/evaluate/relief_surfaces.h"
#include "tests/unit/loop/quad_meshes.h"

namespace rilievo {
namespace {

using Eigen::Matrix3Xd;

constexpr int kIntervals = 8;

DisplacedSurface Smooth(ControlMesh mesh) { return testing::WithRelief(std::move(mesh), 0, 0); }

BicubicShell Fitted(const DisplacedSurface& surface, double tolerance) {
  auto shell = FitBicubicShell(surface, {.tolerance = tolerance}, RunContext());
  EXPECT_TRUE(shell.ok()) << shell.status();
  return *std::move(shell);
}

// A torus of regular quads; its Catmull-Clark surface is bicubic itself.
ControlMesh QuadTorus(int around, int across) {
  testing::Random random(3);
  std::vector<std::array<int, 4>> quads;
  for (int i = 0; i < around; ++i) {
    for (int j = 0; j < across; ++j) {
      const auto at = [&](int di, int dj) {
        return (i + di) % around * across + (j + dj) % across;
      };
      quads.push_back({at(0, 0), at(1, 0), at(1, 1), at(0, 1)});
    }
  }
  return testing::OfQuads(testing::Torus(around, across).vertices, quads, random);
}

// Side i of a patch, from its corner i to the one after.
Matrix3Xd SideOf(const BicubicShell::Patch& patch, size_t i) {
  const int rows = patch.spans[0] + 3, columns = patch.spans[1] + 3;
  const CubicSpline spline(patch.spans[i % 2], 2 * kIntervals);
  Matrix3Xd control(3, i % 2 == 0 ? rows : columns);
  for (int k = 0; k < control.cols(); ++k) {
    const std::array<int, 4> places = {k, rows - 1 + rows * k, rows * (columns - 1) + rows - 1 - k,
                                       rows * (columns - 1 - k)};
    control.col(k) = patch.control.col(places[i]);
  }
  return control * spline.basis().transpose();
}

void ExpectWatertight(const BicubicShell& shell, const ControlMesh& mesh, const std::string& name) {
  const TopologySummary summary =
      SummarizeTopology(mesh.faces, static_cast<int>(mesh.vertices.cols()));
  EXPECT_EQ(shell.vertices.cols() - static_cast<int64_t>(shell.edges.size()) +
                static_cast<int64_t>(shell.patches.size()),
            summary.euler)
      << name;
  std::vector<std::array<int, 2>> uses(shell.edges.size());
  for (const BicubicShell::Patch& patch : shell.patches) {
    for (size_t i = 0; i < 4; ++i) {
      const auto e = static_cast<size_t>(patch.edges[i]);
      const BicubicShell::Edge& edge = shell.edges[e];
      ++uses[e][patch.forward[i] ? 1 : 0];
      const CubicSpline spline(static_cast<int>(edge.control.cols()) - 3, 2 * kIntervals);
      Matrix3Xd curve = edge.control * spline.basis().transpose();
      EXPECT_EQ(curve.col(0), shell.vertices.col(edge.from));
      if (!patch.forward[i]) curve = curve.rowwise().reverse().eval();
      EXPECT_LT((curve - SideOf(patch, i)).cwiseAbs().maxCoeff(), 1e-11) << name;
    }
  }
  int64_t open = 0;
  for (const auto& [against, along] : uses) {
    EXPECT_TRUE(against <= 1 && along <= 1 && against + along >= 1) << name;
    open += against + along == 1 ? 1 : 0;
  }
  EXPECT_EQ(open, (mesh.quads() ? 1 : 2) * summary.boundary_edges) << name;
}

TEST(BicubicShellTest, OfRegularQuadsIsTheCatmullClarkSurface) {
  const BicubicShell shell = Fitted(Smooth(QuadTorus(8, 6)), 1e-12);
  EXPECT_EQ(shell.patches.size(), 48u);
  for (const BicubicShell::Patch& patch : shell.patches) {
    EXPECT_EQ(patch.spans, (std::array{1, 1}));
  }
  EXPECT_LT(shell.error, 1e-12);
}

TEST(BicubicShellTest, SharesEdgesExactly) {
  for (const auto& [name, mesh] : testing::QuadMeshes()) {
    if (name.starts_with("EveryKind")) continue;  // large
    ExpectWatertight(Fitted(testing::WithRelief(mesh, 1, 0.001), 2e-2), mesh, name);
  }
  for (const auto& [name, surface] : testing::ReliefSurfaces()) {
    ExpectWatertight(Fitted(surface, 1e-2), surface.control_mesh, name);
  }
}

// Places on the patches lie where vertices of the surface do.
TEST(BicubicShellTest, IsWithinItsTolerance) {
  testing::Random random(5);
  const ControlMesh mesh = testing::TurnedTorus(6, 6, random);
  const DisplacedSurface surface = testing::WithRelief(mesh, 2, 0.004);
  for (const double tolerance : {2e-3, 2e-4}) {
    const BicubicShell shell = Fitted(surface, tolerance);
    EXPECT_LE(shell.error, tolerance);
    const auto finest = Tessellate(surface, 2, RunContext());
    ASSERT_TRUE(finest.ok()) << finest.status();
    // Each patch holds the vertex in the middle of its quad.
    for (const BicubicShell::Patch& patch : shell.patches) {
      const CubicSpline along_s(patch.spans[0], 2 * kIntervals),
          along_t(patch.spans[1], 2 * kIntervals);
      Eigen::Vector3d middle = Eigen::Vector3d::Zero();
      for (int j = 0; j < along_t.control_count(); ++j) {
        for (int i = 0; i < along_s.control_count(); ++i) {
          middle += along_s.basis().coeff(kIntervals, i) * along_t.basis().coeff(kIntervals, j) *
                    patch.control.col(i + along_s.control_count() * j);
        }
      }
      const double distance = (finest->vertices.colwise() - middle).colwise().norm().minCoeff();
      EXPECT_LE(distance, tolerance * surface.frame.diagonal);
    }
  }
}

TEST(BicubicShellTest, IsTheSameForAnyNumberOfThreads) {
  const DisplacedSurface surface = testing::ReliefSurfaces().front().surface;
  RunContext two;
  two.threads = 2;
  const auto shell = FitBicubicShell(surface, {.tolerance = 2e-3}, two);
  ASSERT_TRUE(shell.ok()) << shell.status();
  const BicubicShell alone = Fitted(surface, 2e-3);
  ASSERT_EQ(shell->patches.size(), alone.patches.size());
  for (size_t p = 0; p < alone.patches.size(); ++p) {
    EXPECT_EQ(shell->patches[p].control, alone.patches[p].control);
  }
}

TEST(BicubicShellTest, RefusesWhatItCannotDo) {
  const DisplacedSurface surface = Smooth(testing::Icosahedron());
  const auto message = [&](const DisplacedSurface& given, double tolerance) {
    return std::string(
        FitBicubicShell(given, {.tolerance = tolerance}, RunContext()).status().message());
  };
  EXPECT_THAT(message(surface, 0), ::testing::HasSubstr("tolerance is 0"));
  // 60 patches of at least 16 each.
  const absl::Status large =
      FitBicubicShell(surface, {.tolerance = 1e-3, .most_control_points = 959}, RunContext())
          .status();
  EXPECT_EQ(large.code(), absl::StatusCode::kResourceExhausted);
  EXPECT_THAT(std::string(large.message()),
              ::testing::HasSubstr("more than 959 control points; a larger tolerance"));
  DisplacedSurface short_of_heights = surface;
  short_of_heights.heights.pop_back();
  short_of_heights.sources.pop_back();
  EXPECT_THAT(message(short_of_heights, 1e-3), ::testing::HasSubstr("heights has 11 entries"));
}

}  // namespace
}  // namespace rilievo
