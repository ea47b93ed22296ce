#include "core/loop/limit_stencils.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <set>

#include "core/loop/split_normals.h"
#include "tests/unit/geometry/test_meshes.h"
#include "tests/unit/loop/crease_meshes.h"

namespace rilievo {
namespace {

using testing::Refine;

LimitStencils Build(const LoopRefinement& refinement, int level, int threads = 1) {
  RunContext context;
  context.threads = threads;
  auto stencils = BuildLimitStencils(refinement, level, context);
  EXPECT_TRUE(stencils.ok()) << stencils.status();
  return *std::move(stencils);
}

Eigen::Matrix3Xd Apply(const LimitStencils& stencils, const std::vector<double>& weights,
                       const Eigen::Matrix3Xd& control_points) {
  Eigen::Matrix3Xd result = Eigen::Matrix3Xd::Zero(3, stencils.size());
  for (int s = 0; s < stencils.size(); ++s) {
    for (int i = stencils.begin[s]; i < stencils.begin[s + 1]; ++i) {
      result.col(s) += weights[i] * control_points.col(stencils.control_vertices[i]);
    }
  }
  return result;
}

class LimitStencilsTest : public ::testing::TestWithParam<testing::NamedMesh> {
 protected:
  const ControlMesh& mesh() const { return GetParam().mesh; }
};

TEST_P(LimitStencilsTest, GiveTheLimitSurface) {
  const LoopRefinement refinement = Refine(mesh(), 3);
  for (int level = 0; level <= 3; ++level) {
    const LimitStencils stencils = Build(refinement, level);
    ASSERT_EQ(stencils.size(), refinement.levels[level].vertex_count);
    const auto limit = EvaluateLimit(refinement, mesh().vertices, level, RunContext());
    ASSERT_TRUE(limit.ok());
    EXPECT_LT((Apply(stencils, stencils.position, mesh().vertices) - limit->positions)
                  .cwiseAbs()
                  .maxCoeff(),
              1e-13);
    const Eigen::Matrix3Xd u = Apply(stencils, stencils.tangent_u, mesh().vertices);
    const Eigen::Matrix3Xd v = Apply(stencils, stencils.tangent_v, mesh().vertices);
    for (int s = 0; s < stencils.size(); ++s) {
      EXPECT_LT((u.col(s).cross(v.col(s)).normalized() - limit->normals.col(s)).norm(), 1e-9);
    }
  }
}

TEST_P(LimitStencilsTest, AreSparseSortedAndBalanced) {
  const LoopRefinement refinement = Refine(mesh(), 2);
  const MeshTopology& control = refinement.levels[0];
  const VertexRings rings = BuildVertexRings(control);
  const LimitStencils stencils = Build(refinement, 2);
  ASSERT_EQ(stencils.position.size(), stencils.control_vertices.size());
  ASSERT_EQ(stencils.tangent_u.size(), stencils.control_vertices.size());
  ASSERT_EQ(stencils.tangent_v.size(), stencils.control_vertices.size());
  for (int s = 0; s < stencils.size(); ++s) {
    double position = 0.0, tangent_u = 0.0, tangent_v = 0.0;
    for (int i = stencils.begin[s]; i < stencils.begin[s + 1]; ++i) {
      if (i > stencils.begin[s]) {
        EXPECT_LT(stencils.control_vertices[i - 1], stencils.control_vertices[i]);
      }
      EXPECT_GE(stencils.position[i], 0.0);
      position += stencils.position[i];
      tangent_u += stencils.tangent_u[i];
      tangent_v += stencils.tangent_v[i];
    }
    EXPECT_NEAR(position, 1.0, 1e-14);
    EXPECT_NEAR(tangent_u, 0.0, 1e-13);
    EXPECT_NEAR(tangent_v, 0.0, 1e-13);
  }
  // A point of a control face depends on the corners of the face and on their neighbours alone.
  const FaceSamples samples = SamplesOfControlFaces(refinement, 2);
  for (int f = 0; f < control.face_count(); ++f) {
    std::set<int> reach;
    for (int k = 0; k < 3; ++k) {
      const int v = control.faces(k, f);
      reach.insert(v);
      reach.insert(rings.neighbors.begin() + rings.neighbor_begin[v],
                   rings.neighbors.begin() + rings.neighbor_begin[v + 1]);
    }
    for (int i = 0; i < samples.per_face; ++i) {
      const int s = samples.vertices[f * samples.per_face + i];
      for (int j = stencils.begin[s]; j < stencils.begin[s + 1]; ++j) {
        EXPECT_TRUE(reach.contains(stencils.control_vertices[j]));
      }
    }
  }
}

TEST_P(LimitStencilsTest, SameForAnyThreadCount) {
  const LoopRefinement refinement = Refine(mesh(), 3);
  const LimitStencils one = Build(refinement, 3, 1), two = Build(refinement, 3, 2);
  EXPECT_EQ(one.begin, two.begin);
  EXPECT_EQ(one.control_vertices, two.control_vertices);
  EXPECT_EQ(one.position, two.position);
  EXPECT_EQ(one.tangent_u, two.tangent_u);
  EXPECT_EQ(one.tangent_v, two.tangent_v);
}

TEST_P(LimitStencilsTest, NeedNoTopologyOfTheirOwnLevel) {
  const LimitStencils full = Build(Refine(mesh(), 2), 2), lean = Build(Refine(mesh(), 1), 2);
  EXPECT_EQ(full.begin, lean.begin);
  EXPECT_EQ(full.control_vertices, lean.control_vertices);
  EXPECT_EQ(full.position, lean.position);
}

TEST_P(LimitStencilsTest, SamplesLieWhereTheyAreSaidTo) {
  // With linear subdivision (midpoints) the samples' places on the flat control faces are exact.
  const int level = 3, side = 1 << level;
  const LoopRefinement refinement = Refine(mesh(), level);
  Eigen::Matrix3Xd points = mesh().vertices;
  for (int l = 0; l < level; ++l) {
    const MeshTopology& topology = refinement.levels[l];
    const Eigen::Index count = points.cols();
    points.conservativeResize(3, count + topology.edge_count());
    for (int e = 0; e < topology.edge_count(); ++e) {
      points.col(count + e) = 0.5 * (points.col(topology.edge_vertices(0, e)) +
                                     points.col(topology.edge_vertices(1, e)));
    }
  }
  const FaceSamples samples = SamplesOfControlFaces(refinement, level);
  ASSERT_EQ(samples.per_face, (side + 1) * (side + 2) / 2);
  const MeshTopology& control = refinement.levels[0];
  ASSERT_EQ(samples.vertices.size(), static_cast<size_t>(samples.per_face) * control.face_count());
  for (int f = 0; f < control.face_count(); ++f) {
    const Eigen::Vector3d a = points.col(control.faces(0, f)), b = points.col(control.faces(1, f)),
                          c = points.col(control.faces(2, f));
    const int* sample = samples.vertices.data() + f * samples.per_face;
    for (int j = 0; j <= side; ++j) {
      for (int i = 0; i <= side - j; ++i) {
        const Eigen::Vector3d expected = a + (b - a) * i / side + (c - a) * j / side;
        EXPECT_LT((points.col(*sample++) - expected).norm(), 1e-14);
      }
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Meshes, LimitStencilsTest, ::testing::ValuesIn(testing::LoopMeshes()),
                         [](const auto& mesh) { return mesh.param.name; });

class CreaseStencilsTest : public ::testing::TestWithParam<testing::NamedMesh> {
 protected:
  const ControlMesh& mesh() const { return GetParam().mesh; }
};

TEST_P(CreaseStencilsTest, GiveTheLimitSurfaceAndItsSides) {
  const LoopRefinement refinement = Refine(mesh(), 3);
  for (int level = 0; level <= 3; ++level) {
    const LimitStencils stencils = Build(refinement, level);
    ASSERT_EQ(stencils.size(), refinement.levels[level].vertex_count);
    const auto limit = EvaluateLimit(refinement, mesh().vertices, level, RunContext());
    const auto sectors = SectorsOfLevel(refinement, level);
    ASSERT_TRUE(limit.ok() && sectors.ok());
    EXPECT_LT((Apply(stencils, stencils.position, mesh().vertices) - limit->positions)
                  .cwiseAbs()
                  .maxCoeff(),
              1e-12);
    const Eigen::Matrix3Xd u = Apply(stencils, stencils.tangent_u, mesh().vertices);
    const Eigen::Matrix3Xd v = Apply(stencils, stencils.tangent_v, mesh().vertices);
    Eigen::Matrix3Xd normals(3, stencils.size());
    for (int s = 0; s < stencils.size(); ++s) {
      normals.col(s) = u.col(s).cross(v.col(s)).normalized();
    }
    SetSharpNormals(stencils, mesh().vertices, normals);
    EXPECT_LT((normals - limit->normals).cwiseAbs().maxCoeff(), 1e-9);
    EXPECT_EQ(stencils.sectors.vertices, sectors->vertices);
    for (int s = 0; s < stencils.sectors.size(); ++s) {
      Eigen::Vector3d tangent_u = Eigen::Vector3d::Zero(), tangent_v = Eigen::Vector3d::Zero();
      for (int i = stencils.sectors.begin[s]; i < stencils.sectors.begin[s + 1]; ++i) {
        const Eigen::Vector3d point = mesh().vertices.col(stencils.sectors.control_vertices[i]);
        tangent_u += stencils.sectors.tangent_u[i] * point;
        tangent_v += stencils.sectors.tangent_v[i] * point;
      }
      EXPECT_LT((tangent_u.cross(tangent_v).normalized() - limit->sector_normals.col(s)).norm(),
                1e-9);
    }
  }
}

TEST_P(CreaseStencilsTest, AreSortedAndBalanced) {
  const LimitStencils stencils = Build(Refine(mesh(), 2), 3);
  for (int s = 0; s < stencils.size(); ++s) {
    double position = 0.0, tangents = 0.0;
    for (int i = stencils.begin[s]; i < stencils.begin[s + 1]; ++i) {
      if (i > stencils.begin[s]) {
        EXPECT_LT(stencils.control_vertices[i - 1], stencils.control_vertices[i]);
      }
      EXPECT_GE(stencils.position[i], -1e-16);
      position += stencils.position[i];
      tangents += stencils.tangent_u[i] + stencils.tangent_v[i];
    }
    EXPECT_NEAR(position, 1.0, 1e-13);
    EXPECT_NEAR(tangents, 0.0, 1e-11);
  }
}

TEST_P(CreaseStencilsTest, SameForAnyThreadCount) {
  const LoopRefinement refinement = Refine(mesh(), 2);
  const LimitStencils one = Build(refinement, 3, 1), two = Build(refinement, 3, 2);
  EXPECT_EQ(one.begin, two.begin);
  EXPECT_EQ(one.position, two.position);
  EXPECT_EQ(one.tangent_u, two.tangent_u);
  EXPECT_EQ(one.sectors.vertices, two.sectors.vertices);
  EXPECT_EQ(one.sectors.begin, two.sectors.begin);
  EXPECT_EQ(one.sectors.tangent_u, two.sectors.tangent_u);
  EXPECT_EQ(one.sectors.tangent_v, two.sectors.tangent_v);
}

INSTANTIATE_TEST_SUITE_P(Meshes, CreaseStencilsTest, ::testing::ValuesIn(testing::CreaseMeshes()),
                         [](const auto& mesh) { return mesh.param.name; });

TEST(BuildLimitStencilsTest, SmoothMeshesHaveNoSectors) {
  EXPECT_EQ(Build(Refine(testing::Icosahedron(), 2), 2).sectors.size(), 0);
}

TEST(BuildLimitStencilsTest, RegularVertexHasTheTextbookWeights) {
  const LimitStencils stencils = Build(Refine(testing::Torus(8, 6), 0), 0);
  for (int s = 0; s < stencils.size(); ++s) {
    ASSERT_EQ(stencils.begin[s + 1] - stencils.begin[s], 7);
    for (int i = stencils.begin[s]; i < stencils.begin[s + 1]; ++i) {
      EXPECT_NEAR(stencils.position[i], stencils.control_vertices[i] == s ? 0.5 : 1.0 / 12.0,
                  1e-15);
    }
  }
}

TEST(BuildLimitStencilsTest, SameForAnyThreadCountOverManyBlocks) {
  const LoopRefinement refinement = Refine(testing::Torus(30, 20), 3);
  const LimitStencils one = Build(refinement, 3, 1), two = Build(refinement, 3, 2);
  EXPECT_EQ(one.begin, two.begin);
  EXPECT_EQ(one.control_vertices, two.control_vertices);
  EXPECT_EQ(one.position, two.position);
}

TEST(BuildLimitStencilsTest, RefusesLevelsThatAreNotThere) {
  const LoopRefinement refinement = Refine(testing::Icosahedron(), 1);
  for (const int level : {-1, 3}) {
    EXPECT_EQ(BuildLimitStencils(refinement, level, RunContext()).status().code(),
              absl::StatusCode::kInvalidArgument);
  }
}

}  // namespace
}  // namespace rilievo
