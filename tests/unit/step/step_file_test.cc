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
#include <filesystem>
#include <fstream>
#include <iterator>
#include <numbers>
#include <string>
#include <utility>

#include "client/step/step_writer.h"
#include "core/bicubic/bicubic_shell.h"
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
    file_.path = (folder_ / "a.step").string();
    file_.name = "a";
    file_.program = "a test";
    file_.tolerance = 1e-7;
  }
  ~StepFileTest() override { fs::remove_all(folder_); }

  void Write(const BicubicShell& shell) const {
    std::string problem;
    RilievoWriteStep(shell, file_, &problem);
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
    EXPECT_EQ(reader.ReadFile(file_.path.c_str()), IFSelect_RetDone);
    reader.TransferRoots();
    return reader.OneShape();
  }

  std::string Content() const {
    std::ifstream in(file_.path, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
  }

  fs::path folder_;
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

// The largest distance of places on the faces from the surface, as triangles of a fine level.
double LargestDistance(const TopoDS_Shape& shape, const DisplacedSurface& surface) {
  constexpr int64_t kMostTriangles = 100'000;
  int level = surface.max_level;
  while (surface.control_mesh.faces.cols() << 2 * (level + 1) <= kMostTriangles) ++level;
  const auto refinement = RefineTopology(surface.control_mesh, level, RunContext());
  LimitSurface limit =
      *EvaluateLimit(*refinement, surface.control_mesh.vertices, level, RunContext());
  const std::vector<float> heights = HeightsAtLevel(surface, *refinement, level);
  for (Eigen::Index v = 0; v < limit.positions.cols(); ++v) {
    limit.positions.col(v) = surface.frame.ScanFromUnit(
        limit.positions.col(v) + double{heights[static_cast<size_t>(v)]} * limit.normals.col(v));
  }
  const auto tree =
      ClosestPointTree::Build(limit.positions, refinement->levels.back().faces, RunContext());
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

TEST_F(StepFileTest, ClosedSurfacesAreValidSolids) {
  testing::Random random(5);
  const std::vector<std::pair<std::string, ControlMesh>> meshes = {
      {"cube of quads", testing::QuadMeshes().front().mesh},
      {"icosahedron", testing::Icosahedron()},
      {"sharp cube of triangles", testing::SharpCube()},
      {"sharp cube of quads", testing::InQuads(testing::SharpCube(), random)}};
  for (const auto& [name, mesh] : meshes) {
    const DisplacedSurface surface = testing::WithRelief(mesh, 3, 0.01);
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

// A hollow cube: the inner one is turned inwards.
TEST_F(StepFileTest, WhatIsTurnedInwardsIsAVoid) {
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
  Write(surface);
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

TEST_F(StepFileTest, AFolderThatIsNotThereIsTold) {
  file_.path = (folder_ / "none" / "a.step").string();
  const auto shell =
      FitBicubicShell(testing::WithRelief(testing::Torus(4, 4), 0, 0), {}, RunContext());
  ASSERT_TRUE(shell.ok()) << shell.status();
  std::string problem;
  RilievoWriteStep(*shell, file_, &problem);
  EXPECT_THAT(problem, ::testing::HasSubstr("cannot be written"));
}

}  // namespace
}  // namespace rilievo
