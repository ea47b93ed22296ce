// Heights that ride along on another control mesh.
#include "core/codec/container/encode_deformed.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <limits>

#include "core/codec/container/decode_region.h"
#include "core/codec/container/dss.h"
#include "core/codec/container/open_dss.h"
#include "core/surface/displaced_surface.h"
#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "tests/unit/codec/test_surfaces.h"

namespace rilievo {
namespace {

using ::testing::HasSubstr;

const SpatialFrame kFrame{{5, -3, 2}, 4};

// Two of its edges and a corner are tagged.
ControlMesh Creased(ControlMesh mesh) {
  const int a = mesh.faces(0, 0), b = mesh.faces(1, 0), c = mesh.faces(2, 0);
  mesh.creases = {{std::min(a, b), std::max(a, b)}, {std::min(b, c), std::max(b, c), 1.5f}};
  std::sort(mesh.creases.begin(), mesh.creases.end(), [](const Crease& p, const Crease& q) {
    return std::pair(p.a, p.b) < std::pair(q.a, q.b);
  });
  mesh.corners = {c};
  return mesh;
}

std::vector<uint8_t> FileOf(const ControlMesh& mesh, int group_faces = 0) {
  EncodeOptions options;
  options.position_step = 1e-3;
  options.group_faces = group_faces;
  DisplacedSurface surface = SurfaceOver(mesh, 3, options.position_step, 1e-4);
  surface.frame = kFrame;
  DssMetadata metadata;
  metadata.generator = "test";
  metadata.error_rms = 1e-4;
  metadata.scan_points = 1234;
  return EncodeDss(surface, metadata, options, RunContext{})->Concatenate();
}

// The control mesh of a file, in the scan's coordinates.
ControlMesh CageOf(const std::vector<uint8_t>& file) {
  const DecodedSurface decoded = *DecodeDss(file, RunContext{});
  ControlMesh cage = decoded.surface.control_mesh;
  const SpatialFrame& frame = decoded.surface.frame;
  cage.vertices = (cage.vertices * frame.diagonal).colwise() + frame.center;
  return cage;
}

TriangleMesh FinestOf(const std::vector<uint8_t>& file) {
  const DisplacedSurface surface = DecodeDss(file, RunContext{})->surface;
  return *Tessellate(surface, surface.max_level, RunContext{});
}

TEST(EncodeDeformedTest, ACageThatDidNotChangeGivesTheSameBytes) {
  for (const ControlMesh& mesh : {Torus(12, 8), Sheet(7, 9, true), Creased(Torus(12, 8))}) {
    const std::vector<uint8_t> file = FileOf(mesh);
    ControlMesh cage = CageOf(file);
    EXPECT_EQ(*ReplaceControlMesh(file, cage), file);
    // Faces in another order, with another first corner.
    cage.faces = cage.faces.rowwise().reverse().eval();
    cage.faces.col(0) = Eigen::Vector3i(cage.faces(1, 0), cage.faces(2, 0), cage.faces(0, 0));
    EXPECT_EQ(*ReplaceControlMesh(file, cage), file);
  }
}

TEST(EncodeDeformedTest, ARigidMotionMovesTheSurface) {
  const std::vector<uint8_t> file = FileOf(Creased(Torus(12, 8)));
  ControlMesh cage = CageOf(file);
  const Eigen::Isometry3d motion = Eigen::Translation3d(100, 20, -7) *
                                   Eigen::AngleAxisd(1.1, Eigen::Vector3d(1, 2, 3).normalized());
  for (auto vertex : cage.vertices.colwise()) vertex = motion * Eigen::Vector3d(vertex);
  const std::vector<uint8_t> moved = *ReplaceControlMesh(file, cage);
  TriangleMesh expected = FinestOf(file);
  for (auto vertex : expected.vertices.colwise()) vertex = motion * Eigen::Vector3d(vertex);
  const TriangleMesh found = FinestOf(moved);
  EXPECT_EQ(found.triangles, expected.triangles);
  const double apart = (found.vertices - expected.vertices).colwise().norm().maxCoeff();
  EXPECT_LE(apart, 1e-7 * kFrame.diagonal);
  EXPECT_GT(apart, 0) << "its control points are rounded anew";
}

TEST(EncodeDeformedTest, HeightsKeepTheirBytesAndFiguresOfTheScanGo) {
  const std::vector<uint8_t> file = FileOf(Torus(12, 8));
  ControlMesh cage = CageOf(file);
  cage.vertices.row(2) *= 1.5;
  const std::vector<uint8_t> stretched = *ReplaceControlMesh(file, cage);
  const DecodedSurface before = *DecodeDss(file, RunContext{});
  const DecodedSurface after = *DecodeDss(stretched, RunContext{});
  EXPECT_EQ(after.surface.heights, before.surface.heights);
  EXPECT_EQ(after.surface.sources, before.surface.sources);
  const size_t control_before = static_cast<size_t>(before.chunk_bytes[0]);
  const size_t control_after = static_cast<size_t>(after.chunk_bytes[0]);
  EXPECT_TRUE(std::equal(file.begin() + static_cast<std::ptrdiff_t>(control_before), file.end(),
                         stretched.begin() + static_cast<std::ptrdiff_t>(control_after),
                         stretched.end()));
  EXPECT_EQ(after.metadata.generator, "test");
  EXPECT_EQ(after.metadata.error_rms, -1);
  EXPECT_EQ(after.metadata.scan_points, 0);
  // Of a file that is still on its way too.
  const std::span<const uint8_t> start(file.data(),
                                       control_before + static_cast<size_t>(before.chunk_bytes[1]));
  EXPECT_EQ(DecodeDss(*ReplaceControlMesh(start, cage), RunContext{})->surface.max_level, 0);
}

TEST(EncodeDeformedTest, TagsAreThoseOfTheCage) {
  const std::vector<uint8_t> file = FileOf(Torus(12, 8));
  ControlMesh cage = CageOf(file);
  const int a = cage.faces(0, 0), b = cage.faces(1, 0), c = cage.faces(2, 0);
  cage.creases = {{std::max(a, b), std::min(a, b), 2.5f}};
  cage.corners = {c};
  const ControlMesh tagged =
      DecodeDss(*ReplaceControlMesh(file, cage), RunContext{})->surface.control_mesh;
  ASSERT_EQ(tagged.creases.size(), 1u);
  EXPECT_EQ(tagged.creases[0], (Crease{std::min(a, b), std::max(a, b), 2.5f}));
  EXPECT_EQ(tagged.corners, std::vector<int>{c});
  EXPECT_EQ(tagged.vertices, DecodeDss(file, RunContext{})->surface.control_mesh.vertices);
}

TEST(EncodeDeformedTest, RefusesWhatIsAnotherMesh) {
  const std::vector<uint8_t> file = FileOf(Torus(12, 8));
  const ControlMesh cage = CageOf(file);
  ControlMesh fewer = cage;
  fewer.faces.conservativeResize(3, fewer.faces.cols() - 1);
  EXPECT_THAT(ReplaceControlMesh(file, fewer).status().message(), HasSubstr("may come or go"));
  ControlMesh turned = cage;
  turned.faces.col(3).reverseInPlace();
  EXPECT_THAT(ReplaceControlMesh(file, turned).status().message(), HasSubstr("is not a face"));
  ControlMesh open = cage;
  open.vertices(1, 4) = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THAT(ReplaceControlMesh(file, open).status().message(), HasSubstr("not finite"));
  ControlMesh tagged = cage;
  tagged.corners = {static_cast<int>(cage.vertices.cols())};
  EXPECT_TRUE(absl::IsInvalidArgument(ReplaceControlMesh(file, tagged).status()));
}

// Groups follow from the control points of a file that does not tell them.
TEST(EncodeDeformedTest, HeightsInGroupsKeepTheirGroups) {
  for (const ControlMesh& mesh : {Torus(64, 8), Creased(Torus(64, 8))}) {
    const std::vector<uint8_t> file = FileOf(mesh, kLeastGroupLimit);
    ControlMesh cage = CageOf(file);
    EXPECT_EQ(*ReplaceControlMesh(file, cage), file);
    const OpenedDss before = *OpenDss(file, true);
    ASSERT_EQ(before.groups.count(), 8);
    cage.vertices.row(2) *= 9;
    for (auto vertex : cage.vertices.colwise()) {
      vertex = Eigen::AngleAxisd(vertex.z() / kFrame.diagonal, Eigen::Vector3d::UnitX()) *
               Eigen::Vector3d(vertex);
    }
    const std::vector<uint8_t> bent = *ReplaceControlMesh(file, cage);
    const OpenedDss after = *OpenDss(bent, true);
    EXPECT_EQ(after.version, 4);
    EXPECT_EQ(after.groups.members, before.groups.members);
    EXPECT_LE(after.chunk_bytes[0], 9 * cage.vertices.cols());
    const DisplacedSurface own = DecodeDss(file, RunContext{})->surface;
    const DisplacedSurface moved = DecodeDss(bent, RunContext{})->surface;
    EXPECT_EQ(moved.heights, own.heights);
    EXPECT_EQ(moved.sources, own.sources);
    const std::vector<int> faces = {3, 4};
    const DecodedRegion region = *DecodeRegion(bent, faces, kFinestLevel, RunContext{});
    EXPECT_LT(region.groups_read, 8);
    const TriangleMesh whole = *Tessellate(moved, moved.max_level, RunContext{});
    for (size_t i = 0; i < region.region.vertices.size(); ++i) {
      EXPECT_EQ(region.region.mesh.vertices.col(static_cast<Eigen::Index>(i)),
                whole.vertices.col(region.region.vertices[i]));
    }
    // Moved again, and only so far that the halves stay what they are.
    const std::vector<uint8_t> again = *ReplaceControlMesh(bent, CageOf(file));
    EXPECT_EQ(OpenDss(again, true)->version, 3);
    EXPECT_EQ(DecodeDss(again, RunContext{})->surface.heights, own.heights);
  }
}

}  // namespace
}  // namespace rilievo
