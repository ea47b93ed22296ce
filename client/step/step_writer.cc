#include "client/step/step_writer.h"

#include <APIHeaderSection_MakeHeader.hxx>
#include <BRepClass3d_SolidClassifier.hxx>
#include <BRep_Builder.hxx>
#include <Eigen/Geometry>
#include <Geom2d_Line.hxx>
#include <Geom_BSplineCurve.hxx>
#include <Geom_BSplineSurface.hxx>
#include <Interface_Static.hxx>
#include <Message.hxx>
#include <Message_Messenger.hxx>
#include <Message_Printer.hxx>
#include <STEPControl_Controller.hxx>
#include <STEPControl_Writer.hxx>
#include <Standard_Failure.hxx>
#include <StepBasic_Product.hxx>
#include <StepData_StepModel.hxx>
#include <TColStd_Array1OfInteger.hxx>
#include <TColStd_Array1OfReal.hxx>
#include <TColgp_Array1OfPnt.hxx>
#include <TColgp_Array2OfPnt.hxx>
#include <TCollection_HAsciiString.hxx>
#include <TopoDS.hxx>
#include <TopoDS_Compound.hxx>
#include <TopoDS_Edge.hxx>
#include <TopoDS_Face.hxx>
#include <TopoDS_Shell.hxx>
#include <TopoDS_Solid.hxx>
#include <TopoDS_Vertex.hxx>
#include <TopoDS_Wire.hxx>
#include <algorithm>
#include <array>
#include <exception>
#include <numeric>
#include <vector>

namespace rilievo {
namespace {

constexpr int kDegree = 3;

gp_Pnt PointOf(const Eigen::Vector3d& point) { return {point.x(), point.y(), point.z()}; }

struct Knots {
  explicit Knots(int spans) : values(1, spans + 1), multiplicities(1, spans + 1) {
    for (int i = 0; i <= spans; ++i) {
      values.SetValue(i + 1, static_cast<double>(i) / spans);
      multiplicities.SetValue(i + 1, i == 0 || i == spans ? kDegree + 1 : 1);
    }
  }
  TColStd_Array1OfReal values;
  TColStd_Array1OfInteger multiplicities;
};

Handle(Geom_BSplineCurve) CurveOf(const BicubicShell::Edge& edge) {
  const int count = static_cast<int>(edge.control.cols());
  TColgp_Array1OfPnt control(1, count);
  for (int i = 0; i < count; ++i) control.SetValue(i + 1, PointOf(edge.control.col(i)));
  const Knots knots(count - kDegree);
  return new Geom_BSplineCurve(control, knots.values, knots.multiplicities, kDegree);
}

Handle(Geom_BSplineSurface) SurfaceOf(const BicubicShell::Patch& patch) {
  const int rows = patch.spans[0] + kDegree, columns = patch.spans[1] + kDegree;
  TColgp_Array2OfPnt control(1, rows, 1, columns);
  for (int j = 0; j < columns; ++j) {
    for (int i = 0; i < rows; ++i) {
      control.SetValue(i + 1, j + 1, PointOf(patch.control.col(i + rows * j)));
    }
  }
  const Knots along_s(patch.spans[0]), along_t(patch.spans[1]);
  return new Geom_BSplineSurface(control, along_s.values, along_t.values, along_s.multiplicities,
                                 along_t.multiplicities, kDegree, kDegree);
}

// Six times the volume between the origin and the control points.
double VolumeUnder(const BicubicShell::Patch& patch) {
  const int rows = patch.spans[0] + kDegree, columns = patch.spans[1] + kDegree;
  const Eigen::Matrix3Xd& control = patch.control;
  const auto volume = [&](int a, int b, int c) {
    return control.col(a).dot(control.col(b).cross(control.col(c)));
  };
  double sum = 0;
  for (int j = 0; j + 1 < columns; ++j) {
    for (int i = 0; i + 1 < rows; ++i) {
      const int at = i + rows * j;
      sum += volume(at, at + 1, at + rows + 1) + volume(at, at + rows + 1, at + rows);
    }
  }
  return sum;
}

class ShapeOfShell {
 public:
  ShapeOfShell(const BicubicShell& shell, double tolerance)
      : shell_(shell), tolerance_(tolerance), uses_(shell.edges.size()) {}

