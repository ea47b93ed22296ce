#include "core/domain/fit_loop_domain.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstring>
#include <numeric>

#include "core/domain/domain_samples.h"
#include "tests/unit/domain/analytic_scenes.h"

namespace rilievo {
namespace {

using testing::HasSubstr;

DomainFit Fit(const OrientedCloud& cloud, const ControlMesh& mesh, const FitOptions& options = {},
              const RunContext& context = {}) {
  const PointIndex index(cloud.points);
  auto fit = FitLoopDomain(cloud, index, mesh, options, context);
  EXPECT_TRUE(fit.ok()) << fit.status();
  return *std::move(fit);
}

// The fitted surface, sampled well below the level that the fit sampled.
struct FineSurface {
  DomainSamples samples;
  SampledSurface surface;
};
FineSurface Sample(const ControlMesh& mesh, int level = 3) {
  FineSurface fine;
  fine.samples = *BuildDomainSamples(mesh, level, RunContext());
  EXPECT_TRUE(SampleSurface(fine.samples, mesh.vertices, RunContext(), &fine.surface).ok());
  return fine;
}

// Area-weighted root mean square of the distance of the surface to the truth.
double RmsTo(const FineSurface& fine, const std::function<double(const Eigen::Vector3d&)>& truth) {
  const AreaShares shares = ShareArea(fine.samples, fine.surface);
  double squares = 0;
  for (int i = 0; i < fine.samples.size(); ++i) {
    squares += shares.samples[i] * std::pow(truth(fine.surface.positions.col(i)), 2);
  }
  return std::sqrt(squares);
}

// Triangles of the fine surface that face away from the limit normal at their corners, or from
// their neighbours.
int Folds(const FineSurface& fine) {
  const MeshTopology& topology = fine.samples.finest();
  int folds = 0;
  for (int f = 0; f < topology.face_count(); ++f) {
    const auto corner = [&](int k) { return fine.surface.positions.col(topology.faces(k, f)); };
    const Eigen::Vector3d side = corner(1) - corner(0);
    const Eigen::Vector3d normal = side.cross(corner(2) - corner(0));
    for (int k = 0; k < 3; ++k) {
      folds += normal.dot(fine.surface.normals.col(topology.faces(k, f))) <= 0;
    }
  }
  return folds;
}

double BoxDistance(const Eigen::Vector3d& half, const Eigen::Vector3d& p) {
  const Eigen::Vector3d q = p.cwiseAbs() - half;
  return q.cwiseMax(0).norm() + std::min(q.maxCoeff(), 0.0);
}

double TorusDistance(const Eigen::Vector3d& p) {
  return std::hypot(std::hypot(p.x(), p.y()) - 0.25, p.z()) - 0.1;
}

TEST(FitLoopDomain, SphereWithinATenthOfAPerMille) {
  const DomainFit fit = Fit(SphereCloud(0.3, 100'000), OctahedralSphere(0.3, 3));
  EXPECT_LT(RmsTo(Sample(fit.control_mesh), [](const auto& p) { return p.norm() - 0.3; }), 3e-5);
  EXPECT_GT(fit.rms_before, 4e-3);
  EXPECT_LT(fit.rms_after, 3e-5);
}

TEST(FitLoopDomain, Torus) {
  const DomainFit fit = Fit(TorusCloud(0.25, 0.1, 50'000), TorusMesh(0.25, 0.1, 40, 16));
  EXPECT_LT(RmsTo(Sample(fit.control_mesh), TorusDistance), 1e-5);
}

TEST(FitLoopDomain, NoiseAveragesOut) {
  const double sigma = 1e-3;
  const DomainFit fit = Fit(SphereCloud(0.3, 100'000, sigma), OctahedralSphere(0.3, 3));
  const double rms = RmsTo(Sample(fit.control_mesh), [](const auto& p) { return p.norm() - 0.3; });
  EXPECT_LT(rms, sigma / 8);
  // What remains of the cloud's distance is its noise.
  EXPECT_NEAR(fit.rms_after, sigma, 0.03 * sigma);
}

TEST(FitLoopDomain, FewerPointsThanSamples) {
  const DomainFit fit = Fit(SphereCloud(0.3, 2'000), OctahedralSphere(0.3, 3));
  EXPECT_LT(RmsTo(Sample(fit.control_mesh), [](const auto& p) { return p.norm() - 0.3; }), 1e-4);
}

TEST(FitLoopDomain, OutliersDoNotDent) {
  OrientedCloud cloud = SphereCloud(0.3, 30'000);
  Random random(9);
  for (int i = 0; i < cloud.points.cols(); i += 100) {
    cloud.points.col(i) *= 1 + random.Uniform(0.05, 0.2);
  }
  const DomainFit fit = Fit(cloud, OctahedralSphere(0.3, 3));
  EXPECT_LT(RmsTo(Sample(fit.control_mesh), [](const auto& p) { return p.norm() - 0.3; }), 1.5e-3);
}

class OpenHemisphere : public testing::TestWithParam<double> {};

// The control mesh ends short of the cloud's rim, on it, or beyond.
TEST_P(OpenHemisphere, KeepsItsRim) {
  ControlMesh mesh = OctahedralSphere(0.3, 4, true);
  for (int v = 0; v < mesh.vertices.cols(); ++v) {
    const double z = mesh.vertices(2, v) * (1 - GetParam() / 0.3) + GetParam();
    const double radius = std::sqrt(std::max(0.0, 0.09 - z * z));
    mesh.vertices.col(v).head<2>() *=
        radius / std::max(1e-12, mesh.vertices.col(v).head<2>().norm());
    mesh.vertices(2, v) = z;
  }
  const OrientedCloud cloud = SphereCloud(0.3, 50'000, 0, true);
  const DomainFit fit = Fit(cloud, mesh);
  const FineSurface fine = Sample(fit.control_mesh, 2);
  EXPECT_LT(RmsTo(fine, [](const auto& p) { return p.norm() - 0.3; }), 1e-4);
  EXPECT_EQ(Folds(fine), 0);
  for (int i = 0; i < fine.samples.size(); ++i) {
    if (!fine.samples.on_boundary(i)) continue;
    EXPECT_NEAR(fine.surface.positions(2, i), 0, cloud.median_spacing);
  }
}
INSTANTIATE_TEST_SUITE_P(Ends, OpenHemisphere, testing::Values(-0.02, 0.0, 0.02));

TEST(FitLoopDomain, ThinBoxKeepsItsThickness) {
  const Eigen::Vector3d half(0.4, 0.3, 0.005);
  const DomainFit fit = Fit(BoxCloud(half, 100'000), BoxMesh(half, 0.04));
  const FineSurface fine = Sample(fit.control_mesh, 2);
  EXPECT_EQ(Folds(fine), 0);
  int checked = 0;
  for (int i = 0; i < fine.samples.size(); ++i) {
    const Eigen::Vector3d p = fine.surface.positions.col(i);
    if (std::abs(p.x()) > 0.3 || std::abs(p.y()) > 0.2) continue;
    EXPECT_NEAR(p.z(), fine.surface.normals(2, i) > 0 ? 0.005 : -0.005, 5e-4);
    ++checked;
  }
  EXPECT_GT(checked, 1000);
}

TEST(FitLoopDomain, SharpEdgesNeitherRingNorFold) {
  const Eigen::Vector3d half(0.3, 0.25, 0.2);
  const double step = 0.05;
  FitOptions options;
  options.rounds = 8;
  const DomainFit fit = Fit(BoxCloud(half, 50'000), BoxMesh(half, step), options);
  const FineSurface fine = Sample(fit.control_mesh);
  EXPECT_EQ(Folds(fine), 0);
  EXPECT_LT(RmsTo(fine, [&](const auto& p) { return BoxDistance(half, p); }), 1e-3);
  // An edge rounds off within its own row of faces; two rows off, nothing is felt of it.
  for (int i = 0; i < fine.samples.size(); ++i) {
    const Eigen::Vector3d p = fine.surface.positions.col(i);
    Eigen::Vector3d inside = half - p.cwiseAbs();
    std::sort(inside.data(), inside.data() + 3);
    if (inside[1] < 2 * step) continue;
    EXPECT_LT(std::abs(BoxDistance(half, p)), 4e-4) << p.transpose();
  }
}

TEST(FitLoopDomain, SeesWhatItDoesNotCover) {
  // The mesh is a sphere of half the size, all of it inside: the cloud pulls it out.
  const DomainFit fit = Fit(SphereCloud(0.3, 20'000), OctahedralSphere(0.2, 3));
  EXPECT_LT(RmsTo(Sample(fit.control_mesh), [](const auto& p) { return p.norm() - 0.3; }), 1e-4);
}

TEST(FitLoopDomain, SuzukiAloneComesNear) {
  FitOptions options;
  options.method = FitMethod::kSuzuki;
  options.suzuki_rounds = 10;
  const DomainFit fit = Fit(SphereCloud(0.3, 20'000), OctahedralSphere(0.3, 3), options);
  EXPECT_LT(RmsTo(Sample(fit.control_mesh), [](const auto& p) { return p.norm() - 0.3; }), 3e-4);
  EXPECT_EQ(fit.rounds, 10);
  EXPECT_EQ(fit.round_rms.size(), 10u);
}

TEST(FitLoopDomain, FiguresAreMeasured) {
  const OrientedCloud cloud = SphereCloud(0.3, 20'000);
  FitOptions options;
  const DomainFit fit = Fit(cloud, OctahedralSphere(0.3, 3), options);
  ASSERT_EQ(static_cast<int>(fit.round_rms.size()), fit.rounds);
  EXPECT_EQ(fit.rounds, options.suzuki_rounds + options.rounds);
  EXPECT_DOUBLE_EQ(fit.rms_after, fit.round_rms.back());
  // Fitting what was fitted starts where that ended.
  const DomainFit again = Fit(cloud, fit.control_mesh, options);
  EXPECT_NEAR(again.rms_before, fit.rms_after, 1e-3 * fit.rms_after);
  EXPECT_TRUE(again.converged);
  // On the sphere the offset of a cloud point is its distance from the surface along the radius.
  const FineSurface fine = Sample(OctahedralSphere(0.3, 3), 4);
  const double gap = RmsTo(fine, [](const auto& p) { return p.norm() - 0.3; });
  EXPECT_NEAR(fit.rms_before, gap, 0.03 * gap);
}

TEST(FitLoopDomain, OrderOfThePointsDoesNotMatter) {
  const OrientedCloud cloud = TorusCloud(0.25, 0.1, 20'000);
  OrientedCloud shuffled = cloud;
  std::vector<int> order(20'000);
  std::iota(order.begin(), order.end(), 0);
  Random random(11);
  for (size_t i = order.size() - 1; i > 0; --i) std::swap(order[i], order[random.Below(i + 1)]);
  for (size_t i = 0; i < order.size(); ++i) {
    shuffled.points.col(static_cast<Eigen::Index>(i)) = cloud.points.col(order[i]);
    shuffled.normals.col(static_cast<Eigen::Index>(i)) = cloud.normals.col(order[i]);
  }
  const ControlMesh mesh = TorusMesh(0.25, 0.1, 20, 10);
  const Eigen::Matrix3Xd expected = Fit(cloud, mesh).control_mesh.vertices;
  const Eigen::Matrix3Xd found = Fit(shuffled, mesh).control_mesh.vertices;
  EXPECT_LT((found - expected).cwiseAbs().maxCoeff(), 1e-9);
}

TEST(FitLoopDomain, SimilarityTransformCarriesOver) {
  const Eigen::Matrix3d turn =
      Eigen::AngleAxisd(1.1, Eigen::Vector3d(1, 2, -3).normalized()).toRotationMatrix();
  const double scale = 3.75;
  const Eigen::Vector3d shift(0.3, -1.2, 0.8);
  const auto carry = [&](const Eigen::Matrix3Xd& points) -> Eigen::Matrix3Xd {
    return (scale * turn * points).colwise() + shift;
  };
  // With a boundary, so that every kind of residual takes part.
  OrientedCloud cloud = SphereCloud(0.3, 20'000, 1e-3, true);
  OrientedCloud carried = cloud;
  const ControlMesh mesh = OctahedralSphere(0.29, 3, true);
  carried.points = carry(cloud.points);
  carried.normals = turn * cloud.normals;
  // A power of two and a scale of few bits: exact in single precision.
  cloud.spacing.assign(cloud.spacing.size(), 0.00390625f);
  carried.spacing.assign(cloud.spacing.size(), static_cast<float>(0.00390625 * scale));
  ControlMesh carried_mesh = mesh;
  carried_mesh.vertices = carry(mesh.vertices);
  const Eigen::Matrix3Xd expected = carry(Fit(cloud, mesh).control_mesh.vertices);
  const Eigen::Matrix3Xd found = Fit(carried, carried_mesh).control_mesh.vertices;
  EXPECT_LT((found - expected).cwiseAbs().maxCoeff(), 1e-9 * scale);
}

TEST(FitLoopDomain, SameBytesForAnyNumberOfThreads) {
  const Eigen::Vector3d half(0.3, 0.25, 0.02);
  const OrientedCloud cloud = BoxCloud(half, 30'000);
  const ControlMesh mesh = BoxMesh(half, 0.05);
  RunContext one, two, three;
  one.threads = 1;
  two.threads = 2;
  three.threads = 3;
  const DomainFit first = Fit(cloud, mesh, {}, one);
  for (const RunContext& context : {two, three}) {
    const DomainFit other = Fit(cloud, mesh, {}, context);
    EXPECT_EQ(std::memcmp(first.control_mesh.vertices.data(), other.control_mesh.vertices.data(),
                          sizeof(double) * static_cast<size_t>(mesh.vertices.size())),
              0);
    EXPECT_EQ(first.round_rms, other.round_rms);
  }
}

TEST(FitLoopDomain, ReportsProgressAndStops) {
  const OrientedCloud cloud = SphereCloud(0.3, 5'000);
  std::vector<double> fractions;
  RunContext context;
  context.progress = [&](const Progress& progress) {
    EXPECT_EQ(progress.stage, Stage::kDomainFit);
    fractions.push_back(progress.fraction);
  };
  Fit(cloud, OctahedralSphere(0.3, 2), {}, context);
  EXPECT_GE(fractions.size(), 6u);
  EXPECT_TRUE(std::is_sorted(fractions.begin(), fractions.end()));
  EXPECT_EQ(fractions.back(), 1.0);

  std::stop_source source;
  source.request_stop();
  context.stop = source.get_token();
  const PointIndex index(cloud.points);
  EXPECT_EQ(FitLoopDomain(cloud, index, OctahedralSphere(0.3, 2), {}, context).status().code(),
            absl::StatusCode::kCancelled);
}

TEST(FitLoopDomain, RefusesBadOptionsByName) {
  const OrientedCloud cloud = SphereCloud(0.3, 100);
  const PointIndex index(cloud.points);
  const ControlMesh mesh = OctahedralSphere(0.3, 1);
  const auto message = [&](const FitOptions& o) {
    const auto fit = FitLoopDomain(cloud, index, mesh, o, RunContext());
    EXPECT_EQ(fit.status().code(), absl::StatusCode::kInvalidArgument);
    return std::string(fit.status().message());
  };
  FitOptions options;
  options.suzuki_lambda = 0;
  EXPECT_THAT(message(options), HasSubstr("suzuki_lambda"));
  options = {};
  options.rounds = 0;
  EXPECT_THAT(message(options), HasSubstr("rounds: 0"));
  options = {};
  options.fairness_end = -1;
  EXPECT_THAT(message(options), HasSubstr("fairness_end"));
  options = {};
  options.robust_spacings = std::nan("");
  EXPECT_THAT(message(options), HasSubstr("robust_spacings"));
  options = {};
  options.tangential_weight = std::nan("");
  EXPECT_THAT(message(options), HasSubstr("tangential_weight"));
}

TEST(FitLoopDomain, PutsCreasesOnTheEdgesOfABox) {
  const Eigen::Vector3d half(0.32, 0.28, 0.24);
  const OrientedCloud cloud = BoxCloud(half, 20'000);
  const PointIndex index(cloud.points);
  ControlMesh start = SharpBoxMesh(half, 0.08);
  Random random(3);
  for (Eigen::Index v = 0; v < start.vertices.cols(); ++v) {
    start.vertices.col(v) +=
        0.004 * Eigen::Vector3d(random.Normal(), random.Normal(), random.Normal());
  }
  const auto fit = FitLoopDomain(cloud, index, start, FitOptions(), RunContext());
  ASSERT_TRUE(fit.ok()) << fit.status();
  EXPECT_EQ(fit->control_mesh.creases, start.creases);
  EXPECT_EQ(fit->control_mesh.corners, start.corners);
  double worst = 0, before = 0;
  for (const Crease& crease : start.creases) {
    const auto off = [&](const ControlMesh& mesh) {
      Eigen::Array3d away = (mesh.vertices.col(crease.a).cwiseAbs() - half).cwiseAbs().array();
      std::sort(away.begin(), away.end());
      return away[1];
    };
    worst = std::max(worst, off(fit->control_mesh));
    before = std::max(before, off(start));
  }
  EXPECT_GT(before, 0.008);
  EXPECT_LT(worst, 0.0008);
  ControlMesh smooth = start;
  smooth.creases.clear();
  const auto rounded = FitLoopDomain(cloud, index, smooth, FitOptions(), RunContext());
  ASSERT_TRUE(rounded.ok());
  EXPECT_LT(fit->rms_after, 0.2 * rounded->rms_after);
}

}  // namespace
}  // namespace rilievo
