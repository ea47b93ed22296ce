#include "core/domain/foot_points.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>

#include "tests/unit/domain/analytic_scenes.h"

namespace rilievo {
namespace {

class Feet {
 public:
  Feet(OrientedCloud cloud, const ControlMesh& mesh, int level, double robust_spacings = 2.0)
      : cloud_(std::move(cloud)),
        index_(cloud_.points),
        samples_(*BuildDomainSamples(mesh, level, RunContext())),
        search_(cloud_, index_, samples_, robust_spacings) {
    EXPECT_TRUE(SampleSurface(samples_, mesh.vertices, RunContext(), &surface_).ok());
    Update();
  }
  void Update() { EXPECT_TRUE(search_.Update(surface_, RunContext(), &feet_).ok()); }
  Eigen::Vector3d Foot(int i) const {
    return surface_.positions.col(i) + feet_.offset[static_cast<size_t>(i)] * feet_.normals.col(i);
  }

  const OrientedCloud cloud_;
  const PointIndex index_;
  const DomainSamples samples_;
  SampledSurface surface_;
  FootPointSearch search_;
  FootPoints feet_;
};

TEST(FootPoints, LieOnTheSurfaceThatTheCloudWasTakenFrom) {
  // Dense: the assigned points are averaged. Sparse: the nearest ones are looked up.
  for (int count : {50'000, 1'000}) {
    const Feet feet(SphereCloud(0.3, count), OctahedralSphere(0.3, 3), 2);
    for (int i = 0; i < feet.samples_.size(); ++i) {
      ASSERT_GT(feet.feet_.weight[i], 0);
      // The way to the foot is 0.005; the points around it are the spacing apart.
      const double tolerance = std::max(1e-4, 0.02 * feet.cloud_.median_spacing);
      EXPECT_NEAR(feet.Foot(i).norm(), 0.3, tolerance) << count << " points, sample " << i;
      EXPECT_GT(feet.feet_.normals.col(i).dot(feet.surface_.normals.col(i)), 0.99);
    }
  }
}

TEST(FootPoints, AveragingTakesTheNoiseOut) {
  const double noise = 1e-3;
  const Feet feet(SphereCloud(0.3, 100'000, noise), OctahedralSphere(0.3, 3), 2);
  double squares = 0;
  for (int i = 0; i < feet.samples_.size(); ++i) {
    squares += std::pow(feet.Foot(i).norm() - 0.3, 2);
  }
  // 100 000 points over 4 098 samples: the mean of 24 has a fifth of the deviation.
  EXPECT_LT(std::sqrt(squares / feet.samples_.size()), noise / 4);
}

TEST(FootPoints, SamplesOverAHoleHaveNone) {
  OrientedCloud cloud = SphereCloud(0.3, 20'000);
  int kept = 0;
  for (int i = 0; i < cloud.points.cols(); ++i) {
    if (cloud.points(2, i) > 0.2) continue;
    cloud.points.col(kept) = cloud.points.col(i);
    cloud.normals.col(kept++) = cloud.normals.col(i);
  }
  cloud.points.conservativeResize(3, kept);
  cloud.normals.conservativeResize(3, kept);
  cloud.spacing.resize(static_cast<size_t>(kept));
  const double spacing = cloud.median_spacing;
  const Feet feet(std::move(cloud), OctahedralSphere(0.3, 3), 2);
  int without = 0;
  for (int i = 0; i < feet.samples_.size(); ++i) {
    const double z = feet.surface_.positions(2, i);
    if (z > 0.2 + 4 * spacing) {
      EXPECT_EQ(feet.feet_.weight[i], 0) << z;
    } else if (z < 0.2) {
      EXPECT_GT(feet.feet_.weight[i], 0) << z;
    }
    without += feet.feet_.weight[i] == 0;
  }
  EXPECT_GT(without, 200);
}

TEST(FootPoints, SheetsOfAThinWallDoNotAttractEachOther) {
  const Eigen::Vector3d half(0.4, 0.3, 0.005);
  Feet feet(BoxCloud(half, 20'000), BoxMesh(half, 0.05), 2);
  // Half the wall's thickness off: now the nearest points of the lower samples are the upper's.
  feet.surface_.positions.row(2).array() += 0.006;
  feet.Update();
  int checked = 0;
  for (int i = 0; i < feet.samples_.size(); ++i) {
    const Eigen::Vector3d sample = feet.surface_.positions.col(i);
    if (std::abs(sample.x()) > 0.3 || std::abs(sample.y()) > 0.2) continue;
    ASSERT_GT(feet.feet_.weight[i], 0);
    EXPECT_NEAR(feet.Foot(i).z(), feet.surface_.normals(2, i) > 0 ? 0.005 : -0.005, 1e-9);
    ++checked;
  }
  EXPECT_GT(checked, 1000);
}

TEST(FootPoints, FarOnesWeighLess) {
  OrientedCloud cloud = SphereCloud(0.3, 20'000);
  // A twentieth of the points, those near one pole, lie far above the sphere.
  int raised = 0;
  for (int i = 0; i < cloud.points.cols(); ++i) {
    if (cloud.points(2, i) < 0.27) continue;
    cloud.points.col(i) *= 1.2;
    ++raised;
  }
  ASSERT_GT(raised, 500);
  const double spacing = cloud.median_spacing;
  const Feet feet(std::move(cloud), OctahedralSphere(0.3, 3), 2);
  int down = 0;
  for (int i = 0; i < feet.samples_.size(); ++i) {
    if (feet.feet_.offset[i] < 0.03) continue;
    EXPECT_LE(feet.feet_.weight[i], 4 * spacing / 0.03);
    EXPECT_GT(feet.feet_.weight[i], 0);
    ++down;
  }
  EXPECT_GT(down, 50);
}

TEST(FootPoints, BoundarySamplesFindTheBorder) {
  // The mesh ends above and below the rim of the cloud, in turn.
  for (double end : {-0.03, 0.03}) {
    ControlMesh mesh = OctahedralSphere(0.3, 3, true);
    for (int v = 0; v < mesh.vertices.cols(); ++v) {
      const double z = mesh.vertices(2, v) * (1 - end / 0.3) + end;
      mesh.vertices.col(v).head<2>() *=
          std::sqrt(0.09 - z * z) / std::max(1e-12, mesh.vertices.col(v).head<2>().norm());
      mesh.vertices(2, v) = z;
    }
    const Feet feet(SphereCloud(0.3, 30'000, 0, true), mesh, 2);
    const double spacing = feet.cloud_.median_spacing;
    int boundary = 0, short_of_it = 0;
    for (int i = 0; i < feet.samples_.size(); ++i) {
      if (!feet.samples_.on_boundary(i)) {
        EXPECT_EQ(feet.feet_.border_weight[i], 0);
        continue;
      }
      ++boundary;
      ASSERT_EQ(feet.feet_.border_weight[i], 1);
      EXPECT_LT(feet.feet_.conormals(2, i), -0.8);
      const double border =
          feet.surface_.positions(2, i) + feet.feet_.border_offset[i] * feet.feet_.conormals(2, i);
      EXPECT_GT(border, -2 * spacing);
      short_of_it += border > 2 * spacing;
    }
    // Random points leave a gap of two spacings here and there; the next round goes on behind it.
    EXPECT_LE(short_of_it, boundary / 50);
    EXPECT_EQ(boundary, 4 * 8 * 4);
  }
}

TEST(FootPoints, TheBorderIsNotBeyondAGap) {
  // A belt of points 8 spacings below the rim of the cloud.
  const ControlMesh mesh = OctahedralSphere(0.3, 3, true);
  OrientedCloud cloud = SphereCloud(0.3, 30'000, 0, true);
  const OrientedCloud whole = SphereCloud(0.3, 60'000, 0, false);
  const double gap = 8 * cloud.median_spacing;
  std::vector<int> belt;
  for (int i = 0; i < whole.points.cols(); ++i) {
    if (whole.points(2, i) < -gap && whole.points(2, i) > -1.5 * gap) belt.push_back(i);
  }
  const auto rim = cloud.points.cols();
  const auto more = static_cast<Eigen::Index>(belt.size());
  cloud.points.conservativeResize(3, rim + more);
  cloud.normals.conservativeResize(3, rim + more);
  cloud.points.rightCols(more) = whole.points(Eigen::all, belt);
  cloud.normals.rightCols(more) = whole.normals(Eigen::all, belt);
  cloud.spacing.resize(static_cast<size_t>(rim + more), static_cast<float>(cloud.median_spacing));
  cloud.noise.resize(static_cast<size_t>(rim + more), 0.0f);
  const Feet feet(cloud, mesh, 2);
  for (int i = 0; i < feet.samples_.size(); ++i) {
    if (!feet.samples_.on_boundary(i)) continue;
    EXPECT_LT(feet.feet_.border_offset[i], gap / 2);
  }
}

// A crease that lies aside of a known line: the way there is across the line, and known in both
// directions across it; corners stay.
TEST(FootPoints, SharpLinesAreMet) {
  const Eigen::Vector3d half(0.3, 0.3, 0.3);
  OrientedCloud cloud = BoxCloud(half, 20'000);
  ControlMesh box = SharpBoxMesh(half, 0.1);
  for (int axis = 0; axis < 3; ++axis) {
    for (const double x : {-0.3, 0.3}) {
      for (const double y : {-0.3, 0.3}) {
        for (const double z : {-0.3, 0.3}) {
          cloud.sharp_lines.conservativeResize(3, cloud.sharp_lines.cols() + 1);
          Eigen::Vector3d end;
          end[axis] = z, end[(axis + 1) % 3] = x, end[(axis + 2) % 3] = y;
          cloud.sharp_lines.rightCols<1>() = end;
        }
      }
    }
  }
  box.vertices *= 1.02;
  const Feet feet(std::move(cloud), box, 1);
  ASSERT_FALSE(feet.samples_.sharp.empty());
  for (size_t k = 0; k < feet.samples_.sharp.size(); ++k) {
    const int sample = feet.samples_.sharp[k];
    const bool corner = sample < feet.samples_.control_vertex_count() &&
                        feet.samples_.control_kinds[sample] == VertexKind::kCorner;
    const Eigen::Vector3d move = feet.feet_.sharp_moves.col(static_cast<Eigen::Index>(k));
    const SideAxes& axes = feet.feet_.sharp_axes[k];
    if (corner) {
      EXPECT_EQ(move.norm(), 0);
      EXPECT_GT(axes.strength.minCoeff(), 1);
      continue;
    }
    EXPECT_NEAR(std::abs(axes.axes.col(2).dot(move)), 0, 1e-12);
    EXPECT_EQ(axes.strength[2], 0);
    Eigen::Vector3d foot = feet.surface_.positions.col(sample) + move;
    std::sort(foot.data(), foot.data() + 3,
              [](double a, double b) { return std::abs(a) < std::abs(b); });
    EXPECT_NEAR(std::abs(foot[1]), 0.3, 1e-9);
    EXPECT_NEAR(std::abs(foot[2]), 0.3, 1e-9);
  }
}

}  // namespace
}  // namespace rilievo
