#include "core/schemes/subdivide_mesh.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <opensubdiv/far/primvarRefiner.h>
#include <opensubdiv/far/topologyDescriptor.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <numbers>
#include <span>
#include <string>
#include <utility>

#include "core/schemes/polygon_topology.h"
#include "tests/unit/geometry/test_meshes.h"

namespace rilievo::testing {
namespace {

using ::testing::HasSubstr;
namespace Far = OpenSubdiv::OPENSUBDIV_VERSION::Far;
namespace Sdc = OpenSubdiv::OPENSUBDIV_VERSION::Sdc;

PolygonMesh PolygonsOf(const ControlMesh& mesh) {
  PolygonMesh polygons{mesh.vertices, {0}, {}};
  for (const auto& face : mesh.faces.colwise()) polygons.AddFace(std::span(face.data(), 3));
  return polygons;
}

PolygonMesh Bent(PolygonMesh mesh) {
  Random random(5);
  for (auto column : mesh.vertices.colwise()) column += 0.1 * random.Vector();
  return mesh;
}

// Six quads; `open`: without the one above.
PolygonMesh Cube(bool open) {
  PolygonMesh cube;
  cube.vertices = Box({0, 0, 0}, {1, 1, 1}).vertices;
  cube.AddFace(std::array{0, 2, 3, 1});
  cube.AddFace(std::array{0, 1, 5, 4});
  cube.AddFace(std::array{1, 3, 7, 5});
  cube.AddFace(std::array{3, 2, 6, 7});
  cube.AddFace(std::array{2, 0, 4, 6});
  if (!open) cube.AddFace(std::array{4, 5, 7, 6});
  return cube;
}

// A pentagon with a triangle on each side, and a quad beyond one of them.
PolygonMesh Flower() {
  PolygonMesh mesh;
  mesh.vertices.resize(3, 12);
  for (int i = 0; i < 5; ++i) {
    const double angle = 2 * std::numbers::pi * i / 5, beyond = angle + std::numbers::pi / 5;
    mesh.vertices.col(i) << std::cos(angle), std::sin(angle), 0.1 * i;
    mesh.vertices.col(5 + i) << 2 * std::cos(beyond), 2 * std::sin(beyond), 0;
  }
  mesh.vertices.col(10) << 3, 0.5, 0.3;
  mesh.vertices.col(11) << 3, 1.5, 0.1;
  mesh.AddFace(std::array{0, 1, 2, 3, 4});
  for (int i = 0; i < 5; ++i) mesh.AddFace(std::array{i, 5 + i, (i + 1) % 5});
  mesh.AddFace(std::array{0, 10, 11, 5});
  return mesh;
}

Eigen::Vector3d MiddleOf(const PolygonMesh& mesh, int f) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const int v : mesh.Face(f)) sum += mesh.vertices.col(v);
  return sum / static_cast<double>(mesh.Face(f).size());
}

struct OracleValue {
  Eigen::Vector3d value = Eigen::Vector3d::Zero();
  void Clear() { value.setZero(); }
  void AddWithWeight(const OracleValue& other, double weight) { value += weight * other.value; }
};

PolygonMesh SubdivideWithOpenSubdiv(const PolygonMesh& mesh, Sdc::SchemeType scheme, int levels) {
  std::vector<int> counts;
  for (int f = 0; f < mesh.face_count(); ++f)
    counts.push_back(static_cast<int>(mesh.Face(f).size()));
  Far::TopologyDescriptor descriptor;
  descriptor.numVertices = static_cast<int>(mesh.vertices.cols());
  descriptor.numFaces = mesh.face_count();
  descriptor.numVertsPerFace = counts.data();
  descriptor.vertIndicesPerFace = mesh.corners.data();
  Sdc::Options options;
  options.SetVtxBoundaryInterpolation(Sdc::Options::VTX_BOUNDARY_EDGE_ONLY);
  using Factory = Far::TopologyRefinerFactory<Far::TopologyDescriptor>;
  const std::unique_ptr<Far::TopologyRefiner> refiner(
      Factory::Create(descriptor, Factory::Options(scheme, options)));
  Far::TopologyRefiner::UniformOptions uniform(levels);
  uniform.fullTopologyInLastLevel = true;
  refiner->RefineUniform(uniform);
  std::vector<OracleValue> values(static_cast<size_t>(mesh.vertices.cols()));
  for (size_t v = 0; v < values.size(); ++v) {
    values[v].value = mesh.vertices.col(static_cast<Eigen::Index>(v));
  }
  for (int l = 1; l <= levels; ++l) {
    std::vector<OracleValue> finer(static_cast<size_t>(refiner->GetLevel(l).GetNumVertices()));
    Far::PrimvarRefinerReal<double>(*refiner).Interpolate(l, values, finer);
    values = std::move(finer);
  }
  PolygonMesh result;
  result.vertices.resize(3, static_cast<Eigen::Index>(values.size()));
  for (size_t v = 0; v < values.size(); ++v) {
    result.vertices.col(static_cast<Eigen::Index>(v)) = values[v].value;
  }
  const Far::TopologyLevel& last = refiner->GetLevel(levels);
  for (int f = 0; f < last.GetNumFaces(); ++f) {
    const auto face = last.GetFaceVertices(f);
    result.AddFace(std::span(&face[0], static_cast<size_t>(face.size())));
  }
  return result;
}