  TopoDS_Shape Run() {
    MakeEdges();
    MakeFaces();
    return Assemble();
  }

 private:
  struct Component {
    TopoDS_Shell shell;
    double volume = 0;
    bool closed = true;
    Eigen::Vector3d point;
  };

  void MakeEdges() {
    for (const auto& position : shell_.vertices.colwise()) {
      builder_.MakeVertex(vertices_.emplace_back(), PointOf(position), tolerance_);
    }
    for (const BicubicShell::Edge& edge : shell_.edges) {
      TopoDS_Edge& made = edges_.emplace_back();
      builder_.MakeEdge(made, CurveOf(edge), tolerance_);
      builder_.Add(made, vertices_[edge.from].Oriented(TopAbs_FORWARD));
      builder_.Add(made, vertices_[edge.to].Oriented(TopAbs_REVERSED));
      builder_.Range(made, 0, 1);
      builder_.SameRange(made, true);
      builder_.SameParameter(made, true);
    }
  }

  void MakeFaces() {
    static constexpr std::array<std::array<double, 2>, 4> kCorners = {
        {{0, 0}, {1, 0}, {1, 1}, {0, 1}}};
    for (const BicubicShell::Patch& patch : shell_.patches) {
      TopoDS_Face& face = faces_.emplace_back();
      builder_.MakeFace(face, SurfaceOf(patch), tolerance_);
      TopoDS_Wire wire;
      builder_.MakeWire(wire);
      for (size_t i = 0; i < 4; ++i) {
        const auto edge = static_cast<size_t>(patch.edges[i]);
        const auto& first = kCorners[patch.forward[i] ? i : (i + 1) % 4];
        const auto& last = kCorners[patch.forward[i] ? (i + 1) % 4 : i];
        const Handle(Geom2d_Line) line = new Geom2d_Line(
            gp_Pnt2d(first[0], first[1]), gp_Dir2d(last[0] - first[0], last[1] - first[1]));
        builder_.UpdateEdge(edges_[edge], line, face, tolerance_);
        builder_.Range(edges_[edge], face, 0, 1);
        builder_.Add(wire,
                     edges_[edge].Oriented(patch.forward[i] ? TopAbs_FORWARD : TopAbs_REVERSED));
        ++uses_[edge];
      }
      wire.Closed(true);
      builder_.Add(face, wire);
    }
  }

  // By patch: the first patch that edges lead to from it.
  std::vector<size_t> Roots() const {
    std::vector<size_t> parent(shell_.patches.size());
    std::iota(parent.begin(), parent.end(), size_t{0});
    const auto root = [&](size_t p) {
      while (parent[p] != p) p = parent[p] = parent[parent[p]];
      return p;
    };
    std::vector<size_t> first(shell_.edges.size(), shell_.patches.size());
    for (size_t p = 0; p < shell_.patches.size(); ++p) {
      for (const int edge : shell_.patches[p].edges) {
        size_t& other = first[static_cast<size_t>(edge)];
        if (other == shell_.patches.size()) {
          other = p;
          continue;
        }
        const auto [low, high] = std::minmax({root(other), root(p)});
        parent[high] = low;
      }
    }
    for (size_t p = 0; p < parent.size(); ++p) parent[p] = root(p);
    return parent;
  }

  std::vector<Component> Components() {
    const std::vector<size_t> roots = Roots();
    std::vector<size_t> number(roots.size());
    std::vector<Component> components;
    for (size_t p = 0; p < roots.size(); ++p) {
      const BicubicShell::Patch& patch = shell_.patches[p];
      if (roots[p] == p) {
        number[p] = components.size();
        builder_.MakeShell(components.emplace_back().shell);
        components.back().point = patch.control.col(0);
      }
      Component& component = components[number[roots[p]]];
      builder_.Add(component.shell, faces_[p]);
      component.volume += VolumeUnder(patch);
      for (const int edge : patch.edges) {
        component.closed = component.closed && uses_[static_cast<size_t>(edge)] == 2;
      }
    }
    for (Component& component : components) component.shell.Closed(component.closed);
    return components;
  }

