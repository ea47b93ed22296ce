// Catmull-Clark surfaces against OpenSubdiv and against themselves, on every level.
#include "core/loop/quad_surface.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <algorithm>
#include <map>

#include "core/loop/split_normals.h"
#include "tests/unit/loop/opensubdiv_oracle.h"
#include "tests/unit/loop/quad_meshes.h"

namespace rilievo {
namespace {

using ::testing::HasSubstr;
using testing::Refine;

constexpr int kSettledQuads = 3;  // from this level on all semi-sharp edges are smooth

LimitSurface QuadLimits(const LoopRefinement& refinement, const Eigen::Matrix3Xd& points, int level,
                        int threads = 1) {
  RunContext context;
  context.threads = threads;
  auto limit = EvaluateLimit(refinement, points, level, context);
  EXPECT_TRUE(limit.ok()) << limit.status();
  return *std::move(limit);
}

double Farthest(const Eigen::Matrix3Xd& a, const Eigen::Matrix3Xd& b) {
  return (a - b).cwiseAbs().maxCoeff();
}

std::vector<VertexKind> KindsOnceSettled(const ControlMesh& mesh) {
  ControlMesh settled = mesh;
  std::erase_if(settled.creases,
                [](const Crease& crease) { return crease.sharpness < kInfiniteSharpness; });
  const auto topology = BuildMeshTopology(mesh.faces, static_cast<int>(mesh.vertices.cols()));
  return BuildCreaseTopology(settled, *topology)->kinds;
}

// The mesh of a level, with what is left of its tags.
ControlMesh MeshOfLevel(const ControlMesh& mesh, const LoopRefinement& refinement, int level,
                        Eigen::Matrix3Xd points) {
  const MeshTopology& topology = refinement.levels[level];
  const QuadLevel& quads = refinement.quads.levels[level];
  ControlMesh fine = {std::move(points), topology.faces, {}, mesh.corners};
  for (int e = 0; e < topology.edge_count(); ++e) {
    const auto ends = topology.edge_vertices.col(e);
    if (quads.diagonal[e] != 0) fine.diagonals.push_back({ends[0], ends[1]});
    if (quads.sharpness[e] > 0) fine.creases.push_back({ends[0], ends[1], quads.sharpness[e]});
  }
  std::sort(fine.diagonals.begin(), fine.diagonals.end());
  testing::SortCreases(fine);
  return fine;
}

// By control vertex: whether one of its sides is a single quad, whose tangents are taken where the
// vertex is born, see quad_masks.h.
std::vector<uint8_t> HasSideOfOneQuad(const LoopRefinement& refinement) {
  const MeshTopology& control = refinement.levels.front();
  const QuadRings rings(control, refinement.quads, 0);
  std::vector<uint8_t> flags(control.vertex_count, 0);
  QuadRing ring;
  for (int v = 0; v < control.vertex_count; ++v) {
    rings.Of(v, ring);
    const std::vector<float>& sharpness = ring.sharp.sharpness;
    for (size_t i = ring.sharp.boundary ? 1 : 0; i < sharpness.size(); ++i) {
      const float before = sharpness[(i + sharpness.size() - 1) % sharpness.size()];
      flags[v] |= std::min(before, sharpness[i]) >= kInfiniteSharpness;
    }
  }
  return flags;
}

class QuadSurfaceTest : public ::testing::TestWithParam<testing::NamedMesh> {
 protected:
  const ControlMesh& mesh() const { return GetParam().mesh; }
};

TEST_P(QuadSurfaceTest, SubdividesLikeOpenSubdiv) {
  const LoopRefinement refinement = Refine(mesh(), 3);
  const auto oracle = testing::EvaluateWithOpenSubdiv(mesh(), refinement);
  Eigen::Matrix3Xd positions = mesh().vertices;
  for (int level = 0; level <= 3; ++level) {
    EXPECT_LT(Farthest(positions, oracle[level].positions), 1e-13) << level;
    if (level < 3) positions = SubdivideOnce(refinement, level, positions);
  }
}

TEST_P(QuadSurfaceTest, LimitsAreOpenSubdivs) {
  const LoopRefinement refinement = Refine(mesh(), kSettledQuads);
  const auto oracle = testing::EvaluateWithOpenSubdiv(mesh(), refinement);
  const std::vector<VertexKind> kinds = KindsOnceSettled(mesh());
  const LimitSurface limit = QuadLimits(refinement, mesh().vertices, kSettledQuads);
  const auto sectors = SectorsOfLevel(refinement, kSettledQuads);
  ASSERT_TRUE(sectors.ok());
  ASSERT_EQ(sectors->size(), limit.sector_normals.cols());
  std::map<int, double> nearest;  // of a crease's sides, one of which OpenSubdiv tells
  for (int s = 0; s < sectors->size(); ++s) {
    const int v = sectors->vertices[s];
    const double distance =
        (limit.sector_normals.col(s) - oracle[kSettledQuads].limit_normals.col(v)).norm();
    const auto [entry, first] = nearest.try_emplace(v, distance);
    if (!first) entry->second = std::min(entry->second, distance);
  }
  int compared = 0;
  for (int v = 0; v < limit.positions.cols(); ++v) {
    const bool control = v < static_cast<int>(kinds.size());
    if (control && kinds[v] == VertexKind::kDart) continue;
    EXPECT_LT((limit.positions.col(v) - oracle[kSettledQuads].limit_positions.col(v)).norm(), 1e-13)
        << v;
    // The tangents of irregular sides are others, see quad_masks.h.
    if (control && kinds[v] != VertexKind::kSmooth) continue;
    const auto crease = nearest.find(v);
    const double distance =
        crease != nearest.end()
            ? crease->second
            : (limit.normals.col(v) - oracle[kSettledQuads].limit_normals.col(v)).norm();
    EXPECT_LT(distance, 1e-10) << v;
    ++compared;
  }
  EXPECT_GT(compared, 50);
}

// Of a dart OpenSubdiv's own mask is the smooth one; this leaves but one, too.
TEST_P(QuadSurfaceTest, LimitsStayWhenTheMeshIsRefined) {
  const LoopRefinement refinement = Refine(mesh(), 2);
  const auto oracle = testing::EvaluateWithOpenSubdiv(mesh(), refinement);
  const LimitSurface limit = QuadLimits(refinement, mesh().vertices, 2);
  const ControlMesh fine = MeshOfLevel(mesh(), refinement, 2, oracle[2].positions);
  const LimitSurface fine_limit = QuadLimits(Refine(fine, 0), fine.vertices, 0);
  EXPECT_LT(Farthest(limit.positions, fine_limit.positions), 1e-13);
  const std::vector<VertexKind> kinds = KindsOnceSettled(mesh());
  const std::vector<uint8_t> crowded = HasSideOfOneQuad(refinement);
  for (int v = 0; v < limit.normals.cols(); ++v) {
    // So are the normals of corners.
    const bool control = v < static_cast<int>(kinds.size());
    if (control && (kinds[v] == VertexKind::kCorner || crowded[v] != 0)) continue;
    EXPECT_LT((limit.normals.col(v) - fine_limit.normals.col(v)).norm(), 1e-8) << v;
  }
}

TEST_P(QuadSurfaceTest, AVertexHasOneLimitOnEveryLevelForAnyThreadCount) {
  const LoopRefinement refinement = Refine(mesh(), 2);
  const LimitSurface fine = QuadLimits(refinement, mesh().vertices, 2);
  for (int level = 0; level < 2; ++level) {
    const LimitSurface coarse = QuadLimits(refinement, mesh().vertices, level, 2);
    EXPECT_EQ(coarse.positions, fine.positions.leftCols(coarse.positions.cols()));
    EXPECT_EQ(coarse.normals, fine.normals.leftCols(coarse.normals.cols()));
  }
  const LimitSurface lean = QuadLimits(Refine(mesh(), 1), mesh().vertices, 2, 2);
  EXPECT_EQ(lean.positions, fine.positions);
  EXPECT_EQ(lean.normals, fine.normals);
}

TEST_P(QuadSurfaceTest, StencilsGiveTheLimitSurface) {
  const LoopRefinement refinement = Refine(mesh(), 2);
  RunContext two;
  two.threads = 2;
  const auto stencils = BuildLimitStencils(refinement, 2, two);
  ASSERT_TRUE(stencils.ok()) << stencils.status();
  const LimitSurface limit = QuadLimits(refinement, mesh().vertices, 2);
  ASSERT_EQ(stencils->size(), limit.positions.cols());
  Eigen::Matrix3Xd positions = Eigen::Matrix3Xd::Zero(3, stencils->size()), normals = positions;
  for (int s = 0; s < stencils->size(); ++s) {
    Eigen::Vector3d u = Eigen::Vector3d::Zero(), v = Eigen::Vector3d::Zero();
    for (int i = stencils->begin[s]; i < stencils->begin[s + 1]; ++i) {
      const Eigen::Vector3d point = mesh().vertices.col(stencils->control_vertices[i]);
      positions.col(s) += stencils->position[i] * point;
      u += stencils->tangent_u[i] * point;
      v += stencils->tangent_v[i] * point;
    }
    normals.col(s) = u.cross(v).normalized();
  }
  SetSharpNormals(*stencils, mesh().vertices, normals);
  EXPECT_LT(Farthest(positions, limit.positions), 1e-13);
  for (int v = 0; v < normals.cols(); ++v) {
    EXPECT_LT((normals.col(v) - limit.normals.col(v)).norm(), 1e-9) << v;
  }
}

TEST_P(QuadSurfaceTest, SidesAreThoseOfTheTriangles) {
  const LoopRefinement refinement = Refine(mesh(), 1);
  const auto sectors = SectorsOfLevel(refinement, 1);
  ASSERT_TRUE(sectors.ok());
  const Eigen::Matrix3Xi& faces = refinement.levels[1].faces;
  for (int s = 0; s < sectors->size(); ++s) {
    for (int i = sectors->begin[s]; i < sectors->begin[s + 1]; ++i) {
      EXPECT_EQ(faces.data()[sectors->half_edges[i]], sectors->vertices[s]);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Meshes, QuadSurfaceTest, ::testing::ValuesIn(testing::QuadMeshes()),
                         [](const auto& mesh) { return mesh.param.name; });

// Whatever diagonal a quad is cut along, its surface is the same.
TEST(QuadSurfaceDiagonalsTest, ChangeNoLimit) {
  testing::Random one(7), other(8);
  const ControlMesh a = testing::TurnedTorus(6, 6, one), b = testing::TurnedTorus(6, 6, other);
  ASSERT_NE(a.diagonals, b.diagonals);
  EXPECT_LT(Farthest(QuadLimits(Refine(a, 0), a.vertices, 0).positions,
                     QuadLimits(Refine(b, 0), b.vertices, 0).positions),
            1e-15);
}

// The row that a mask is, times the matrix, is the row times an eigenvalue.
void ExpectEigenvector(const Eigen::MatrixXd& matrix, const std::vector<double>& mask, double least,
                       double most, const char* what) {
  const Eigen::Map<const Eigen::RowVectorXd> row(mask.data(),
                                                 static_cast<Eigen::Index>(mask.size()));
  const Eigen::RowVectorXd image = row * matrix;
  const double eigenvalue = image.dot(row) / row.squaredNorm();
  EXPECT_LT((image - eigenvalue * row).norm(), 1e-12 * row.norm()) << what;
  EXPECT_GE(eigenvalue, least) << what;
  EXPECT_LE(eigenvalue, most) << what;
}

// The subdivision matrix of a ring, from the rules of quad_masks.h as they stand there.
Eigen::MatrixXd MatrixOf(const SharpRing& ring) {
  const auto n = static_cast<int>(ring.sharpness.size());
  const int quads = n - (ring.boundary ? 1 : 0);
  Eigen::MatrixXd matrix = Eigen::MatrixXd::Zero(1 + n + quads, 1 + n + quads);
  const std::vector<double> self = QuadVertexWeights(ring);
  for (size_t i = 0; i < self.size(); ++i) matrix(0, static_cast<Eigen::Index>(i)) = self[i];
  for (int j = 0; j < quads; ++j) {
    for (const int at : {0, 1 + j, 1 + (j + 1) % n, 1 + n + j}) matrix(1 + n + j, at) = 0.25;
  }
  for (int i = 0; i < n; ++i) {
    matrix(1 + i, 0) = matrix(1 + i, 1 + i) = 0.5;
    if (ring.sharpness[i] > 0) continue;
    matrix.row(1 + i) = 0.5 * matrix.row(1 + i);
    matrix.row(1 + i) +=
        0.25 * (matrix.row(1 + n + i) + matrix.row(1 + n + (i + quads - 1) % quads));
  }
  return matrix;
}

TEST(QuadMasksTest, AreEigenvectorsOfTheSubdivision) {
  for (int n = 3; n <= 12; ++n) {
    SharpRing smooth{std::vector<float>(static_cast<size_t>(n), 0.0f)}, dart = smooth,
                                                                        border = smooth;
    dart.sharpness[1] = kInfiniteSharpness;
    border.boundary = true;
    border.sharpness.front() = border.sharpness.back() = kInfiniteSharpness;
    for (const SharpRing& ring : {smooth, dart, border}) {
      const Eigen::MatrixXd matrix = MatrixOf(ring);
      const SharpLimitMask mask = QuadLimit(ring);
      ExpectEigenvector(matrix, mask.position, 1 - 1e-12, 1 + 1e-12, "position");
      ExpectEigenvector(matrix, mask.whole.tangent_u, 0.4, 0.999, "tangent_u");
      ExpectEigenvector(matrix, mask.whole.tangent_v, 0.4, 0.999, "tangent_v");
      const Eigen::Map<const Eigen::VectorXd> u(mask.whole.tangent_u.data(), matrix.rows()),
          v(mask.whole.tangent_v.data(), matrix.rows());
      EXPECT_LT(std::abs(u.dot(v)), 1e-12 * u.norm() * v.norm());
      // Both lead: no eigenvalue but 1 is larger than theirs, but for the boundary.
      if (ring.boundary) continue;
      Eigen::VectorXd values = matrix.eigenvalues().cwiseAbs();
      std::sort(values.begin(), values.end(), std::greater<>());
      ExpectEigenvector(matrix, mask.whole.tangent_u, values[2] - 1e-9, values[1] + 1e-9, "u");
      ExpectEigenvector(matrix, mask.whole.tangent_v, values[2] - 1e-9, values[1] + 1e-9, "v");
    }
  }
}

TEST(QuadTopologyTest, RefusesWhatAreNoQuads) {
  testing::Random random(3);
  const ControlMesh good = testing::TurnedTorus(6, 6, random);
  const auto error = [&](auto change) {
    ControlMesh mesh = good;
    change(mesh);
    return std::string(RefineTopology(mesh, 1, RunContext()).status().message());
  };
  EXPECT_EQ(error([](ControlMesh&) {}), "");
  EXPECT_THAT(error([](ControlMesh& mesh) { mesh.diagonals.pop_back(); }), HasSubstr("0 quads"));
  EXPECT_THAT(error([](ControlMesh& mesh) { std::swap(mesh.diagonals[0], mesh.diagonals[1]); }),
              HasSubstr("out of order"));
  EXPECT_THAT(error([](ControlMesh& mesh) {
                mesh.diagonals.back() = {34, 35 + 1};
              }),
              HasSubstr("34-36 is not an edge"));
  EXPECT_THAT(error([](ControlMesh& mesh) {
                mesh.creases.push_back({mesh.diagonals[2][0], mesh.diagonals[2][1]});
              }),
              HasSubstr("is the diagonal of a quad"));
  ControlMesh open = testing::Grid(2, 2);
  open.diagonals = {{0, 1}};
  EXPECT_THAT(std::string(RefineTopology(open, 0, RunContext()).status().message()),
              HasSubstr("0-1 lies on the boundary"));
}

}  // namespace
}  // namespace rilievo
