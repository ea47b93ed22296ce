// Heights over a domain with creases and corners that are close together for the points.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/unit/displacement/domain_fixtures.h"

namespace rilievo {
namespace {

using namespace testing;
using Eigen::Vector3d;

constexpr double kHalf = 0.25;

// A box, thin along z, whose twelve edges are creases and whose vertices are corners.
ControlMesh Box(double thickness) {
  ControlMesh mesh;
  mesh.vertices.resize(3, 8);
  for (int v = 0; v < 8; ++v) {
    mesh.vertices.col(v) << ((v & 1) != 0 ? kHalf : -kHalf), ((v & 2) != 0 ? kHalf : -kHalf),
        (v & 4) != 0 ? thickness : 0;
  }
  mesh.faces.resize(3, 12);
  mesh.faces << 0, 0, 4, 4, 0, 0, 2, 2, 0, 0, 1, 1,  //
      2, 3, 5, 7, 1, 5, 6, 7, 4, 6, 3, 7,            //
      3, 1, 7, 6, 5, 4, 7, 3, 6, 2, 7, 5;
  for (const int step : {1, 2, 4}) {
    for (int v = 0; v < 8; ++v) {
      if ((v & step) == 0) mesh.creases.push_back({v, v + step, kInfiniteSharpness});
    }
  }
  std::sort(mesh.creases.begin(), mesh.creases.end(),
            [](const Crease& p, const Crease& q) { return p.a != q.a ? p.a < q.a : p.b < q.b; });
  for (int v = 0; v < 8; ++v) mesh.corners.push_back(v);
  return mesh;
}

// On the sides of such a box, one in each cell of a grid.
Points BoxPoints(double thickness, double step, double noise) {
  Random random(1);
  Points points;
  const auto add = [&](Vector3d at, const Vector3d& normal) {
    points.Add(at + noise * Gauss(&random) * normal, normal);
  };
  const int count = static_cast<int>(2 * kHalf / step);
  const auto place = [&](int i) { return -kHalf + (i + Uniform(&random, 0.2, 0.8)) * step; };
  for (int i = 0; i < count; ++i) {
    for (int j = 0; j < count; ++j) {
      add({place(i), place(j), thickness}, {0, 0, 1});
      add({place(i), place(j), 0}, {0, 0, -1});
    }
    for (const double side : {-1.0, 1.0}) {
      add({place(i), side * kHalf, Uniform(&random, 0, thickness)}, {0, side, 0});
      add({side * kHalf, place(i), Uniform(&random, 0, thickness)}, {side, 0, 0});
    }
  }
  return points;
}

TEST(SharpDomain, WithFewPointsBetweenCreasesHeightsStayNearTheDomain) {
  constexpr double kStep = 0.02, kNoise = 0.0005;
  for (const double thickness : {0.004, 0.01, 0.02}) {
    const Points points = BoxPoints(thickness, kStep, kNoise);
    const Scan scan = MakeScan(points.Positions(), points.Normals(), 0);
    const Domain domain = MakeDomain(Box(thickness), 5);
    const DisplacementField field = Sample(scan, domain);
    const HeightError error = Compare(field, [](int) { return 0; });
    EXPECT_LT(error.max, 8 * kNoise) << thickness;
  }
}

}  // namespace
}  // namespace rilievo