  // The smallest solid around a place, or -1.
  int SolidAround(const Eigen::Vector3d& point, const std::vector<TopoDS_Solid>& solids,
                  const std::vector<double>& volumes) const {
    int best = -1;
    for (size_t s = 0; s < solids.size(); ++s) {
      if (best >= 0 && volumes[s] >= volumes[static_cast<size_t>(best)]) continue;
      BRepClass3d_SolidClassifier classifier(solids[s], PointOf(point), tolerance_);
      if (classifier.State() == TopAbs_IN) best = static_cast<int>(s);
    }
    return best;
  }

  TopoDS_Shape Assemble() {
    const std::vector<Component> components = Components();
    std::vector<TopoDS_Solid> solids;
    std::vector<double> volumes;
    for (const Component& component : components) {
      if (!component.closed || component.volume <= 0) continue;
      TopoDS_Solid& solid = solids.emplace_back();
      builder_.MakeSolid(solid);
      builder_.Add(solid, component.shell);
      volumes.push_back(component.volume);
    }
    std::vector<TopoDS_Shape> alone;
    std::vector<std::vector<TopoDS_Shell>> voids(solids.size());
    for (const Component& component : components) {
      if (component.closed && component.volume > 0) continue;
      const int around = component.closed ? SolidAround(component.point, solids, volumes) : -1;
      if (around < 0) {
        alone.push_back(component.shell);
      } else {
        voids[static_cast<size_t>(around)].push_back(component.shell);
      }
    }
    for (size_t s = 0; s < solids.size(); ++s) {
      for (const TopoDS_Shell& inner : voids[s]) builder_.Add(solids[s], inner);
    }
    alone.insert(alone.begin(), solids.begin(), solids.end());
    if (alone.size() == 1) return alone.front();
    TopoDS_Compound compound;
    builder_.MakeCompound(compound);
    for (const TopoDS_Shape& shape : alone) builder_.Add(compound, shape);
    return compound;
  }

  const BicubicShell& shell_;
  const double tolerance_;
  BRep_Builder builder_;
  std::vector<TopoDS_Vertex> vertices_;
  std::vector<TopoDS_Edge> edges_;
  std::vector<TopoDS_Face> faces_;
  std::vector<int> uses_;  // of each edge, by patches
};

Handle(TCollection_HAsciiString) TextOf(const std::string& text) {
  return new TCollection_HAsciiString(text.c_str());
}

std::string WriteShape(const TopoDS_Shape& shape, const StepFile& file) {
  // It would tell the standard output what it does.
  Message::DefaultMessenger()->RemovePrinters(STANDARD_TYPE(Message_Printer));
  STEPControl_Controller::Init();
  Interface_Static::SetCVal("write.step.unit", "MM");
  STEPControl_Writer writer;
  writer.SetTolerance(file.tolerance);
  if (writer.Transfer(shape, STEPControl_AsIs) != IFSelect_RetDone) {
    return "Open CASCADE cannot say this surface in STEP";
  }
  // It counts the products that a process makes, in their names.
  const Handle(StepData_StepModel) model = writer.Model();
  for (int i = 1; i <= model->NbEntities(); ++i) {
    const Handle(StepBasic_Product) product = Handle(StepBasic_Product)::DownCast(model->Value(i));
    if (product.IsNull()) continue;
    product->SetName(TextOf(file.name));
    product->SetId(TextOf(file.name));
  }
  APIHeaderSection_MakeHeader header(model);
  header.SetName(TextOf(file.name));
  header.SetTimeStamp(TextOf("1970-01-01T00:00:00"));  // the same bytes each time
  header.SetOriginatingSystem(TextOf(file.program));
  if (writer.Write(file.path.c_str()) != IFSelect_RetDone) return "the file cannot be written";
  return "";
}

}  // namespace
}  // namespace rilievo

extern "C" const char RilievoStepVersion[] = RILIEVO_VERSION;

extern "C" void RilievoWriteStep(const rilievo::BicubicShell& shell, const rilievo::StepFile& file,
                                 std::string* problem) {
  try {
    *problem = rilievo::WriteShape(rilievo::ShapeOfShell(shell, file.tolerance).Run(), file);
  } catch (const Standard_Failure& failure) {
    *problem = std::string("Open CASCADE: ") + failure.GetMessageString();
  } catch (const std::exception& failure) {
    *problem = failure.what();
  }
}
