#include "core/control/simplify/crease_constraints.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <utility>
#include <vector>

#include "core/control/simplify/relax_mesh.h"
#include "core/control/simplify/simplify_mesh.h"
#include "core/loop/crease_topology.h"
#include "tests/unit/control/control_test_meshes.h"

namespace rilievo {
namespace {

using Eigen::Vector3d;

constexpr int kAround = 48, kRows = 12, kRings = 8;

// A prism over the outline r(angle), z in [-1, 1]: kAround vertices around, the rims untagged.
// Vertex of row j, place i: j * kAround + i.
ControlMesh Prism(const std::function<double(double)>& outline) {
  std::vector<Vector3d> vertices;
  const auto add_ring = [&](double share, double z) {
    for (int i = 0; i < kAround; ++i) {
      const double angle = 2 * std::numbers::pi * i / kAround;
      const double r = share * outline(angle);
      vertices.emplace_back(r * std::cos(angle), r * std::sin(angle), z);
    }
  };
  for (int j = 0; j <= kRows; ++j) add_ring(1, 2.0 * j / kRows - 1);
  std::vector<Eigen::Vector3i> faces;
  const auto join = [&](int lower, int upper) {  // first vertices of two rings
    for (int i = 0; i < kAround; ++i) {
      const int next = (i + 1) % kAround;
      faces.emplace_back(lower + i, lower + next, upper + next);
      faces.emplace_back(lower + i, upper + next, upper + i);
    }
  };
  for (int j = 0; j < kRows; ++j) join(j * kAround, (j + 1) * kAround);
  for (const int z : {-1, 1}) {
    int outer = z < 0 ? 0 : kRows * kAround;
    for (int k = kRings - 1; k > 0; --k) {
      const int inner = static_cast<int>(vertices.size());
      add_ring(static_cast<double>(k) / kRings, z);
      z < 0 ? join(inner, outer) : join(outer, inner);
      outer = inner;
    }
    const int middle = static_cast<int>(vertices.size());
    vertices.emplace_back(0, 0, z);
    for (int i = 0; i < kAround; ++i) {
      const int a = outer + i, b = outer + (i + 1) % kAround;
      faces.emplace_back(middle, z < 0 ? b : a, z < 0 ? a : b);
    }
  }
  ControlMesh mesh;
  mesh.vertices.resize(3, static_cast<Eigen::Index>(vertices.size()));
  mesh.faces.resize(3, static_cast<Eigen::Index>(faces.size()));
  for (size_t v = 0; v < vertices.size(); ++v) mesh.vertices.col(v) = vertices[v];
  for (size_t f = 0; f < faces.size(); ++f) mesh.faces.col(f) = faces[f];
  return mesh;
}

double Round(double) { return 1; }
// A square with corners at 45 degrees and so on, half a side long 1.
double SquareAt(double angle) {
  return 1 / std::max(std::abs(std::cos(angle)), std::abs(std::sin(angle)));
}

void TagRim(int row, int begin, int end, ControlMesh* mesh) {
  for (int i = begin; i < end; ++i) {
    const int a = row * kAround + i, b = row * kAround + (i + 1) % kAround;
    mesh->creases.push_back({std::min(a, b), std::max(a, b)});
  }
}

void SortTags(ControlMesh* mesh) {
  std::sort(mesh->creases.begin(), mesh->creases.end(), [](const Crease& p, const Crease& q) {
    return std::pair(p.a, p.b) < std::pair(q.a, q.b);
  });
}

// All twelve edges tagged, the rims' corners too.
ControlMesh Box() {
  ControlMesh box = Prism(SquareAt);
  for (const int row : {0, kRows}) {
    TagRim(row, 0, kAround, &box);
    for (int k = 0; k < 4; ++k) box.corners.push_back(row * kAround + kAround / 8 * (2 * k + 1));
  }
  for (int j = 0; j < kRows; ++j) {
    for (int k = 0; k < 4; ++k) {
      const int a = j * kAround + kAround / 8 * (2 * k + 1);
      box.creases.push_back({a, a + kAround});
    }
  }
  SortTags(&box);
  return box;
}

ControlMesh Simplified(const ControlMesh& mesh, int faces) {
  const SimplifyOptions options{.target_faces = faces, .evenness = 1e-4};
  return SimplifyMesh(mesh, options, RunContext{}).value();
}

CreaseTopology TagsOf(const ControlMesh& mesh) {
  const auto topology =
      BuildMeshTopology(mesh.faces, static_cast<int>(mesh.vertices.cols())).value();
  return BuildCreaseTopology(mesh, topology).value();
}

std::vector<CreaseChain> ChainsOf(const ControlMesh& mesh) {
  const auto topology =
      BuildMeshTopology(mesh.faces, static_cast<int>(mesh.vertices.cols())).value();
  return CreaseChains(topology, BuildCreaseTopology(mesh, topology).value());
}

double LengthOfCreases(const ControlMesh& mesh) {
  double length = 0;
  for (const Crease& crease : mesh.creases) {
    length += (mesh.vertices.col(crease.a) - mesh.vertices.col(crease.b)).norm();
  }
  return length;
}

// How far a place is off the nearest edge of the box.
double OffEdges(const Vector3d& place) {
  Vector3d off = (place.cwiseAbs() - Vector3d::Ones()).cwiseAbs();
  std::sort(off.data(), off.data() + 3);
  return off[1];
}

void ExpectBoxEdges(const ControlMesh& mesh, double tolerance) {
  ASSERT_EQ(mesh.corners.size(), 8u);
  for (const int corner : mesh.corners) {
    EXPECT_LT((mesh.vertices.col(corner).cwiseAbs() - Vector3d::Ones()).norm(), 1e-12);
  }
  for (const Crease& crease : mesh.creases) {
    EXPECT_LT(OffEdges(mesh.vertices.col(crease.a)), tolerance);
    EXPECT_LT(OffEdges(mesh.vertices.col(crease.b)), tolerance);
  }
  // Every edge of the box has its crease, none is doubled.
  EXPECT_NEAR(LengthOfCreases(mesh), 24, 12 * tolerance);
  EXPECT_EQ(ChainsOf(mesh).size(), 12u);
}

TEST(CreaseConstraintsTest, ABoxKeepsItsEdgesAndCorners) {
  const ControlMesh box = Box();
  for (const int faces : {300, 60}) {
    const ControlMesh result = Simplified(box, faces);
    EXPECT_LE(result.faces.cols(), faces);
    EXPECT_EQ(Summary(result).genus, 0);
    EXPECT_LT(result.creases.size(), box.creases.size() / 2);
    ExpectBoxEdges(result, 1e-3);
  }
}

TEST(CreaseConstraintsTest, FlipsAndRelaxationLeaveThemWhereTheyAre) {
  ControlMesh mesh = Simplified(Box(), 200);
  for (int round = 0; round < 3; ++round) {
    ImproveValence(&mesh, 100);  // no bend holds an edge back
    RelaxTangentially(&mesh, 5);
  }
  ExpectBoxEdges(mesh, 1e-3);  // throws where a crease is not an edge any more
}

// The limit of a crease of fewer edges would not be a circle any more.
TEST(CreaseConstraintsTest, ARoundRimKeepsSixEdges) {
  ControlMesh drum = Prism(Round);
  TagRim(0, 0, kAround, &drum);
  TagRim(kRows, 0, kAround, &drum);
  SortTags(&drum);
  const ControlMesh result = Simplified(drum, 20);
  const auto chains = ChainsOf(result);
  ASSERT_EQ(chains.size(), 2u);
  for (const CreaseChain& chain : chains) {
    EXPECT_TRUE(chain.closed);
    EXPECT_GE(chain.edges.size(), 6u);
    EXPECT_LE(chain.edges.size(), 9u);
    for (const int v : chain.vertices) {
      EXPECT_NEAR(std::abs(result.vertices(2, v)), 1, 1e-3);
      EXPECT_NEAR(result.vertices.col(v).head<2>().norm(), 1, 0.06);
    }
  }
}

TEST(CreaseConstraintsTest, ACreaseThatEndsKeepsItsEndsAndItsSharpness) {
  ControlMesh drum = Prism(Round);
  TagRim(kRows, 0, kAround / 2, &drum);
  for (Crease& crease : drum.creases) crease.sharpness = 1.5f;
  SortTags(&drum);
  const ControlMesh result = Simplified(drum, 80);
  const auto chains = ChainsOf(result);
  ASSERT_EQ(chains.size(), 1u);
  EXPECT_FALSE(chains[0].closed);
  EXPECT_LT(chains[0].edges.size(), static_cast<size_t>(kAround) / 3);
  const Vector3d ends[2] = {{1, 0, 1}, {-1, 0, 1}};
  const Vector3d first = result.vertices.col(chains[0].vertices.front());
  const Vector3d last = result.vertices.col(chains[0].vertices.back());
  EXPECT_LT(std::min((first - ends[0]).norm() + (last - ends[1]).norm(),
                     (first - ends[1]).norm() + (last - ends[0]).norm()),
            1e-9);
  for (const SharpEdge& edge : TagsOf(result).edges) EXPECT_EQ(edge.sharpness, 1.5f);
}

TEST(CreaseConstraintsTest, WhatTheTagsLeaveAVertexToDo) {
  ControlMesh drum = Prism(Round);
  TagRim(0, 0, kAround / 2, &drum);
  SortTags(&drum);
  drum.corners = {5 * kAround};
  const HalfEdgeMesh mesh =
      HalfEdgeMesh::Build(drum.faces, static_cast<int>(drum.vertices.cols()), RunContext{}).value();
  const CreaseConstraints creases(mesh, drum);
  EXPECT_EQ(creases.ConstraintOf(0), VertexConstraint::kHeld);
  EXPECT_EQ(creases.ConstraintOf(1), VertexConstraint::kAlongCrease);
  EXPECT_EQ(creases.ConstraintOf(kAround / 2), VertexConstraint::kHeld);
  EXPECT_EQ(creases.ConstraintOf(kAround), VertexConstraint::kAnywhere);
  EXPECT_EQ(creases.ConstraintOf(5 * kAround), VertexConstraint::kHeldCorner);
  const auto half = [&](int from, int to) {
    int found = -1;
    mesh.ForEachOutgoing(from, [&](int h) {
      if (mesh.To(h) == to) found = h;
    });
    return found;
  };
  EXPECT_TRUE(creases.Allow(mesh, half(1, 2)));
  EXPECT_TRUE(creases.Allow(mesh, half(0, 1)));
  EXPECT_TRUE(creases.Allow(mesh, half(1, kAround + 1)));
  EXPECT_TRUE(creases.Allow(mesh, half(5 * kAround, 6 * kAround)));
}

TEST(CreaseConstraintsTest, NoTwoCreasesMergeAndNoTwoEndsMeet) {
  ControlMesh drum = Prism(Round);
  TagRim(0, 0, kAround, &drum);
  TagRim(1, 0, kAround, &drum);
  TagRim(3, 7, 8, &drum);  // one edge: both of its vertices are ends
  SortTags(&drum);
  const HalfEdgeMesh mesh =
      HalfEdgeMesh::Build(drum.faces, static_cast<int>(drum.vertices.cols()), RunContext{}).value();
  const CreaseConstraints creases(mesh, drum);
  mesh.ForEachOutgoing(
      5, [&](int h) { EXPECT_EQ(creases.Allow(mesh, h), mesh.To(h) / kAround != 1); });
  mesh.ForEachOutgoing(3 * kAround + 7, [&](int h) {
    EXPECT_EQ(creases.Allow(mesh, h), mesh.To(h) != 3 * kAround + 8);
  });
}

TEST(CreaseConstraintsTest, WhereTheSharpnessChangesAVertexIsHeld) {
  ControlMesh drum = Prism(Round);
  TagRim(0, 0, kAround, &drum);
  for (int i = 0; i < kAround / 2; ++i) drum.creases[i].sharpness = 2;
  SortTags(&drum);
  const HalfEdgeMesh mesh =
      HalfEdgeMesh::Build(drum.faces, static_cast<int>(drum.vertices.cols()), RunContext{}).value();
  const CreaseConstraints creases(mesh, drum);
  for (int v = 0; v < kAround; ++v) {
    const bool held = v == 0 || v == kAround / 2;
    EXPECT_EQ(creases.ConstraintOf(v),
              held ? VertexConstraint::kHeld : VertexConstraint::kAlongCrease)
        << v;
  }
}

// A disk with a round crease one ring inside its rim, and hardly a face to spare.
TEST(CreaseConstraintsTest, TheBoundaryComesToNoCreaseInside) {
  const ControlMesh prism = Prism(Round);
  ControlMesh disk;
  const int rings = kRings - 1;  // of the lower lid, the middle with it
  disk.vertices.resize(3, kAround * (rings + 1) + 1);
  disk.vertices.leftCols(kAround) = prism.vertices.leftCols(kAround);
  disk.vertices.rightCols(kAround * rings + 1) =
      prism.vertices.middleCols((kRows + 1) * kAround, kAround * rings + 1);
  std::vector<Eigen::Vector3i> faces;
  for (const auto face : prism.faces.colwise()) {
    Eigen::Vector3i corners = face;
    for (int& v : corners) {
      if (v >= kAround) v -= kRows * kAround;
    }
    if (corners.minCoeff() >= 0 && corners.maxCoeff() < disk.vertices.cols() &&
        (face.array() < kAround || face.array() >= (kRows + 1) * kAround).all()) {
      faces.push_back(corners);
    }
  }
  disk.faces.resize(3, static_cast<Eigen::Index>(faces.size()));
  for (size_t f = 0; f < faces.size(); ++f) disk.faces.col(f) = faces[f];
  TagRim(1, 0, kAround, &disk);
  SortTags(&disk);
  ASSERT_EQ(Summary(disk).boundary_loops, 1);
  const ControlMesh result = Simplified(disk, 8);
  const auto topology =
      BuildMeshTopology(result.faces, static_cast<int>(result.vertices.cols())).value();
  for (const CreaseChain& chain : ChainsOf(result)) {
    EXPECT_TRUE(chain.closed);
    for (const int v : chain.vertices) EXPECT_FALSE(topology.boundary_vertex[v]);
  }
}

}  // namespace
}  // namespace rilievo