// The largest distance of a column from the nearest of as many others.
double FarthestFrom(const Eigen::Matrix3Xd& points, const Eigen::Matrix3Xd& others) {
  EXPECT_EQ(points.cols(), others.cols());
  double worst = 0;
  for (const auto& point : points.colwise()) {
    worst = std::max(worst, (others.colwise() - point).colwise().norm().minCoeff());
  }
  return worst;
}

Eigen::Matrix3Xd MiddlesOf(const PolygonMesh& mesh) {
  Eigen::Matrix3Xd middles(3, mesh.face_count());
  for (int f = 0; f < mesh.face_count(); ++f) middles.col(f) = MiddleOf(mesh, f);
  return middles;
}

PolygonMesh Subdivided(const PolygonMesh& mesh, SubdivisionScheme scheme, int levels) {
  auto made = SubdivideMesh(mesh, scheme, levels, {}, RunContext());
  EXPECT_TRUE(made.ok()) << made.status();
  EXPECT_TRUE(BuildPolygonTopology(*made).ok());
  return *std::move(made);
}

void ExpectSame(const PolygonMesh& made, const PolygonMesh& expected) {
  EXPECT_LT(FarthestFrom(made.vertices, expected.vertices), 1e-14);
  EXPECT_LT(FarthestFrom(expected.vertices, made.vertices), 1e-14);
  EXPECT_LT(FarthestFrom(MiddlesOf(made), MiddlesOf(expected)), 1e-14);
}

TEST(SubdivideMeshTest, LoopAndCatmullClarkAreThoseOfOpenSubdiv) {
  for (const ControlMesh& mesh : {Tetrahedron(), Icosahedron(), Bipyramid(9), Grid(4, 3)}) {
    const PolygonMesh bent = Bent(PolygonsOf(mesh));
    ExpectSame(Subdivided(bent, SubdivisionScheme::kLoop, 2),
               SubdivideWithOpenSubdiv(bent, Sdc::SCHEME_LOOP, 2));
    ExpectSame(Subdivided(bent, SubdivisionScheme::kCatmullClark, 2),
               SubdivideWithOpenSubdiv(bent, Sdc::SCHEME_CATMARK, 2));
  }
  for (const PolygonMesh& mesh : {Bent(Cube(false)), Bent(Cube(true)), Flower()}) {
    ExpectSame(Subdivided(mesh, SubdivisionScheme::kCatmullClark, 3),
               SubdivideWithOpenSubdiv(mesh, Sdc::SCHEME_CATMARK, 3));
  }
}

TEST(SubdivideMeshTest, DooSabinOfTheCube) {
  const PolygonMesh made = Subdivided(Cube(false), SubdivisionScheme::kDooSabin, 1);
  EXPECT_EQ(made.vertices.cols(), 24);
  EXPECT_EQ(made.face_count(), 6 + 12 + 8);
  // 9/16 of the corner, 3/16 of those beside it and 1/16 of the one opposite.
  EXPECT_LT((made.vertices.col(0) - Eigen::Vector3d(0.25, 0.25, 0)).norm(), 1e-15);
  EXPECT_EQ(
      std::count_if(made.begin.begin() + 1, made.begin.end(),
                    [last = 0](int end) mutable { return std::exchange(last, end) == end - 3; }),
      8);
  // The middle of a face is on the limit surface, so it stays.
  const PolygonMesh finer = Subdivided(made, SubdivisionScheme::kDooSabin, 2);
  for (int f = 0; f < 6; ++f) EXPECT_LT((MiddleOf(finer, f) - MiddleOf(made, f)).norm(), 1e-15);
}

