#include "core/domain/sharp_foot_points.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numeric>
#include <vector>

#include "tests/unit/domain/analytic_scenes.h"

namespace rilievo {
namespace {

using Eigen::Vector3d;

const Vector3d kHalf(0.3, 0.25, 0.2);

struct SharpBox {
  explicit SharpBox(double scale)
      : cloud(BoxCloud(kHalf, 20'000)),
        mesh(SharpBoxMesh(kHalf, 0.1)),
        samples(*BuildDomainSamples(mesh, 2, RunContext())) {
    mesh.vertices *= scale;
    EXPECT_TRUE(SampleSurface(samples, mesh.vertices, RunContext(), &surface).ok());
  }
  std::vector<int> Near(int sample) const {
    std::vector<int> points;
    for (int i = 0; i < cloud.points.cols(); ++i) {
      const double distance = (cloud.points.col(i) - surface.positions.col(sample)).norm();
      if (distance < 6 * cloud.median_spacing) points.push_back(i);
    }
    return points;
  }
  OrientedCloud cloud;
  ControlMesh mesh;
  DomainSamples samples;
  SampledSurface surface;
};

TEST(SharpFeet, AxesSpanTheNormalsOfTheSides) {
  const SharpBox box(1);
  int corners = 0;
  for (int sample : box.samples.sharp) {
    const SideAxes sides = AxesOfSides(box.samples, box.surface, sample);
    const bool corner = sides.strength[2] > 0.5;
    EXPECT_NEAR(sides.strength[0], 1, 1e-9);
    EXPECT_NEAR(sides.strength[1], 1, 1e-9);
    EXPECT_NEAR(sides.strength[2], corner ? 1 : 0, 1e-9);
    corners += corner;
    const double expected = corner ? std::sqrt(1.0 / 3) : std::sqrt(0.5);
    EXPECT_NEAR(box.surface.normals.col(sample).cwiseAbs().maxCoeff(), expected, 1e-9);
  }
  EXPECT_EQ(corners, 8);
}

TEST(SharpFeet, LieWhereTheSidesMeet) {
  const SharpBox box(0.98);
  int checked = 0;
  for (size_t k = 0; k < box.samples.sharp.size(); k += 7) {
    const int sample = box.samples.sharp[k];
    const auto foot =
        FindSharpFootPoint(box.cloud, box.Near(sample), box.samples, box.surface, sample);
    ASSERT_TRUE(foot.has_value());
    const Vector3d at = box.surface.positions.col(sample) + foot->move;
    const auto sides = ((at.cwiseAbs() - kHalf).cwiseAbs().array() < 1e-9).count();
    const int first = box.samples.side_begin[k];
    EXPECT_GE(sides, box.samples.side_begin[k + 1] - first);
    EXPECT_NEAR(foot->spacing, box.cloud.median_spacing, 1e-6);
    ++checked;
  }
  EXPECT_GT(checked, 20);
}

TEST(SharpFeet, OneSideAloneHasNone) {
  const SharpBox box(1);
  const int sample = box.samples.sharp[box.samples.sharp.size() / 2];
  std::vector<int> points;
  for (int point : box.Near(sample)) {
    const int side = box.samples.side_begin[box.samples.sharp.size() / 2];
    if (box.cloud.normals.col(point).dot(box.surface.side_normals.col(side)) > 0.9) {
      points.push_back(point);
    }
  }
  ASSERT_GT(points.size(), 5u);
  EXPECT_FALSE(FindSharpFootPoint(box.cloud, points, box.samples, box.surface, sample).has_value());
}

TEST(SharpFeet, SmoothMeshesHaveNoSharpSamples) {
  const DomainSamples samples = *BuildDomainSamples(OctahedralSphere(0.3, 2), 2, RunContext());
  EXPECT_TRUE(samples.sharp.empty());
  for (int i = 0; i < samples.size(); ++i) EXPECT_FALSE(samples.is_sharp(i));
}

}  // namespace
}  // namespace rilievo
