#include "core/codec/mesh/border_coder.h"

#include <algorithm>
#include <cmath>

#include "core/codec/container/dss.h"
#include "core/codec/container/encode_deformed.h"
#include "gtest/gtest.h"
#include "tests/unit/codec/test_surfaces.h"

namespace rilievo {
namespace {

constexpr int kDigits = 8;
constexpr double kStep = 0x1p-11;

std::vector<uint8_t> EncodedWith(const DisplacedSurface& surface, int digits) {
  EncodeOptions options;
  options.position_step = kStep;
  options.border_digits = digits;
  options.height_step = 1e-4;
  const auto encoded = EncodeDss(surface, {}, options, RunContext());
  EXPECT_TRUE(encoded.ok()) << encoded.status();
  return encoded->Concatenate();
}

DisplacedSurface WithBorder(int digits) {
  const ControlMesh mesh = Sheet(12, 12, true);
  DisplacedSurface surface = SurfaceOver(mesh, 2, kStep, 2e-4);
  surface.control_mesh = *PrepareControlMesh(mesh, kStep, digits);
  return surface;
}

std::vector<uint8_t> OnBoundary(const ControlMesh& mesh) {
  return BuildMeshTopology(mesh.faces, static_cast<int>(mesh.vertices.cols()))->boundary_vertex;
}

bool IsMultiple(const Eigen::Vector3d& point, double step) {
  return (point.array() / step).round().matrix() * step == point;
}

TEST(BorderCoderTest, AFileKeepsTheDigitsOfItsBorderAlone) {
  const DisplacedSurface surface = WithBorder(kDigits);
  const std::vector<uint8_t> bytes = EncodedWith(surface, kDigits);
  EXPECT_EQ(bytes[8], 6);  // the version
  const auto decoded = DecodeDss(bytes, RunContext());
  ASSERT_TRUE(decoded.ok()) << decoded.status();
  const ControlMesh& mesh = decoded->surface.control_mesh;
  EXPECT_EQ(mesh.vertices, surface.control_mesh.vertices);
  const std::vector<uint8_t> on_boundary = OnBoundary(mesh);
  int fine = 0, border = 0;
  for (Eigen::Index v = 0; v < mesh.vertices.cols(); ++v) {
    const Eigen::Vector3d point = mesh.vertices.col(v);
    EXPECT_TRUE(IsMultiple(point, on_boundary[v] != 0 ? BorderStep(kStep, kDigits) : kStep));
    fine += IsMultiple(point, kStep) ? 0 : 1;
    border += on_boundary[v];
  }
  EXPECT_GT(fine, border / 2);
  // Three times eight bits for each point of the border.
  const size_t coarse = EncodedWith(WithBorder(0), 0).size();
  EXPECT_LE(bytes.size(), coarse + static_cast<size_t>(3 * kDigits * border / 8) + 8);
  // The bytes of such a file as if it were an older one.
  std::vector<uint8_t> older = bytes;
  older[8] = 5;
  EXPECT_FALSE(DecodeDss(older, RunContext()).ok());
}

TEST(BorderCoderTest, FinerPointsOfTheBorderNeedTheirDigits) {
  EncodeOptions options;
  options.position_step = kStep;
  options.border_digits = kDigits - 1;
  EXPECT_TRUE(
      absl::IsInvalidArgument(EncodeDss(WithBorder(kDigits), {}, options, RunContext()).status()));
  options.border_digits = kMostBorderDigits + 1;
  EXPECT_TRUE(absl::IsInvalidArgument(options.Validate()));
}

TEST(BorderCoderTest, DigitsStayWhileTheCageIsOnTheGrid) {
  const DisplacedSurface surface = WithBorder(kDigits);
  const std::vector<uint8_t> bytes = EncodedWith(surface, kDigits);
  ControlMesh cage = surface.control_mesh;
  const auto in_scan_frame = [&] {
    ControlMesh scan = cage;
    scan.vertices = (cage.vertices * surface.frame.diagonal).colwise() + surface.frame.center;
    return scan;
  };
  EXPECT_EQ(*ReplaceControlMesh(bytes, in_scan_frame()), bytes);
  const std::vector<uint8_t> on_boundary = OnBoundary(cage);
  cage.vertices(2, std::find(on_boundary.begin(), on_boundary.end(), 1) - on_boundary.begin()) +=
      BorderStep(kStep, kDigits);
  const auto moved = ReplaceControlMesh(bytes, in_scan_frame());
  ASSERT_TRUE(moved.ok()) << moved.status();
  EXPECT_EQ(moved->size(), bytes.size());
  const auto decoded = DecodeDss(*moved, RunContext());
  ASSERT_TRUE(decoded.ok()) << decoded.status();
  EXPECT_EQ(decoded->surface.control_mesh.vertices, cage.vertices);
  // Elsewhere all points get a grid that is fine enough.
  cage.vertices.row(0) *= 1.01;
  EXPECT_EQ(ReplaceControlMesh(bytes, in_scan_frame())->at(8), 3);
}

TEST(BorderCoderTest, EveryTruncationIsAnError) {
  const ControlMesh mesh = Sheet(8, 8, false);
  const auto topology = *BuildMeshTopology(mesh.faces, static_cast<int>(mesh.vertices.cols()));
  std::vector<GridPoint> past(mesh.vertices.cols());
  for (size_t v = 0; v < past.size(); ++v) {
    for (int axis = 0; axis < 3; ++axis) {
      past[v][axis] = static_cast<int>(MixedBits(3 * v + axis) % 256) - 128;
    }
  }
  const std::vector<uint8_t> bytes = EncodeBorderDigits(past, topology, kDigits);
  for (size_t size = 0; size <= bytes.size(); ++size) {
    ControlMesh decoded = mesh;
    decoded.vertices.setZero();
    const auto status = DecodeBorderDigits(std::span(bytes).first(size), topology,
                                           std::ldexp(1.0, kDigits), kDigits, decoded);
    bool same = status.ok();
    for (Eigen::Index v = 0; same && v < decoded.vertices.cols(); ++v) {
      const Eigen::Vector3d given(past[v][0], past[v][1], past[v][2]);
      same = decoded.vertices.col(v) ==
             (topology.boundary_vertex[v] != 0 ? given : Eigen::Vector3d::Zero().eval());
    }
    EXPECT_EQ(same, size == bytes.size()) << size;
  }
}

}  // namespace
}  // namespace rilievo