// Quadratic B-splines in both directions: Chaikin's points of Chaikin's points.
TEST(SubdivideMeshTest, DooSabinOfARegularGridIsChaikinTwice) {
  PolygonMesh grid;
  Random random(3);
  grid.vertices.resize(3, 16);
  for (auto column : grid.vertices.colwise()) column = random.Vector();
  for (int y = 0; y < 3; ++y) {
    for (int x = 0; x < 3; ++x) {
      const int v = 4 * y + x;
      grid.AddFace(std::array{v, v + 1, v + 5, v + 4});
    }
  }
  const PolygonMesh made = Subdivided(grid, SubdivisionScheme::kDooSabin, 1);
  const auto along = [&](int y) {
    return 0.75 * grid.vertices.col(4 * y + 1) + 0.25 * grid.vertices.col(4 * y + 2);
  };
  // Corner 0 of the face in the middle is corner 16 of all.
  const Eigen::Vector3d expected = 0.75 * along(1) + 0.25 * along(2);
  EXPECT_LT((made.vertices.col(16) - expected).norm(), 1e-15);
  // The border: 12 edges with two points each behind the 36 corners.
  EXPECT_EQ(made.vertices.cols(), 36 + 24);
  const Eigen::Vector3d border = 0.75 * grid.vertices.col(0) + 0.25 * grid.vertices.col(1);
  EXPECT_LT((made.vertices.colwise() - border).colwise().norm().tail(24).minCoeff(), 1e-15);
}

TEST(SubdivideMeshTest, ButterflyKeepsItsVerticesAndCubics) {
  const PolygonMesh bent = Bent(PolygonsOf(Bipyramid(7)));
  const PolygonMesh made = Subdivided(bent, SubdivisionScheme::kButterfly, 3);
  EXPECT_EQ(made.vertices.leftCols(bent.vertices.cols()), bent.vertices);
  // Where the mesh is regular the 8-point rule reproduces quadratics in the parameters, and so does
  // the 4-point rule on the border.
  PolygonMesh grid = PolygonsOf(Grid(8, 8));
  const auto height = [](const Eigen::Vector3d& p) {
    return 1 + p.x() - 2 * p.y() + p.x() * p.x() - 3 * p.x() * p.y() + 2 * p.y() * p.y();
  };
  for (auto p : grid.vertices.colwise()) p.z() = height(p);
  const PolygonMesh finer = Subdivided(grid, SubdivisionScheme::kButterfly, 1);
  int checked = 0;
  for (const auto& p : finer.vertices.colwise()) {
    const Eigen::Vector2d place = p.head<2>();
    if (place.minCoeff() < 2 / 7.0 || place.maxCoeff() > 5 / 7.0) continue;
    EXPECT_NEAR(p.z(), height(p), 1e-13);
    ++checked;
  }
  EXPECT_EQ(checked, 49);
}

TEST(SubdivideMeshTest, ButterflyBesideIrregularVertices) {
  // Weights of one vertex of valence 3, 4, 5 by the tables of the paper: all others have 6.
  for (const int valence : {3, 4, 5, 8}) {
    // A fan of two rings around vertex 0; the second ring makes the first one regular.
    PolygonMesh fan;
    fan.vertices = Eigen::Matrix3Xd::Zero(3, 1 + 3 * valence);
    for (int i = 0; i < valence; ++i) {
      const int next = (i + 1) % valence, a = 1 + i, b = 1 + next;
      const int spoke = 1 + valence + 2 * i, between = spoke + 1, spoke_b = 1 + valence + 2 * next;
      fan.AddFace(std::array{0, a, b});
      fan.AddFace(std::array{a, spoke, between});
      fan.AddFace(std::array{a, between, b});
      fan.AddFace(std::array{b, between, spoke_b});
    }
    double sum = 0;
    for (int source = 0; source <= valence; ++source) {
      fan.vertices.setZero();
      fan.vertices(0, source) = 1;
      const PolygonMesh made = Subdivided(fan, SubdivisionScheme::kButterfly, 1);
      // The point on the edge from 0 to 1 is the first one behind the vertices.
      const double weight = made.vertices(0, fan.vertices.cols());
      sum += weight;
      const double angle = 2 * std::numbers::pi * (source - 1) / valence;
      const double expected = source == 0    ? 0.75
                              : valence == 3 ? (source == 1 ? 5.0 / 12 : -1.0 / 12)
                              : valence == 4
                                  ? (source == 1   ? 0.375
                                     : source == 3 ? -0.125
                                                   : 0)
                                  : (0.25 + std::cos(angle) + 0.5 * std::cos(2 * angle)) / valence;
      EXPECT_NEAR(weight, expected, 1e-15) << valence << ' ' << source;
    }
    EXPECT_NEAR(sum, 1, 1e-14);
  }
}

