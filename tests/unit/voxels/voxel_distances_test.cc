#include "core/voxels/voxel_distances.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include "core/surface/triangle_distance.h"
#include "tests/unit/voxels/closed_meshes.h"

namespace rilievo {
namespace {

using Eigen::Vector3d;

VoxelGrid DistanceGridAround(const TriangleMesh& mesh, int resolution, int band) {
  return ChooseVoxelGrid(mesh, {.resolution = resolution, .voxel = {}, .margin = band + 1}).value();
}

template <typename Visit>
void ForEachDistance(const VoxelDistances& field, const Visit& visit) {
  const VoxelGrid& grid = field.grid();
  const auto values = field.Layers(0, grid.size.z(), {});
  ASSERT_TRUE(values.ok()) << values.status();
  ASSERT_EQ(static_cast<int64_t>(values->size()), grid.count());
  for (int z = 0; z < grid.size.z(); ++z) {
    for (int y = 0; y < grid.size.y(); ++y) {
      for (int x = 0; x < grid.size.x(); ++x) {
        visit(grid.CenterOf(x, y, z), double{(*values)[static_cast<size_t>(grid.Index(x, y, z))]});
      }
    }
  }
}

double NearestByAll(const Vector3d& place, const TriangleMesh& mesh) {
  double least = std::numeric_limits<double>::infinity();
  for (Eigen::Index t = 0; t < mesh.triangles.cols(); ++t) {
    const auto corner = [&](int k) -> Vector3d { return mesh.vertices.col(mesh.triangles(k, t)); };
    least = std::min(least, SquaredDistanceToTriangle(place, corner(0), corner(1), corner(2)));
  }
  return std::sqrt(least);
}

void ExpectDistancesOfAll(const TriangleMesh& mesh, int resolution, int band) {
  const auto field =
      VoxelDistances::Build(mesh, DistanceGridAround(mesh, resolution, band), band, {});
  ASSERT_TRUE(field.ok()) << field.status();
  EXPECT_NEAR(field->band(), band * field->grid().voxel, 1e-15);
  double worst = 0;
  ForEachDistance(*field, [&](const Vector3d& center, double distance) {
    const double expected = std::min(NearestByAll(center, mesh), field->band());
    worst = std::max(worst, std::abs(std::abs(distance) - expected));
  });
  EXPECT_LT(worst, 1e-7);
}

TEST(VoxelDistancesTest, AreThoseToTheTriangles) {
  const TriangleMesh torus = Moved(TorusMesh(0.7, 0.28, 12, 8), Askew());
  for (const int band : {1, 3, 9}) ExpectDistancesOfAll(torus, 30, band);
  // Triangles of many voxels, and slivers.
  ExpectDistancesOfAll(Moved(BoxMesh({0, 0, 0}, {1, 1, 1}), Askew()), 60, 2);
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> unit(0, 1);
  const auto place = [&] { return Vector3d(unit(random), unit(random), unit(random)); };
  for (const double width : {0.0, 1e-15, 1e-14, 1e-13, 1e-10, 1e-6}) {
    const Vector3d a = place(), b = place(), c = 0.3 * a + 0.7 * b + width * place();
    ExpectDistancesOfAll(MeshOf({a, b, c}, {{0, 1, 2}}), 15, 3);
  }
}

TEST(VoxelDistancesTest, OfATorusAreThoseOfTheClosedForm) {
  const TriangleMesh torus = TorusMesh(0.7, 0.28, 300, 150);  // within 2e-4 of the torus
  const int band = 4;
  const auto field = VoxelDistances::Build(torus, DistanceGridAround(torus, 60, band), band, {});
  ASSERT_TRUE(field.ok()) << field.status();
  double worst = 0, least = 0, greatest = 0;
  ForEachDistance(*field, [&](const Vector3d& center, double distance) {
    const double exact = std::hypot(std::hypot(center.x(), center.y()) - 0.7, center.z()) - 0.28;
    worst = std::max(worst, std::abs(distance - std::clamp(exact, -field->band(), field->band())));
    least = std::min(least, distance);
    greatest = std::max(greatest, distance);
  });
  EXPECT_LT(worst, 2e-4);
  EXPECT_FLOAT_EQ(static_cast<float>(least), static_cast<float>(-field->band()));
  EXPECT_FLOAT_EQ(static_cast<float>(greatest), static_cast<float>(field->band()));
}

TEST(VoxelDistancesTest, LayersAreTheSameHoweverManyAreAskedFor) {
  const TriangleMesh sphere = SphereMesh(3);
  const auto field = VoxelDistances::Build(sphere, DistanceGridAround(sphere, 21, 2), 2, {});
  ASSERT_TRUE(field.ok()) << field.status();
  const auto all = field->Layers(0, field->grid().size.z(), {});
  ASSERT_TRUE(all.ok()) << all.status();
  for (const int count : {1, 3, VoxelDistances::kSlab}) {
    std::vector<float> gathered;
    for (int z = 0; z < field->grid().size.z(); z += count) {
      RunContext context;
      context.threads = count;
      const auto layers = field->Layers(z, std::min(count, field->grid().size.z() - z), context);
      ASSERT_TRUE(layers.ok()) << layers.status();
      gathered.insert(gathered.end(), layers->begin(), layers->end());
    }
    EXPECT_EQ(gathered, *all);
  }
  EXPECT_EQ(field->Layers(-1, 2, {}).status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(field->Layers(0, field->grid().size.z() + 1, {}).status().code(),
            absl::StatusCode::kInvalidArgument);
}

TEST(VoxelDistancesTest, TellTheVolumeOfThinWalls) {
  // 3.4 voxels thick, which whole layers miss by a tenth.
  const TriangleMesh wall = BoxMesh({0, 0, 0}, {1, 1, 0.034});
  const auto field = VoxelDistances::Build(wall, DistanceGridAround(wall, 100, 1), 1, {});
  ASSERT_TRUE(field.ok()) << field.status();
  const auto values = field->Layers(0, field->grid().size.z(), {});
  ASSERT_TRUE(values.ok()) << values.status();
  EXPECT_NEAR(VolumeInside(*values, field->grid().voxel) / 0.034, 1, 1e-3);
}

TEST(VoxelDistancesTest, OfAnOpenSheetHaveNoSign) {
  const TriangleMesh sheet =
      MeshOf({{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}}, {{0, 1, 2}, {0, 2, 3}});
  const auto field = VoxelDistances::Build(sheet, DistanceGridAround(sheet, 16, 3), 3, {});
  ASSERT_TRUE(field.ok()) << field.status();
  EXPECT_FALSE(field->is_signed());
  double worst = 0;
  ForEachDistance(*field, [&](const Vector3d& center, double distance) {
    const Vector3d inside = center.cwiseMax(Vector3d::Zero()).cwiseMin(Vector3d(1, 1, 0));
    worst = std::max(worst, std::abs(distance - std::min((center - inside).norm(), field->band())));
  });
  EXPECT_LT(worst, 1e-7);
  EXPECT_EQ(VoxelDistances::Build(sheet, field->grid(), 0, {}).status().code(),
            absl::StatusCode::kInvalidArgument);
}

}  // namespace
}  // namespace rilievo
