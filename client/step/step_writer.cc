#include "client/step/step_writer.h"

#include <APIHeaderSection_MakeHeader.hxx>
#include <BRepBndLib.hxx>
#include <BRepClass3d_SolidClassifier.hxx>
#include <BRepGProp.hxx>
#include <BRep_Builder.hxx>
#include <Bnd_Box.hxx>
#include <Eigen/Geometry>
#include <GProp_GProps.hxx>
#include <Geom2d_Line.hxx>
#include <Geom_BSplineCurve.hxx>
#include <Geom_BSplineSurface.hxx>
#include <Interface_Static.hxx>
#include <Message.hxx>
#include <Message_Messenger.hxx>
#include <Message_Printer.hxx>
#include <Message_ProgressIndicator.hxx>
#include <Message_ProgressRange.hxx>
#include <STEPControl_Controller.hxx>
#include <STEPControl_Writer.hxx>
#include <Standard_Failure.hxx>
#include <StepBasic_Product.hxx>
#include <StepData_Protocol.hxx>
#include <StepData_StepModel.hxx>
#include <StepData_StepWriter.hxx>
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
#include <XSControl_WorkSession.hxx>
#include <algorithm>
#include <array>
#include <exception>
#include <memory>
#include <numeric>
#include <utility>
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

// How far apart one place may be read back from two of its points: Open CASCADE writes 13 digits,
// so each of their coordinates moves by up to 5e-13 of its size.
double RoundingOf(const BicubicShell& shell) {
  constexpr double kOfLargest = 2e-12;
  double largest = 0;
  for (const BicubicShell::Patch& patch : shell.patches) {
    largest = std::max(largest, patch.control.cwiseAbs().maxCoeff());
  }
  return kOfLargest * largest;
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
    double volume = 0;  // of a closed one; negative where it is turned inwards
    bool closed = true;
    gp_Pnt point;  // on it
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
        components.back().point = PointOf(patch.control.col(0));
      }
      Component& component = components[number[roots[p]]];
      builder_.Add(component.shell, faces_[p]);
      for (const int edge : patch.edges) {
        component.closed = component.closed && uses_[static_cast<size_t>(edge)] == 2;
      }
    }
    for (Component& component : components) {
      component.shell.Closed(component.closed);
      if (!component.closed) continue;
      // About a point of its own: about the origin a place far away would take its digits.
      GProp_GProps properties(component.point);
      BRepGProp::VolumeProperties(component.shell, properties);
      component.volume = properties.Mass();
    }
    return components;
  }

  // A solid that voids are sought for.
  struct Body {
    TopoDS_Solid solid;
    double volume = 0;
    Bnd_Box box;
    std::unique_ptr<BRepClass3d_SolidClassifier> classifier;  // once its box holds a point
    std::vector<TopoDS_Shell> voids;
  };

  // The smallest solid around a place, or none.
  Body* SolidAround(const gp_Pnt& point, std::vector<Body>& bodies) const {
    Body* best = nullptr;
    for (Body& body : bodies) {
      if (body.box.IsOut(point) || (best != nullptr && body.volume >= best->volume)) continue;
      if (body.classifier == nullptr) {
        body.classifier = std::make_unique<BRepClass3d_SolidClassifier>(body.solid);
      }
      body.classifier->Perform(point, tolerance_);
      if (body.classifier->State() == TopAbs_IN) best = &body;
    }
    return best;
  }

  TopoDS_Shape Assemble() {
    const std::vector<Component> components = Components();
    std::vector<Body> bodies;
    for (const Component& component : components) {
      if (!component.closed || component.volume <= 0) continue;
      Body& body = bodies.emplace_back();
      builder_.MakeSolid(body.solid);
      builder_.Add(body.solid, component.shell);
      body.volume = component.volume;
      BRepBndLib::Add(body.solid, body.box);
    }
    std::vector<TopoDS_Shape> alone;
    for (const Component& component : components) {
      if (component.closed && component.volume > 0) continue;
      Body* const around = component.closed ? SolidAround(component.point, bodies) : nullptr;
      if (around == nullptr) {
        alone.push_back(component.shell);
      } else {
        around->voids.push_back(component.shell);
      }
    }
    std::vector<TopoDS_Shape> shapes;
    for (const Body& body : bodies) {
      TopoDS_Solid solid = body.solid;
      for (const TopoDS_Shell& inner : body.voids) builder_.Add(solid, inner);
      shapes.push_back(solid);
    }
    shapes.insert(shapes.end(), alone.begin(), alone.end());
    if (shapes.size() == 1) return shapes.front();
    TopoDS_Compound compound;
    builder_.MakeCompound(compound);
    for (const TopoDS_Shape& shape : shapes) builder_.Add(compound, shape);
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

std::string Hexadecimal(char32_t number, int digits) {
  std::string text(static_cast<size_t>(digits), '0');
  for (auto digit = text.rbegin(); digit != text.rend(); ++digit, number /= 16) {
    *digit = "0123456789ABCDEF"[number % 16];
  }
  return text;
}

// The code point at `*place`, which moves behind it; a byte that begins none stands for itself.
char32_t TakeCodePoint(const std::string& text, size_t* place) {
  const auto byte = [&](size_t i) { return static_cast<unsigned char>(text[i]); };
  const char32_t first = byte((*place)++);
  const size_t more = first < 0xc2 || first > 0xf4 ? 0 : first < 0xe0 ? 1 : first < 0xf0 ? 2 : 3;
  if (more == 0 || *place + more > text.size()) return first;
  char32_t code = first & (0x3fU >> more);
  for (size_t k = 0; k < more; ++k) {
    if ((byte(*place + k) & 0xc0U) != 0x80) return first;
    code = code << 6 | (byte(*place + k) & 0x3fU);
  }
  // An overlong form, a surrogate, beyond the last one.
  if (code >> (5 * more + 1) == 0 || code >> 11 == 0x1b || code > 0x10ffff) return first;
  *place += more;
  return code;
}

// UTF-8 as ISO 10303-21 writes it (6.4.3): all but printable ASCII, and the backslash, by number.
// Bytes that are not UTF-8 count as Latin-1. Open CASCADE doubles ' and \, see PrintLines().
Handle(TCollection_HAsciiString) TextOf(const std::string& text) {
  std::string encoded;
  for (size_t i = 0; i < text.size();) {
    const char32_t code = TakeCodePoint(text, &i);
    if (code >= 0x20 && code < 0x7f && code != '\\') {
      encoded += static_cast<char>(code);
    } else if (code < 0x100) {
      encoded += "\\X\\" + Hexadecimal(code, 2);
    } else if (code < 0x10000) {
      encoded += "\\X2\\" + Hexadecimal(code, 4) + "\\X0\\";
    } else {
      encoded += "\\X4\\" + Hexadecimal(code, 8) + "\\X0\\";
    }
  }
  return new TCollection_HAsciiString(encoded.c_str());
}

// Every backslash begins or ends the number of a character, and Open CASCADE has doubled it.
void PrintLines(StepData_StepWriter& text, std::ostream& out) {
  bool doubled = false;
  for (int i = 1; i <= text.NbLines(); ++i) {
    const Handle(TCollection_HAsciiString) line = text.Line(i);
    for (const char* at = line->ToCString(); *at != '\0'; ++at) {
      if (!doubled) out << *at;
      doubled = *at == '\\' && !doubled;
    }
    out << '\n';
  }
}

class StopIndicator : public Message_ProgressIndicator {
 public:
  explicit StopIndicator(std::stop_token stop) : stop_(std::move(stop)) {}

 protected:
  Standard_Boolean UserBreak() override { return stop_.stop_requested(); }
  void Show(const Message_ProgressScope&, const Standard_Boolean) override {}

 private:
  const std::stop_token stop_;
};

std::string WriteShape(const TopoDS_Shape& shape, const StepFile& file, double tolerance,
                       std::ostream& out) {
  // It would tell the standard output what it does.
  Message::DefaultMessenger()->RemovePrinters(STANDARD_TYPE(Message_Printer));
  STEPControl_Controller::Init();
  Interface_Static::SetCVal("write.step.unit", "MM");
  STEPControl_Writer writer;
  writer.SetTolerance(tolerance);
  const Handle(StopIndicator) indicator = new StopIndicator(file.stop);
  const IFSelect_ReturnStatus transferred =
      writer.Transfer(shape, STEPControl_AsIs, true, indicator->Start());
  if (file.stop.stop_requested()) return "stopped";
  if (transferred != IFSelect_RetDone) return "Open CASCADE cannot write this surface as STEP";
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
  header.SetAuthorValue(1, TextOf(""));
  header.SetOrganizationValue(1, TextOf(""));
  StepData_StepWriter text(model);
  text.SendModel(Handle(StepData_Protocol)::DownCast(writer.WS()->Protocol()));
  if (file.stop.stop_requested()) return "stopped";
  PrintLines(text, out);
  return "";
}

}  // namespace
}  // namespace rilievo

extern "C" const char RilievoStepVersion[] = RILIEVO_VERSION;

extern "C" void RilievoWriteStep(const rilievo::BicubicShell& shell, const rilievo::StepFile& file,
                                 std::ostream& out, std::string* problem) {
  try {
    const double tolerance = std::max(file.tolerance, rilievo::RoundingOf(shell));
    *problem =
        rilievo::WriteShape(rilievo::ShapeOfShell(shell, tolerance).Run(), file, tolerance, out);
  } catch (const Standard_Failure& failure) {
    *problem = std::string("Open CASCADE: ") + failure.DynamicType()->Name();
    const std::string said = failure.GetMessageString();
    if (!said.empty()) *problem += ": " + said;
  } catch (const std::exception& failure) {
    *problem = failure.what();
  }
}