TEST(SubdivideMeshTest, Sqrt3HasThePapersWeights) {
  const PolygonMesh bent = Bent(PolygonsOf(Icosahedron()));
  const PolygonMesh made = Subdivided(bent, SubdivisionScheme::kSqrt3, 1);
  EXPECT_EQ(made.vertices.cols(), 12 + 20);
  EXPECT_EQ(made.face_count(), 60);
  const double alpha = (4 - 2 * std::cos(2 * std::numbers::pi / 5)) / 9;
  const Eigen::Vector3d mean = bent.vertices.middleCols(1, 5).rowwise().mean();
  EXPECT_LT((made.vertices.col(0) - (1 - alpha) * bent.vertices.col(0) - alpha * mean).norm(),
            1e-15);
  for (int f = 0; f < 20; ++f) {
    EXPECT_LT((made.vertices.col(12 + f) - MiddleOf(bent, f)).norm(), 1e-15);
  }
  // No edge is left between two old vertices: all of them were flipped.
  for (int f = 0; f < made.face_count(); ++f) {
    const auto face = made.Face(f);
    EXPECT_EQ(std::count_if(face.begin(), face.end(), [](int v) { return v < 12; }), 1);
  }
  EXPECT_EQ(Subdivided(bent, SubdivisionScheme::kSqrt3, 2).face_count(), 180);
}

TEST(SubdivideMeshTest, Sqrt3SplitsTheBorderInThreeEverySecondTime) {
  PolygonMesh grid = PolygonsOf(Grid(4, 4));
  const PolygonMesh once = Subdivided(grid, SubdivisionScheme::kSqrt3, 1);
  EXPECT_EQ(once.face_count(), 3 * 18);
  EXPECT_EQ(once.vertices.leftCols(4), grid.vertices.leftCols(4));
  const PolygonMesh twice = Subdivided(grid, SubdivisionScheme::kSqrt3, 2);
  EXPECT_EQ(twice.face_count(), 9 * 18);
  // The lower border is a line still, with points a third of an edge apart but near its ends.
  std::vector<double> border;
  for (const auto& p : twice.vertices.colwise()) {
    if (std::abs(p.y()) < 1e-15 && p.x() > 0.2 && p.x() < 0.8) border.push_back(p.x());
  }
  std::sort(border.begin(), border.end());
  ASSERT_EQ(border.size(), 6);
  for (int i = 0; i < 6; ++i) EXPECT_NEAR(border[static_cast<size_t>(i)], (2 + i) / 9.0, 0.01);
}

TEST(SubdivideMeshTest, AllKeepTheirTopologyAndFollowAffineMaps) {
  const SubdivisionScheme schemes[] = {SubdivisionScheme::kLoop, SubdivisionScheme::kCatmullClark,
                                       SubdivisionScheme::kDooSabin, SubdivisionScheme::kButterfly,
                                       SubdivisionScheme::kSqrt3};
  Eigen::Affine3d map = Eigen::Affine3d::Identity();
  map.linear() << 1, 2, 0, -1, 1, 3, 0.5, 0, 2;
  map.translation() << 3, -4, 5;
  for (const ControlMesh& mesh : {Torus(5, 4), Grid(4, 5), HalfFan(3), HalfFan(1)}) {
    for (const SubdivisionScheme scheme : schemes) {
      const PolygonMesh given = Bent(PolygonsOf(mesh));
      PolygonMesh moved = given;
      moved.vertices = map * given.vertices;
      const PolygonMesh made = Subdivided(given, scheme, 3);
      EXPECT_LT((map * made.vertices - Subdivided(moved, scheme, 3).vertices).norm(), 1e-11);
      const auto euler = [](const PolygonMesh& m) {
        return m.vertices.cols() - BuildPolygonTopology(m)->edge_count() + m.face_count();
      };
      EXPECT_EQ(euler(made), euler(given));
    }
  }
}

