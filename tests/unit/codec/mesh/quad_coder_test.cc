#include "core/codec/mesh/quad_coder.h"

#include <cmath>

#include "core/codec/container/decode_region.h"
#include "core/codec/container/dss.h"
#include "core/codec/container/encode_deformed.h"
#include "core/codec/container/open_dss.h"
#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "tests/unit/codec/test_surfaces.h"

namespace rilievo {
namespace {

using ::testing::HasSubstr;

ControlMesh Creased(const ControlMesh& mesh) { return InQuadsOf(mesh, true); }

std::vector<uint8_t> Encoded(const DisplacedSurface& surface, int group_faces) {
  EncodeOptions options;
  options.position_step = 4e-4;
  options.height_step = 1e-4;
  options.group_faces = group_faces;
  const auto encoded = EncodeDss(surface, {}, options, RunContext());
  EXPECT_TRUE(encoded.ok()) << encoded.status();
  return encoded->Concatenate();
}

TEST(QuadCoderTest, QuadsComeBackInFewBytes) {
  for (const ControlMesh& mesh :
       {Creased(Torus(24, 16)), Creased(Sheet(16, 16, true)), InQuadsOf(Torus(24, 16), false)}) {
    const ControlMesh canonical = *PrepareControlMesh(mesh, 4e-4);
    ASSERT_EQ(canonical.diagonals.size(), mesh.diagonals.size());
    const auto topology =
        *BuildMeshTopology(canonical.faces, static_cast<int>(canonical.vertices.cols()));
    std::vector<GridPoint> points;
    for (const auto& point : canonical.vertices.colwise()) {
      points.push_back({static_cast<int>(std::lround(point[0] / 4e-4)),
                        static_cast<int>(std::lround(point[1] / 4e-4)),
                        static_cast<int>(std::lround(point[2] / 4e-4))});
    }
    const auto bytes = EncodeQuads(canonical, topology, points);
    ASSERT_TRUE(bytes.ok()) << bytes.status();
    EXPECT_LT(8 * bytes->size(), canonical.diagonals.size() / 2 + 64);
    ControlMesh decoded = canonical;
    decoded.diagonals.clear();
    ASSERT_TRUE(DecodeQuads(*bytes, topology, points, decoded).ok());
    EXPECT_EQ(decoded.diagonals, canonical.diagonals);

    ControlMesh fewer = canonical;
    fewer.diagonals.pop_back();
    EXPECT_THAT(std::string(EncodeQuads(fewer, topology, points).status().message()),
                HasSubstr("do not pair up"));
  }
}

TEST(QuadCoderTest, AFileSaysThatItsFacesAreHalvesOfQuads) {
  const DisplacedSurface surface = SurfaceOver(Creased(Torus(12, 8)), 3, 4e-4, 2e-4);
  ASSERT_TRUE(surface.control_mesh.quads());
  const std::vector<uint8_t> bytes = Encoded(surface, 0);
  EXPECT_EQ(bytes[8], 5);  // the version
  const auto decoded = DecodeDss(bytes, RunContext());
  ASSERT_TRUE(decoded.ok()) << decoded.status();
  EXPECT_EQ(decoded->surface.control_mesh.diagonals, surface.control_mesh.diagonals);
  EXPECT_EQ(decoded->surface.control_mesh.creases, surface.control_mesh.creases);
  // The bytes of such a file as if it were an older one.
  std::vector<uint8_t> older = bytes;
  older[8] = 4;
  EXPECT_FALSE(DecodeDss(older, RunContext()).ok());
  DisplacedSurface triangles = surface;
  triangles.control_mesh.diagonals.clear();
  EXPECT_EQ(Encoded(triangles, 0)[8], 3);
}

// A part has what its limit depends on: whole quads, and those that touch them.
TEST(QuadCoderTest, ARegionIsAsInTheWhole) {
  const ControlMesh mesh =
      Creased(Together(Torus(24, 16), Sheet(16, 16, true), Eigen::Vector3d(0.02, 0.05, 0.01)));
  const DisplacedSurface surface = SurfaceOver(mesh, 3, 4e-4, 2e-4);
  const std::vector<uint8_t> bytes = Encoded(surface, 128);
  const auto decoded = DecodeDss(bytes, RunContext());
  ASSERT_TRUE(decoded.ok()) << decoded.status();
  const auto whole = Tessellate(decoded->surface, 3, RunContext());
  ASSERT_TRUE(whole.ok());
  for (const std::vector<int>& faces : {std::vector<int>{17}, std::vector<int>{3, 500, 900}}) {
    const auto region = DecodeRegion(bytes, faces, 3, RunContext());
    ASSERT_TRUE(region.ok()) << region.status();
    ASSERT_GT(region->region.vertices.size(), 40u);
    EXPECT_LT(region->groups_read, region->groups);
    for (size_t i = 0; i < region->region.vertices.size(); ++i) {
      const auto column = static_cast<Eigen::Index>(i);
      const int v = region->region.vertices[i];
      EXPECT_LT((region->region.mesh.vertices.col(column) - whole->vertices.col(v)).norm(), 1e-8);
      EXPECT_LT((region->region.mesh.normals.col(column) - whole->normals.col(v)).norm(), 1e-9);
    }
  }
}

TEST(QuadCoderTest, QuadsStayWhereTheCageMoves) {
  const DisplacedSurface surface = SurfaceOver(Creased(Torus(12, 8)), 2, 4e-4, 2e-4);
  const std::vector<uint8_t> bytes = Encoded(surface, 0);
  ControlMesh cage = surface.control_mesh;
  cage.diagonals.clear();
  cage.vertices = (cage.vertices * surface.frame.diagonal).colwise() + surface.frame.center;
  cage.vertices.row(2) *= 1.5;
  const auto moved = ReplaceControlMesh(bytes, cage);
  ASSERT_TRUE(moved.ok()) << moved.status();
  const auto decoded = DecodeDss(*moved, RunContext());
  ASSERT_TRUE(decoded.ok()) << decoded.status();
  EXPECT_EQ(decoded->surface.control_mesh.diagonals, surface.control_mesh.diagonals);
  // A crease where a diagonal is: refused.
  cage.creases = {{surface.control_mesh.diagonals[3][0], surface.control_mesh.diagonals[3][1]}};
  EXPECT_FALSE(ReplaceControlMesh(bytes, cage).ok());
}

TEST(QuadCoderTest, EveryTruncationIsAnError) {
  const DisplacedSurface surface = SurfaceOver(Creased(Sheet(8, 8, false)), 1, 4e-4, 2e-4);
  const ControlMesh& mesh = surface.control_mesh;
  const auto topology = *BuildMeshTopology(mesh.faces, static_cast<int>(mesh.vertices.cols()));
  // Points that say nothing of the lengths, so that there is much to code.
  const std::vector<GridPoint> points(static_cast<size_t>(mesh.vertices.cols()),
                                      GridPoint{0, 0, 0});
  const auto bytes = EncodeQuads(mesh, topology, points);
  ASSERT_TRUE(bytes.ok()) << bytes.status();
  ControlMesh decoded = mesh;
  for (size_t size = 0; size + 4 < bytes->size(); ++size) {
    const auto status = DecodeQuads(std::span(*bytes).first(size), topology, points, decoded);
    EXPECT_TRUE(!status.ok() || decoded.diagonals != mesh.diagonals) << size;
  }
}

}  // namespace
}  // namespace rilievo
