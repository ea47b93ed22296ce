// STEP files as Open CASCADE reads them back.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <BRepAdaptor_Surface.hxx>
#include <BRepCheck_Analyzer.hxx>
#include <BRepGProp.hxx>
#include <BRep_Tool.hxx>
#include <Eigen/Geometry>
#include <GProp_GProps.hxx>
#include <Message.hxx>
#include <Message_Messenger.hxx>
#include <Message_Printer.hxx>
#include <STEPControl_Reader.hxx>
#include <ShapeAnalysis_FreeBounds.hxx>
#include <TopExp.hxx>
#include <TopExp_Explorer.hxx>
#include <TopTools_IndexedMapOfShape.hxx>
#include <TopoDS.hxx>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <numbers>
#include <sstream>
#include <stop_token>
#include <string>
#include <utility>
#include <vector>

#include "client/step/step_writer.h"
#include "core/bicubic/bicubic_shell.h"
#include "core/evaluate/displaced_evaluator.h"
#include "core/surface/closest_point_tree.h"
#include "tests/unit/evaluate/relief_surfaces.h"
#include "tests/unit/loop/quad_meshes.h"

extern "C" rilievo::WriteStepFunction RilievoWriteStep;

namespace rilievo {
namespace {

namespace fs = std::filesystem;

constexpr double kTolerance = 5e-4;

class StepFileTest : public ::testing::Test {
 protected:
  StepFileTest() {
    std::string name = (fs::temp_directory_path() / "rilievo-step-XXXXXX").string();
    folder_ = mkdtemp(name.data());
    path_ = (folder_ / "a.step").string();
    file_.name = "a";
    file_.program = "a test";
    file_.tolerance = 1e-7;
  }
  ~StepFileTest() override { fs::remove_all(folder_); }

  void Write(const BicubicShell& shell) const {
    std::ofstream out(path_, std::ios::binary);
    std::string problem;
    RilievoWriteStep(shell, file_, out, &problem);
    ASSERT_EQ(problem, "");
  }

  void Write(const DisplacedSurface& surface) const {
    const auto shell = FitBicubicShell(surface, {.tolerance = kTolerance}, RunContext());
    ASSERT_TRUE(shell.ok()) << shell.status();
    EXPECT_LE(shell->error, kTolerance);
    Write(*shell);
  }

  TopoDS_Shape Read() const {
    Message::DefaultMessenger()->RemovePrinters(STANDARD_TYPE(Message_Printer));
    STEPControl_Reader reader;
    EXPECT_EQ(reader.ReadFile(path_.c_str()), IFSelect_RetDone);
    reader.TransferRoots();
    return reader.OneShape();
  }