TEST(SubdivideMeshTest, CreasesStaySharpUnderLoop) {
  const PolygonMesh cube = PolygonsOf(Box({0, 0, 0}, {1, 1, 1}));
  SubdivisionTags tags;
  for (int v = 0; v < 8; ++v) tags.corners.push_back(v);
  for (int a = 0; a < 8; ++a) {
    for (const int b : {a | 1, a | 2, a | 4}) {
      if (b > a) tags.creases.push_back({a, b});
    }
  }
  const auto made = SubdivideMesh(cube, SubdivisionScheme::kLoop, 2, tags, RunContext());
  ASSERT_TRUE(made.ok()) << made.status();
  EXPECT_EQ(made->vertices.leftCols(8), cube.vertices);
  EXPECT_LT((made->vertices.array() - 0.5).abs().colwise().maxCoeff().minCoeff(), 0.5 + 1e-15);
  EXPECT_GT((made->vertices.array() - 0.5).abs().colwise().maxCoeff().minCoeff(), 0.5 - 1e-15);
}

TEST(SubdivideMeshTest, WhatCannotBeSubdividedIsRefused) {
  const auto refused = [](const PolygonMesh& mesh, SubdivisionScheme scheme, int levels,
                          const SubdivisionTags& tags = {}) {
    const auto made = SubdivideMesh(mesh, scheme, levels, tags, RunContext());
    EXPECT_FALSE(made.ok());
    return std::string(made.status().message());
  };
  EXPECT_THAT(refused(Cube(false), SubdivisionScheme::kLoop, 1), HasSubstr("triangles alone"));
  EXPECT_THAT(refused(Cube(false), SubdivisionScheme::kCatmullClark, 9), HasSubstr("[0, 8]"));
  EXPECT_THAT(refused(PolygonsOf(Torus(200, 200)), SubdivisionScheme::kButterfly, 8),
              HasSubstr("at most"));
  EXPECT_THAT(refused(Cube(false), SubdivisionScheme::kDooSabin, 1, {{}, {1}}),
              HasSubstr("no creases"));
  PolygonMesh mesh = Cube(false);
  mesh.AddFace(std::array{0, 2, 3, 1});
  EXPECT_THAT(refused(mesh, SubdivisionScheme::kCatmullClark, 1), HasSubstr("two faces"));
  mesh = Cube(false);
  mesh.corners[0] = 8;
  EXPECT_THAT(refused(mesh, SubdivisionScheme::kCatmullClark, 1), HasSubstr("names vertex 8"));
  mesh.corners[0] = 2;
  EXPECT_THAT(refused(mesh, SubdivisionScheme::kCatmullClark, 1), HasSubstr("vertex 2 twice"));
  // Two tetrahedra that share a vertex.
  PolygonMesh bow = PolygonsOf(Tetrahedron());
  bow.vertices.conservativeResize(3, 7);
  for (int v = 4; v < 7; ++v) bow.vertices.col(v) = 3 * bow.vertices.col(v - 3);
  const Eigen::Matrix3Xi faces = Tetrahedron().faces;
  for (const auto& face : faces.colwise()) {
    std::array<int, 3> other;
    for (size_t k = 0; k < 3; ++k) {
      const int v = face[static_cast<Eigen::Index>(k)];
      other[k] = v == 0 ? 0 : v + 3;
    }
    bow.AddFace(other);
  }
  EXPECT_THAT(refused(bow, SubdivisionScheme::kLoop, 1), HasSubstr("vertex 0 hang together"));
  bow = Cube(false);
  bow.vertices.conservativeResize(3, 9);
  bow.vertices.col(8).setZero();
  EXPECT_THAT(refused(bow, SubdivisionScheme::kDooSabin, 1), HasSubstr("vertex 8 belongs"));
  bow.vertices.col(8).setConstant(std::numeric_limits<double>::quiet_NaN());
  EXPECT_THAT(refused(bow, SubdivisionScheme::kDooSabin, 1), HasSubstr("not finite"));
  EXPECT_FALSE(SchemeNamed("midpoint").ok());
  EXPECT_EQ(*SchemeNamed("sqrt3"), SubdivisionScheme::kSqrt3);
}

}  // namespace
}  // namespace rilievo::testing
