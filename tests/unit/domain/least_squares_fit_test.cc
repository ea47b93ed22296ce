#include "core/domain/least_squares_fit.h"

#include <gtest/gtest.h>

#include "tests/unit/domain/analytic_scenes.h"

namespace rilievo {
namespace {

struct FitOutcome {
  FitState state;
  absl::Status status;
};

FitOutcome RunLeastSquaresFit(const OrientedCloud& cloud, const ControlMesh& mesh,
                              const FitOptions& options, const RunContext& context = RunContext()) {
  const PointIndex index(cloud.points);
  const auto samples = BuildDomainSamples(mesh, options.sample_level, RunContext());
  EXPECT_TRUE(samples.ok());
  FootPointSearch search(cloud, index, *samples, options.robust_spacings);
  FitOutcome fit;
  fit.status = StartRounds(*samples, mesh.vertices, RunContext(), &search, &fit.state);
  if (fit.status.ok()) {
    fit.status = FitLeastSquares(*samples, options, context, &search, &fit.state);
  }
  return fit;
}

TEST(LeastSquaresFit, EachRoundBringsTheSurfaceNearer) {
  FitOptions options;
  options.rounds = 4;
  const FitOutcome fit =
      RunLeastSquaresFit(TorusCloud(0.25, 0.1, 20'000), TorusMesh(0.25, 0.1, 24, 12), options);
  ASSERT_TRUE(fit.status.ok());
  ASSERT_EQ(fit.state.rms.size(), 5u);
  for (int r = 0; r < 4; ++r) EXPECT_LE(fit.state.rms[r + 1], fit.state.rms[r] * 1.001);
  EXPECT_LT(fit.state.rms.back(), fit.state.rms.front() / 100);
  EXPECT_LT(fit.state.largest_move, 1e-3);
}

TEST(LeastSquaresFit, EndsEarlyWhereWhatIsWantedIsOutOfReach) {
  const OrientedCloud cloud = TorusCloud(0.25, 0.1, 20'000);
  const ControlMesh mesh = TorusMesh(0.25, 0.1, 8, 6);
  const FitOutcome whole = RunLeastSquaresFit(cloud, mesh, FitOptions());
  ASSERT_TRUE(whole.status.ok());
  FitOptions options;
  options.wanted_rms = whole.state.rms[1];
  EXPECT_EQ(RunLeastSquaresFit(cloud, mesh, options).state.control_points,
            whole.state.control_points);
  options.wanted_rms = whole.state.rms.back() / 2;
  EXPECT_EQ(RunLeastSquaresFit(cloud, mesh, options).state.rms.size(),
            2u);  // before, and after one round
}

// The regular torus is a flat sheet to its neighbours, so the solution is known: a control net that
// the symmetry keeps regular.
TEST(LeastSquaresFit, KeepsTheSymmetryOfTheInput) {
  const int around = 24, across = 12;
  OrientedCloud cloud;
  const ControlMesh lattice = TorusMesh(0.25, 0.1, 8 * around, 8 * across);
  cloud.points = lattice.vertices;
  cloud.normals.resize(3, cloud.points.cols());
  for (int i = 0; i < cloud.points.cols(); ++i) {
    const Eigen::Vector3d p = cloud.points.col(i);
    const Eigen::Vector3d ring = 0.25 * Eigen::Vector3d(p.x(), p.y(), 0).normalized();
    cloud.normals.col(i) = (p - ring).normalized();
  }
  cloud.spacing.assign(static_cast<size_t>(cloud.points.cols()), 0.01f);
  cloud.noise.assign(cloud.spacing.size(), 0.0f);
  const FitOutcome fit =
      RunLeastSquaresFit(cloud, TorusMesh(0.25, 0.1, around, across), FitOptions());
  ASSERT_TRUE(fit.status.ok());
  for (int j = 0; j < across; ++j) {
    const Eigen::Vector3d first = fit.state.control_points.col(j);
    for (int i = 1; i < around; ++i) {
      const Eigen::AngleAxisd turn(2 * std::numbers::pi * i / around, Eigen::Vector3d::UnitZ());
      EXPECT_LT((turn * first - fit.state.control_points.col(i * across + j)).norm(), 1e-5);
    }
  }
}

TEST(LeastSquaresFit, ComponentWithoutDataStaysWhereItIs) {
  ControlMesh mesh = OctahedralSphere(0.3, 2);
  ControlMesh far = OctahedralSphere(0.05, 1);
  const auto base = static_cast<int>(mesh.vertices.cols());
  const auto base_faces = mesh.faces.cols();
  far.vertices.colwise() += Eigen::Vector3d(2, 0, 0);
  mesh.vertices.conservativeResize(3, base + far.vertices.cols());
  mesh.vertices.rightCols(far.vertices.cols()) = far.vertices;
  mesh.faces.conservativeResize(3, base_faces + far.faces.cols());
  mesh.faces.rightCols(far.faces.cols()) = far.faces.array() + base;
  const FitOutcome fit = RunLeastSquaresFit(SphereCloud(0.3, 10'000), mesh, FitOptions());
  ASSERT_TRUE(fit.status.ok());
  ASSERT_TRUE(fit.state.control_points.allFinite());
  const Eigen::Matrix3Xd moved = fit.state.control_points.rightCols(far.vertices.cols());
  EXPECT_LT((moved.rowwise().mean() - far.vertices.rowwise().mean()).norm(), 0.01);
}

TEST(LeastSquaresFit, StopsWithinARound) {
  std::stop_source source;
  RunContext context;
  context.stop = source.get_token();
  int reports = 0;
  context.progress = [&](const Progress&) {
    if (++reports == 2) source.request_stop();
  };
  FitOptions options;
  options.rounds = 50;
  const FitOutcome fit =
      RunLeastSquaresFit(SphereCloud(0.3, 5'000), OctahedralSphere(0.3, 2), options, context);
  EXPECT_EQ(fit.status.code(), absl::StatusCode::kCancelled);
  EXPECT_LE(fit.state.rms.size(), 4u);
}

}  // namespace
}  // namespace rilievo
