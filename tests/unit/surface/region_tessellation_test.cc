#include "core/surface/region_tessellation.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "core/loop/refinement.h"
#include "tests/unit/loop/crease_meshes.h"
#include "tests/unit/loop/loop_meshes.h"

namespace rilievo {
namespace {

DisplacedSurface Rough(const ControlMesh& mesh, int level) {
  DisplacedSurface surface;
  surface.control_mesh = mesh;
  surface.frame = {.center = {100, -20, 3}, .diagonal = 7};
  surface.max_level = level;
  const auto refinement = RefineTopology(mesh, level, RunContext());
  uint32_t random = 5;
  for (int v = 0; v < refinement->levels.back().vertex_count; ++v) {
    random = random * 1664525u + 1013904223u;
    surface.heights.push_back(1e-3f * static_cast<float>(random) * 0x1p-32f);
    surface.sources.push_back(HeightSource::kMeasured);
  }
  return surface;
}

class TessellateRegionTest : public ::testing::TestWithParam<testing::NamedMesh> {};

TEST_P(TessellateRegionTest, IsThatPartOfTheWholeBitForBit) {
  const DisplacedSurface surface = Rough(GetParam().mesh, 4);
  const int faces = static_cast<int>(surface.control_mesh.faces.cols());
  for (int level = 0; level <= 4; ++level) {
    const TriangleMesh whole = *Tessellate(surface, level, RunContext());
    for (int stride : {1, 2, 7}) {
      std::vector<int> wanted;
      for (int f = 0; f < faces; f += stride) wanted.push_back(f);
      const auto region = TessellateRegion(surface, wanted, level, RunContext());
      ASSERT_TRUE(region.ok()) << region.status();
      EXPECT_TRUE(std::is_sorted(region->vertices.begin(), region->vertices.end()));
      const Eigen::Index per_face = whole.triangles.cols() / faces;
      ASSERT_EQ(region->mesh.triangles.cols(), per_face * static_cast<Eigen::Index>(wanted.size()));
      for (Eigen::Index t = 0; t < region->mesh.triangles.cols(); ++t) {
        const int face = wanted[static_cast<size_t>(t / per_face)];
        for (int k = 0; k < 3; ++k) {
          ASSERT_EQ(region->vertices[static_cast<size_t>(region->mesh.triangles(k, t))],
                    whole.triangles(k, face * per_face + t % per_face));
        }
      }
      for (size_t v = 0; v < region->vertices.size(); ++v) {
        const auto i = static_cast<Eigen::Index>(v);
        ASSERT_EQ(region->mesh.vertices.col(i), whole.vertices.col(region->vertices[v])) << level;
        ASSERT_EQ(region->mesh.normals.col(i), whole.normals.col(region->vertices[v])) << level;
      }
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Smooth, TessellateRegionTest, ::testing::ValuesIn(testing::LoopMeshes()),
                         [](const auto& instance) { return instance.param.name; });
INSTANTIATE_TEST_SUITE_P(Creased, TessellateRegionTest,
                         ::testing::ValuesIn(testing::CreaseMeshes()),
                         [](const auto& instance) { return instance.param.name; });

TEST(TessellateRegionTest, NothingWantedIsNothingGiven) {
  const auto region = TessellateRegion(Rough(testing::Icosahedron(), 2), {}, 2, RunContext());
  ASSERT_TRUE(region.ok()) << region.status();
  EXPECT_EQ(region->mesh.triangles.cols(), 0);
}

TEST(TessellateRegionTest, OtherFacesAndLevelsAreRefused) {
  const DisplacedSurface surface = Rough(testing::Icosahedron(), 2);
  for (const std::vector<int>& faces : std::vector<std::vector<int>>{{-1}, {20}, {3, 3}, {4, 2}}) {
    EXPECT_EQ(TessellateRegion(surface, faces, 2, RunContext()).status().code(),
              absl::StatusCode::kInvalidArgument);
  }
  EXPECT_EQ(TessellateRegion(surface, std::vector<int>{1}, 3, RunContext()).status().code(),
            absl::StatusCode::kInvalidArgument);
}

}  // namespace
}  // namespace rilievo
