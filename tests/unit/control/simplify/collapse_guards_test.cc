#include "core/control/simplify/collapse_guards.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "core/control/simplify/settings.h"
#include "tests/scans/random.h"
#include "tests/unit/control/control_test_meshes.h"

namespace rilievo {
namespace {

using Eigen::Vector3d;

struct Shape {
  explicit Shape(const ControlMesh& mesh)
      : half_edges(
            HalfEdgeMesh::Build(mesh.faces, static_cast<int>(mesh.vertices.cols()), RunContext{})
                .value()) {
    for (const auto& vertex : mesh.vertices.colwise()) positions.push_back(vertex);
    for (const auto& face : mesh.faces.colwise()) {
      const Vector3d &a = positions[face[0]], &b = positions[face[1]], &c = positions[face[2]];
      normals.push_back((b - a).cross(c - a).normalized().cast<float>());
    }
  }

  static double Roundness(const Vector3d& a, const Vector3d& b, const Vector3d& c) {
    const double edges = (b - a).squaredNorm() + (c - b).squaredNorm() + (a - c).squaredNorm();
    return edges > 0 ? 2 * std::numbers::sqrt3 * (b - a).cross(c - a).norm() / edges : 0;
  }

  // Face by face, by angles and roundness as they are defined.
  bool KeepsShape(int a, int b, const Vector3d& position, double roundness, double turn) const {
    double before = 1, after = 1;
    for (const int end : {a, b}) {
      for (int f = 0; f < half_edges.face_slots(); ++f) {
        int corner[3], moved = 0;
        bool around = false;
        for (int k = 0; k < 3; ++k) {
          corner[k] = half_edges.From(3 * f + k);
          around = around || corner[k] == end;
          moved += corner[k] == a || corner[k] == b;
        }
        if (!around) continue;
        Vector3d old[3], made[3];
        for (int k = 0; k < 3; ++k) {
          old[k] = positions[corner[k]];
          made[k] = corner[k] == end ? position : old[k];
        }
        const double was = Roundness(old[0], old[1], old[2]);
        before = std::min(before, was);
        if (moved == 2) continue;
        after = std::min(after, Roundness(made[0], made[1], made[2]));
        const Vector3d cross = (made[1] - made[0]).cross(made[2] - made[0]);
        const Vector3d old_cross = (old[1] - old[0]).cross(old[2] - old[0]);
        if (!(cross.dot(normals[f].cast<double>()) >= turn * cross.norm())) return false;
        if (was > 0.02 && cross.dot(old_cross) <
                              kCollapseGuards.least_upright * cross.norm() * old_cross.norm()) {
          return false;
        }
      }
    }
    return after >= std::min(roundness, before);
  }

  HalfEdgeMesh half_edges;
  std::vector<Vector3d> positions;
  std::vector<Eigen::Vector3f> normals;
};

TEST(CollapseGuardsTest, AgreesWithTheDefinition) {
  const Shape shape(MarchTetrahedra(SphereField, 8));
  Random random(7);
  int kept = 0, refused = 0;
  for (int edge = 0; edge < shape.half_edges.edge_slots(); ++edge) {
    const int h = shape.half_edges.HalfOfEdge(edge);
    const int a = shape.half_edges.From(h), b = shape.half_edges.To(h);
    const Vector3d way = shape.positions[b] - shape.positions[a];
    for (const double roundness : {0.01, 0.25, 0.5}) {
      const double turn = random.Uniform(0, 0.95);
      const CollapseGuards faces(shape.half_edges, shape.positions, shape.normals, turn);
      Vector3d place = shape.positions[a] + random.Uniform(0, 1) * way;
      for (double& coordinate : place) coordinate += 0.01 * random.Normal();
      const bool expected = shape.KeepsShape(a, b, place, roundness, turn);
      EXPECT_EQ(faces.KeepShape(a, b, place, roundness), expected) << edge << " " << roundness;
      ++(expected ? kept : refused);
    }
  }
  EXPECT_GT(kept, 200);
  EXPECT_GT(refused, 200);
}

}  // namespace
}  // namespace rilievo
