#include "core/codec/container/deformed_surface.h"

#include <gtest/gtest.h>

#include <numbers>

#include "tests/unit/codec/test_surfaces.h"
#include "tests/unit/surface/whole_folds.h"

namespace rilievo {
namespace {

// By 90 degrees along x, which is `length` long.
Eigen::Vector3d Bent(const Eigen::Vector3d& point, double length) {
  const double radius = 2 * length / std::numbers::pi, angle = point.x() / radius;
  return {(radius + point.z()) * std::sin(angle), point.y(),
          (radius + point.z()) * std::cos(angle)};
}

TEST(DeformedSurfaceTest, ABendBy90DegreesFoldsNoMoreThanTheDomain) {
  ControlMesh creased = Torus(24, 12);
  for (int i = 0; i < 24; ++i) {
    const int a = 12 * i, b = 12 * ((i + 1) % 24);
    creased.creases.push_back({std::min(a, b), std::max(a, b), i % 2 == 0 ? 10.0f : 1.5f});
  }
  for (const ControlMesh& mesh : {Torus(24, 12), Sheet(12, 12, true), creased}) {
    DecodedSurface decoded;
    decoded.surface = SurfaceOver(mesh, 3, 1e-3, 1e-3);
    const SpatialFrame& frame = decoded.surface.frame;
    ASSERT_EQ(CountFolds(decoded.surface), 0);
    ControlMesh cage = decoded.surface.control_mesh;
    for (auto vertex : cage.vertices.colwise()) {
      vertex = frame.ScanFromUnit(Bent(vertex, 0.84));
    }
    DecodedSurface bent = *WithControlMesh(decoded, cage);
    const int64_t folds = CountFolds(bent.surface);
    std::fill(bent.surface.heights.begin(), bent.surface.heights.end(), 0.0f);
    EXPECT_LE(folds, CountFolds(bent.surface));
  }
}

}  // namespace
}  // namespace rilievo
