#include "core/control/creases/close_crease_gaps.h"

#include <gtest/gtest.h>

#include <cmath>
#include <set>
#include <vector>

namespace rilievo {
namespace {

constexpr int kLong = 12, kWide = 4;

// A roof whose ridge runs along x from (0, 0, 0) to (12, 0, 0), with sides that fall by `slope`.
// Vertex of place i, row j: i * (2 * kWide + 1) + j + kWide.
ControlMesh Roof(double slope) {
  constexpr int kRows = 2 * kWide + 1;
  ControlMesh mesh;
  mesh.vertices.resize(3, (kLong + 1) * kRows);
  mesh.faces.resize(3, 2 * kLong * (kRows - 1));
  int face = 0;
  for (int i = 0; i <= kLong; ++i) {
    for (int j = -kWide; j <= kWide; ++j) {
      const int v = i * kRows + j + kWide;
      mesh.vertices.col(v) << i, j, -slope * std::abs(j);
      if (i == kLong || j == kWide) continue;
      mesh.faces.col(face++) << v, v + kRows, v + kRows + 1;
      mesh.faces.col(face++) << v, v + kRows + 1, v + 1;
    }
  }
  return mesh;
}

int OnRidge(int place) { return place * (2 * kWide + 1) + kWide; }

// The roof with those edges of the ridge tagged that begin at `places`.
struct Ridge {
  ControlMesh mesh;
  MeshTopology topology;
  std::vector<uint8_t> tags;

  Ridge(double slope, const std::set<int>& places) : mesh(Roof(slope)) {
    auto built = BuildMeshTopology(mesh.faces, static_cast<int>(mesh.vertices.cols()));
    EXPECT_TRUE(built.ok());
    topology = *built;
    tags.resize(static_cast<size_t>(topology.edge_count()));
    for (int e = 0; e < topology.edge_count(); ++e) tags[e] = places.count(PlaceOf(e)) > 0;
  }

  // Where an edge of the ridge begins; -1: it lies elsewhere.
  int PlaceOf(int edge) const {
    const int a = topology.edge_vertices(0, edge), b = topology.edge_vertices(1, edge);
    for (int place = 0; place < kLong; ++place) {
      if (a == OnRidge(place) && b == OnRidge(place + 1)) return place;
    }
    return -1;
  }

  // The places of all tagged edges.
  std::set<int> Tagged() const {
    std::set<int> places;
    for (int e = 0; e < topology.edge_count(); ++e) {
      if (tags[e]) places.insert(PlaceOf(e));
    }
    return places;
  }
};

TEST(CloseCreaseGapsTest, ThreeEdgesAreAGapAndFourAreNot) {
  for (const int gap : {1, 2, 3, 4}) {
    std::set<int> given, whole;
    for (int place = 0; place < kLong; ++place) {
      whole.insert(place);
      if (place < 4 || place >= 4 + gap) given.insert(place);
    }
    Ridge ridge(1, given);
    CloseCreaseGaps(ridge.mesh, ridge.topology, &ridge.tags);
    EXPECT_EQ(ridge.Tagged(), gap < 4 ? whole : given) << gap;
  }
}

TEST(CloseCreaseGapsTest, FacesThatMeetFlatterThanFortyDegreesHaveNoEdge) {
  Ridge ridge(std::tan(19 * M_PI / 180), {0, 1, 2, 3, 5, 6, 7, 8, 9, 10, 11});
  const std::set<int> given = ridge.Tagged();
  CloseCreaseGaps(ridge.mesh, ridge.topology, &ridge.tags);
  EXPECT_EQ(ridge.Tagged(), given);
}

TEST(CloseCreaseGapsTest, ACreaseThatEndsFreelyGoesNowhere) {
  Ridge ridge(1, {0, 1, 2, 3});
  const std::set<int> given = ridge.Tagged();
  CloseCreaseGaps(ridge.mesh, ridge.topology, &ridge.tags);
  EXPECT_EQ(ridge.Tagged(), given);
}

// The vertex across the gap lies aside: the way turns by more than 60 degrees there and back.
TEST(CloseCreaseGapsTest, NoWayTurnsBySixtyDegrees) {
  Ridge ridge(1, {0, 1, 2, 3, 6, 7, 8, 9, 10, 11});
  const std::set<int> given = ridge.Tagged();
  ridge.mesh.vertices.col(OnRidge(5)) += Eigen::Vector3d(0, 1.9, 1.9);
  CloseCreaseGaps(ridge.mesh, ridge.topology, &ridge.tags);
  EXPECT_EQ(ridge.Tagged(), given);
}

}  // namespace
}  // namespace rilievo