  std::string Content() const {
    std::ifstream in(path_, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
  }

  fs::path folder_;
  std::string path_;
  StepFile file_;
};

int Count(const TopoDS_Shape& shape, TopAbs_ShapeEnum kind) {
  TopTools_IndexedMapOfShape found;
  TopExp::MapShapes(shape, kind, found);
  return found.Extent();
}

int FreeEdges(const TopoDS_Shape& shape) {
  int count = 0;
  for (TopExp_Explorer shells(shape, TopAbs_SHELL); shells.More(); shells.Next()) {
    const ShapeAnalysis_FreeBounds bounds(shells.Current());
    count +=
        Count(bounds.GetClosedWires(), TopAbs_EDGE) + Count(bounds.GetOpenWires(), TopAbs_EDGE);
  }
  return count;
}

double VolumeOf(const TopoDS_Shape& shape) {
  GProp_GProps properties;
  BRepGProp::VolumeProperties(shape, properties);
  return properties.Mass();
}

void ExpectClosedSolid(const TopoDS_Shape& shape, const std::string& name) {
  EXPECT_TRUE(BRepCheck_Analyzer(shape).IsValid()) << name;
  EXPECT_GE(Count(shape, TopAbs_SOLID), 1) << name;
  EXPECT_EQ(FreeEdges(shape), 0) << name;
  for (TopExp_Explorer shells(shape, TopAbs_SHELL); shells.More(); shells.Next()) {
    EXPECT_TRUE(BRep_Tool::IsClosed(shells.Current())) << name;
  }
}

// The largest distance of places on the faces from the surface, as triangles with corners on it.
double LargestDistance(const TopoDS_Shape& shape, const DisplacedSurface& surface) {
  constexpr int kAlongSide = 48;
  const auto evaluator = DisplacedEvaluator::Build(surface, RunContext());
  std::vector<Eigen::Vector3d> points;
  std::vector<Eigen::Vector3i> triangles;
  for (int f = 0; f < evaluator->face_count(); ++f) {
    for (int j = 0; j <= kAlongSide; ++j) {
      for (int i = 0; i + j <= kAlongSide; ++i) {
        const auto here = static_cast<int>(points.size());
        const int up = here + kAlongSide + 1 - j;  // the point above
        const double u = static_cast<double>(i) / kAlongSide,
                     v = static_cast<double>(j) / kAlongSide;
        points.push_back(evaluator->At(f, u, v, JetOrder::kPosition).position);
        if (i + j < kAlongSide) triangles.emplace_back(here, here + 1, up);
        if (i + j + 1 < kAlongSide) triangles.emplace_back(here + 1, up + 1, up);
      }
    }
  }
  Eigen::Matrix3Xd vertices(3, static_cast<Eigen::Index>(points.size()));
  for (size_t v = 0; v < points.size(); ++v) {
    vertices.col(static_cast<Eigen::Index>(v)) = points[v];
  }
  Eigen::Matrix3Xi faces_of(3, static_cast<Eigen::Index>(triangles.size()));
  for (size_t t = 0; t < triangles.size(); ++t) {
    faces_of.col(static_cast<Eigen::Index>(t)) = triangles[t];
  }
  const auto tree = ClosestPointTree::Build(vertices, faces_of, RunContext());
  double largest = 0;
  for (TopExp_Explorer faces(shape, TopAbs_FACE); faces.More(); faces.Next()) {
    const BRepAdaptor_Surface patch(TopoDS::Face(faces.Current()));
    constexpr int kPlaces = 6;
    for (int i = 0; i <= kPlaces; ++i) {
      for (int j = 0; j <= kPlaces; ++j) {
        const auto between = [&](double first, double last, int k) {
          return first + (last - first) * k / kPlaces;
        };
        const gp_Pnt point =
            patch.Value(between(patch.FirstUParameter(), patch.LastUParameter(), i),
                        between(patch.FirstVParameter(), patch.LastVParameter(), j));
        const double squared = tree->Closest({point.X(), point.Y(), point.Z()}).squared_distance;
        largest = std::max(largest, std::sqrt(squared));
      }
    }
  }
  return largest / surface.frame.diagonal;
}

// A hollow cube, the inner one turned inwards, and a cube beside it.
DisplacedSurface HollowCube() {
  const ControlMesh outer = testing::SharpCube();
  ControlMesh inner = outer;
  inner.vertices *= 0.5;
  inner.faces.row(1).swap(inner.faces.row(2));
  ControlMesh beside = outer;
  beside.vertices.colwise() += Eigen::Vector3d(4, 0, 0);
  ControlMesh both = testing::Union(testing::Union(outer, inner), beside);
  for (int part = 0; part < 3; ++part) {
    for (const Crease& crease : outer.creases) {
      both.creases.push_back({crease.a + 8 * part, crease.b + 8 * part});
    }
  }
  DisplacedSurface surface = testing::WithRelief(both, 0, 0);
  surface.frame = {};
  return surface;
}

TEST_F(StepFileTest, ClosedSurfacesAreValidSolids) {
  testing::Random random(5);
  const std::vector<std::pair<std::string, ControlMesh>> meshes = {
      {"cube of quads", testing::QuadMeshes().front().mesh},
      {"icosahedron", testing::Icosahedron()},
      {"sharp cube of triangles", testing::SharpCube()},
      {"sharp cube of quads", testing::InQuads(testing::SharpCube(), random)}};
  for (const auto& [name, mesh] : meshes) {
    const DisplacedSurface surface = testing::WithRelief(mesh, 2, 0.005);
    Write(surface);
    const TopoDS_Shape shape = Read();
    ExpectClosedSolid(shape, name);
    EXPECT_EQ(Count(shape, TopAbs_FACE),
              mesh.quads() ? mesh.faces.cols() / 2 : 3 * mesh.faces.cols())
        << name;
    EXPECT_GT(VolumeOf(shape), 0) << name;
    EXPECT_LE(LargestDistance(shape, surface), kTolerance) << name;
  }
}

void Move(const Eigen::Vector3d& by, BicubicShell& shell) {
  shell.vertices.colwise() += by;
  for (BicubicShell::Edge& edge : shell.edges) edge.control.colwise() += by;
  for (BicubicShell::Patch& patch : shell.patches) patch.control.colwise() += by;
}

// The nets of control points of neighbours with other spans leave gaps, the patches none.
TEST_F(StepFileTest, ClosedSurfacesAreSolidsFarFromTheOrigin) {
  DisplacedSurface surface = testing::WithRelief(testing::Torus(5, 4), 2, 0.05);
  surface.frame = {Eigen::Vector3d::Zero(), 1};
  const auto here = FitBicubicShell(surface, {.tolerance = 0.01}, RunContext());
  ASSERT_TRUE(here.ok()) << here.status();
  const auto cubes = FitBicubicShell(HollowCube(), {}, RunContext());
  ASSERT_TRUE(cubes.ok()) << cubes.status();
  for (const double size : {1e5, -1e5}) {
    BicubicShell moved = *here;
    Move({size, 0.4 * size, 0.7 * size}, moved);
    Write(moved);
    const TopoDS_Shape torus = Read();
    ExpectClosedSolid(torus, "torus");
    EXPECT_EQ(Count(torus, TopAbs_SHELL), 1);
    moved = *cubes;
    Move({size, 0.4 * size, 0.7 * size}, moved);
    Write(moved);
    const TopoDS_Shape shape = Read();
    ExpectClosedSolid(shape, "hollow cube");
    EXPECT_EQ(Count(shape, TopAbs_SOLID), 2);
    EXPECT_EQ(Count(shape, TopAbs_SHELL), 3);
  }
}

// 100 m in map coordinates: the last of 13 digits is a micrometre.
TEST_F(StepFileTest, EdgesAreWithinWhatTheDigitsOfAFileTell) {
  DisplacedSurface surface = testing::WithRelief(testing::Bipyramid(4), 0, 0);
  surface.frame = {{5.123456789e8, 4.612345678e9, 2.345678e5}, 1e5};
  file_.tolerance = 1e-4;
  Write(surface);
  const TopoDS_Shape shape = Read();
  ExpectClosedSolid(shape, "octahedron");
  const std::string text = Content(), name = "UNCERTAINTY_MEASURE_WITH_UNIT(LENGTH_MEASURE(";
  const double told = std::strtod(text.c_str() + text.find(name) + name.size(), nullptr);
  // A reader enlarges what is too small.
  EXPECT_LE(BRep_Tool::MaxTolerance(shape, TopAbs_EDGE), told);
  EXPECT_LE(BRep_Tool::MaxTolerance(shape, TopAbs_VERTEX), told);
}

TEST_F(StepFileTest, OpenSurfacesAreShells) {
  const ControlMesh mesh = testing::Grid(4, 4);
  Write(testing::WithRelief(mesh, 1, 0.002));
  const TopoDS_Shape shape = Read();
  EXPECT_TRUE(BRepCheck_Analyzer(shape).IsValid());
  EXPECT_EQ(Count(shape, TopAbs_SOLID), 0);
  EXPECT_EQ(Count(shape, TopAbs_SHELL), 1);
  const int boundary_edges = static_cast<int>(
      SummarizeTopology(mesh.faces, static_cast<int>(mesh.vertices.cols())).boundary_edges);
  EXPECT_EQ(FreeEdges(shape), 2 * boundary_edges);
}

TEST_F(StepFileTest, WhatIsTurnedInwardsIsAVoid) {
  Write(HollowCube());
  const TopoDS_Shape shape = Read();
  ExpectClosedSolid(shape, "hollow cube");
  EXPECT_EQ(Count(shape, TopAbs_SOLID), 2);
  EXPECT_EQ(Count(shape, TopAbs_SHELL), 3);
  EXPECT_NEAR(VolumeOf(shape), 8 - 1 + 8, 1e-6);
}

TEST_F(StepFileTest, TheSamePatchesGiveTheSameBytes) {
  const DisplacedSurface surface = testing::WithRelief(testing::Torus(4, 4), 1, 0.002);
  Write(surface);
  const std::string once = Content();
  EXPECT_EQ(once.substr(0, 13), "ISO-10303-21;");
  EXPECT_THAT(once.substr(0, 1000), ::testing::HasSubstr("a test"));
  EXPECT_THAT(once.substr(0, 1000), ::testing::HasSubstr("PRODUCT('a','a'"));
  Write(surface);
  EXPECT_TRUE(Content() == once);
}

TEST_F(StepFileTest, TextsAreEncoded) {
  file_.name = "T\u00fcr's \\ \u03c0 \U0001d11e\xff";
  Write(testing::WithRelief(testing::Bipyramid(3), 0, 0));
  const std::string name = R"('T\X\FCr''s \X\5C \X2\03C0\X0\ \X4\0001D11E\X0\\X\FF')";
  EXPECT_TRUE(Content().find(name) != std::string::npos) << Content().substr(0, 2000);
  EXPECT_TRUE(Content().find("Author") == std::string::npos);
  // An overlong form, a surrogate, and what is beyond the last code point.
  for (const auto& [bytes, encoded] :
       std::map<std::string, std::string>{{"\xe0\x82\x80", R"('\X\E0\X\82\X\80')"},
                                          {"\xed\xa0\x80", R"('\X\ED\X\A0\X\80')"},
                                          {"\xf4\x90\x80\x80", R"('\X\F4\X\90\X\80\X\80')"},
                                          {"\xf5\x80\x80\x80", R"('\X\F5\X\80\X\80\X\80')"}}) {
    file_.name = bytes;
    Write(testing::WithRelief(testing::Bipyramid(3), 0, 0));
    EXPECT_TRUE(Content().find(encoded) != std::string::npos) << encoded;
  }
}

TEST_F(StepFileTest, IsStopped) {
  const auto shell =
      FitBicubicShell(testing::WithRelief(testing::Torus(4, 4), 0, 0), {}, RunContext());
  ASSERT_TRUE(shell.ok()) << shell.status();
  std::stop_source source;
  file_.stop = source.get_token();
  source.request_stop();
  std::ostringstream out;
  std::string problem;
  RilievoWriteStep(*shell, file_, out, &problem);
  EXPECT_EQ(problem, "stopped");
  EXPECT_EQ(out.str(), "");
}

}  // namespace
}  // namespace rilievo
