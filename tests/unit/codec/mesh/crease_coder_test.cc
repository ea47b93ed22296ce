#include "core/codec/mesh/crease_coder.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/codec/bytes/range_coder.h"
#include "core/codec/container/dss.h"
#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "tests/unit/codec/test_surfaces.h"

namespace rilievo {
namespace {

using ::testing::HasSubstr;

// A box of n x n x n squares, each cut in two, its twelve edges tagged and its eight corners.
ControlMesh CreasedBox(int n, float sharpness) {
  const auto index = [n](int i, int j, int k) { return (i * (n + 1) + j) * (n + 1) + k; };
  std::vector<int> number((n + 1) * (n + 1) * (n + 1), -1);
  std::vector<Eigen::Vector3d> points;
  const auto on_sides = [n](int i, int j, int k) {
    return (i % n == 0) + (j % n == 0) + (k % n == 0);
  };
  for (int i = 0; i <= n; ++i) {
    for (int j = 0; j <= n; ++j) {
      for (int k = 0; k <= n; ++k) {
        if (on_sides(i, j, k) == 0) continue;
        number[index(i, j, k)] = static_cast<int>(points.size());
        points.push_back(Eigen::Vector3d(i, j, k) / (2.0 * n));
      }
    }
  }
  std::vector<Eigen::Vector3i> faces;
  for (int axis = 0; axis < 3; ++axis) {
    for (int side = 0; side < 2; ++side) {
      for (int p = 0; p < n; ++p) {
        for (int q = 0; q < n; ++q) {
          const auto at = [&](int dp, int dq) {
            int c[3];
            c[axis] = side * n;
            c[(axis + 1) % 3] = p + dp;
            c[(axis + 2) % 3] = q + dq;
            return number[index(c[0], c[1], c[2])];
          };
          const int a = at(0, 0), b = at(1, 0), c = at(1, 1), d = at(0, 1);
          if (side == 1) {
            faces.push_back({a, b, c});
            faces.push_back({a, c, d});
          } else {
            faces.push_back({a, c, b});
            faces.push_back({a, d, c});
          }
        }
      }
    }
  }
  ControlMesh mesh;
  mesh.vertices.resize(3, static_cast<Eigen::Index>(points.size()));
  mesh.faces.resize(3, static_cast<Eigen::Index>(faces.size()));
  for (size_t v = 0; v < points.size(); ++v) {
    mesh.vertices.col(static_cast<Eigen::Index>(v)) = points[v];
  }
  for (size_t f = 0; f < faces.size(); ++f) mesh.faces.col(static_cast<Eigen::Index>(f)) = faces[f];
  const MeshTopology topology = *BuildMeshTopology(mesh.faces, static_cast<int>(points.size()));
  const auto sides = [&](int v) {
    const Eigen::Vector3d p = mesh.vertices.col(v);
    int count = 0;
    for (int axis = 0; axis < 3; ++axis) count += p[axis] == 0 || p[axis] == 0.5;
    return count;
  };
  for (int e = 0; e < topology.edge_count(); ++e) {
    const int a = topology.edge_vertices(0, e), b = topology.edge_vertices(1, e);
    const Eigen::Vector3d middle = (mesh.vertices.col(a) + mesh.vertices.col(b)) / 2;
    int count = 0;
    for (int axis = 0; axis < 3; ++axis) count += middle[axis] == 0 || middle[axis] == 0.5;
    if (count >= 2) mesh.creases.push_back({a, b, sharpness});
  }
  std::sort(mesh.creases.begin(), mesh.creases.end(), [](const Crease& p, const Crease& q) {
    return std::pair(p.a, p.b) < std::pair(q.a, q.b);
  });
  for (int v = 0; v < static_cast<int>(points.size()); ++v) {
    if (sides(v) == 3) mesh.corners.push_back(v);
  }
  return mesh;
}

struct Prepared {
  ControlMesh mesh;
  MeshTopology topology;
  std::vector<GridPoint> points;
};

Prepared Prepare(const ControlMesh& mesh) {
  const double step = 1.0 / 1024;
  Prepared prepared;
  prepared.mesh = *PrepareControlMesh(mesh, step);
  const int count = static_cast<int>(prepared.mesh.vertices.cols());
  prepared.topology = *BuildMeshTopology(prepared.mesh.faces, count);
  for (int v = 0; v < count; ++v) {
    GridPoint point;
    for (int axis = 0; axis < 3; ++axis) {
      point[axis] = static_cast<int32_t>(std::lround(prepared.mesh.vertices(axis, v) / step));
    }
    prepared.points.push_back(point);
  }
  return prepared;
}

TEST(CreaseCoderTest, RoundTrips) {
  for (float sharpness : {0.01f, 1.0f, 2.5f, 9.9375f, std::numeric_limits<float>::infinity()}) {
    const Prepared box = Prepare(CreasedBox(4, sharpness));
    ASSERT_EQ(box.mesh.creases.size(), 48u);
    ASSERT_EQ(box.mesh.corners.size(), 8u);
    EXPECT_EQ(box.mesh.creases[0].sharpness, StoredSharpness(sharpness));
    const auto bytes = EncodeCreases(box.mesh, box.topology, box.points);
    ASSERT_TRUE(bytes.ok()) << bytes.status();
    ControlMesh read = box.mesh;
    read.creases.clear();
    read.corners = {1};
    ASSERT_TRUE(DecodeCreases(*bytes, box.topology, box.points, read).ok());
    EXPECT_EQ(read.creases, box.mesh.creases);
    EXPECT_EQ(read.corners, box.mesh.corners);
  }
}

TEST(CreaseCoderTest, EverySharpnessOfItsOwn) {
  Prepared box = Prepare(CreasedBox(4, 1));
  for (size_t i = 0; i < box.mesh.creases.size(); ++i) {
    box.mesh.creases[i].sharpness = static_cast<float>(1 + (37 * i) % 160) / 16;
  }
  box.mesh.corners.clear();
  const auto bytes = EncodeCreases(box.mesh, box.topology, box.points);
  ASSERT_TRUE(bytes.ok()) << bytes.status();
  ControlMesh read;
  ASSERT_TRUE(DecodeCreases(*bytes, box.topology, box.points, read).ok());
  EXPECT_EQ(read.creases, box.mesh.creases);
  EXPECT_TRUE(read.corners.empty());
}

// Where the faces fold by a right angle and nowhere else: after a few the rest are foreseen.
TEST(CreaseCoderTest, FoldsForetellCreases) {
  const Prepared box = Prepare(CreasedBox(16, kInfiniteSharpness));
  const auto bytes = EncodeCreases(box.mesh, box.topology, box.points);
  ASSERT_TRUE(bytes.ok());
  EXPECT_EQ(box.mesh.creases.size(), 192u);
  EXPECT_EQ(box.topology.edge_count(), 4608);
  EXPECT_LT(8.0 * bytes->size() / box.mesh.creases.size(), 2.0);
}

TEST(CreaseCoderTest, NamesWhatIsWrong) {
  const Prepared box = Prepare(CreasedBox(2, 1));
  const auto message = [&](auto change) {
    ControlMesh mesh = box.mesh;
    change(mesh);
    const absl::Status status = EncodeCreases(mesh, box.topology, box.points).status();
    EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
    return std::string(status.message());
  };
  EXPECT_THAT(message([](ControlMesh& m) { m.creases[3].sharpness = 1.01f; }),
              HasSubstr("crease 3 has sharpness 1.01"));
  EXPECT_THAT(message([](ControlMesh& m) { m.creases[3].sharpness = 0; }), HasSubstr("crease 3"));
  EXPECT_THAT(message([](ControlMesh& m) { m.creases[2] = m.creases[1]; }), HasSubstr("crease 2"));
  EXPECT_THAT(message([](ControlMesh& m) { m.creases[0].b = m.creases[0].a; }),
              HasSubstr("crease 0"));
  EXPECT_THAT(message([](ControlMesh& m) { m.corners = {3, 3}; }), HasSubstr("corner 3"));
  EXPECT_THAT(message([](ControlMesh& m) { m.corners = {1000}; }), HasSubstr("corner 1000"));
}

TEST(CreaseCoderTest, CutBytesAreDataLoss) {
  const Prepared box = Prepare(CreasedBox(4, 2.5f));
  const std::vector<uint8_t> bytes = *EncodeCreases(box.mesh, box.topology, box.points);
  for (size_t size = 0; size + RangeEncoder::kMaxLeftOff + 2 < bytes.size(); ++size) {
    ControlMesh read;
    EXPECT_EQ(DecodeCreases(std::span(bytes).first(size), box.topology, box.points, read).code(),
              absl::StatusCode::kDataLoss)
        << size;
  }
}

TEST(CreaseCoderTest, TagsTravelInTheStream) {
  const ControlMesh box = CreasedBox(3, 1.5f);
  const DisplacedSurface surface = SurfaceOver(box, 2, kPositionStep, 0);
  const auto encoded = EncodeDss(surface, {}, {}, RunContext());
  ASSERT_TRUE(encoded.ok()) << encoded.status();
  const auto decoded = DecodeDss(encoded->Concatenate(), RunContext());
  ASSERT_TRUE(decoded.ok()) << decoded.status();
  EXPECT_EQ(decoded->surface.control_mesh.creases, surface.control_mesh.creases);
  EXPECT_EQ(decoded->surface.control_mesh.corners, surface.control_mesh.corners);
  EXPECT_EQ(decoded->surface.control_mesh.creases.size(), 36u);
  EXPECT_EQ(decoded->surface.control_mesh.corners.size(), 8u);
}

}  // namespace
}  // namespace rilievo
