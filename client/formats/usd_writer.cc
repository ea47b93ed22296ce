#include <algorithm>
#include <cstdint>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "client/formats/block_writer.h"
#include "client/formats/export_axes.h"
#include "client/formats/number_text.h"
#include "client/formats/surface_writer.h"
#include "core/base/status_macros.h"
#include "core/loop/refinement.h"

namespace rilievo {
namespace {

// UsdGeomMesh's SHARPNESS_INFINITE.
constexpr float kUsdSharpest = 10.0f;

// The subdivided control mesh.
struct Cage {
  Eigen::Matrix3Xf points;  // scan unit, about the frame's centre
  int sides = 3;            // of each face
  std::vector<int> corners_of_faces;
  std::vector<int> crease_ends;  // pairs
  std::vector<float> crease_sharpness;
  std::vector<int> corners;
};

absl::StatusOr<Cage> MakeCage(const DisplacedSurface& surface, int level,
                              const RunContext& context) {
  const ControlMesh& control = surface.control_mesh;
  RILIEVO_ASSIGN_OR_RETURN(const LoopRefinement refinement,
                           RefineTopology(control, level, context));
  Eigen::Matrix3Xd points = control.vertices;
  for (int l = 0; l < level; ++l) {
    RILIEVO_RETURN_IF_ERROR(context.CheckStop());
    points = SubdivideOnce(refinement, l, points);
  }
  Cage cage;
  cage.points = (points * surface.frame.diagonal).cast<float>();
  const MeshTopology& topology = refinement.levels[level];
  if (refinement.quads.empty()) {
    const Eigen::Matrix3Xi& faces = topology.faces;
    cage.corners_of_faces.assign(faces.data(), faces.data() + faces.size());
  } else {
    cage.sides = 4;
    cage.corners_of_faces = CornersOfQuads(topology, refinement.quads.levels[level]);
  }
  if (!refinement.sharp.empty()) {
    for (const SharpEdge& edge : refinement.sharp.levels[level].edges) {
      cage.crease_ends.push_back(topology.edge_vertices(0, edge.edge));
      cage.crease_ends.push_back(topology.edge_vertices(1, edge.edge));
      cage.crease_sharpness.push_back(std::min(edge.sharpness, kUsdSharpest));
    }
  }
  cage.corners = control.corners;
  return cage;
}

class UsdText {
 public:
  explicit UsdText(std::ostream& out) : writer_(out) {}

  void Line(const std::string& line) { absl::StrAppend(&writer_.text(), line, "\n"); }

  // `    declaration = [write(0), write(1), ...]` and what stands behind it.
  template <typename Write>
  void Array(const std::string& declaration, int64_t count, const Write& write,
             const std::string& behind = "") {
    absl::StrAppend(&writer_.text(), "    ", declaration, " = [");
    for (int64_t i = 0; i < count; ++i) {
      if (i > 0) writer_.text() += ", ";
      write(i, &writer_.text());
    }
    absl::StrAppend(&writer_.text(), "]", behind, "\n");
  }

 private:
  BlockWriter writer_;
};

template <typename Vector>
void AppendTuple(const Vector& values, std::string* text) {
  for (int axis = 0; axis < 3; ++axis) {
    *text += axis == 0 ? "(" : ", ";
    AppendNumber(values(axis), text);
  }
  *text += ')';
}

void WriteSharpness(const Cage& cage, UsdText* usd) {
  const auto creases = static_cast<int64_t>(cage.crease_sharpness.size());
  if (creases > 0) {
    usd->Array("int[] creaseIndices", 2 * creases, [&](int64_t i, std::string* text) {
      absl::StrAppend(text, cage.crease_ends[static_cast<size_t>(i)]);
    });
    usd->Array("int[] creaseLengths", creases,
               [](int64_t /*i*/, std::string* text) { *text += '2'; });
    usd->Array("float[] creaseSharpnesses", creases, [&](int64_t i, std::string* text) {
      AppendNumber(cage.crease_sharpness[static_cast<size_t>(i)], text);
    });
  }
  const auto corners = static_cast<int64_t>(cage.corners.size());
  if (corners > 0) {
    usd->Array("int[] cornerIndices", corners, [&](int64_t i, std::string* text) {
      absl::StrAppend(text, cage.corners[static_cast<size_t>(i)]);
    });
    usd->Array("float[] cornerSharpnesses", corners,
               [](int64_t /*i*/, std::string* text) { AppendNumber(kUsdSharpest, text); });
  }
}

void WriteMeshArrays(const Cage& cage, UsdText* usd) {
  const Eigen::Vector3f low = cage.points.rowwise().minCoeff();
  const Eigen::Vector3f high = cage.points.rowwise().maxCoeff();
  usd->Array("float3[] extent", 2,
             [&](int64_t i, std::string* text) { AppendTuple(i == 0 ? low : high, text); });
  const auto corners = static_cast<int64_t>(cage.corners_of_faces.size());
  usd->Array("int[] faceVertexCounts", corners / cage.sides,
             [&](int64_t /*i*/, std::string* text) { absl::StrAppend(text, cage.sides); });
  usd->Array("int[] faceVertexIndices", corners, [&](int64_t i, std::string* text) {
    absl::StrAppend(text, cage.corners_of_faces[static_cast<size_t>(i)]);
  });
  usd->Array("point3f[] points", cage.points.cols(),
             [&](int64_t i, std::string* text) { AppendTuple(cage.points.col(i), text); });
}

void WriteLayer(const ScanPlace& place, UsdText* usd) {
  std::string metres;
  AppendNumber(MetresPerUnitOrOne(place), &metres);
  usd->Line(
      absl::StrCat("#usda 1.0\n(\n    defaultPrim = \"surface\"\n    metersPerUnit = ", metres,
                   "\n    upAxis = \"", UpOrZ(place) == UpDirection::kZ ? "Z" : "Y", "\"\n)\n"));
}

// The last operation is done first.
void WriteTransform(const Eigen::Vector3d& center, UpDirection up, UsdText* usd) {
  std::string translation, order = "\"xformOp:translate\"";
  AppendTuple(center, &translation);
  usd->Line(absl::StrCat("    double3 xformOp:translate = ", translation));
  if (up != UpDirection::kY && up != UpDirection::kZ) {
    const Eigen::Quaterniond turn = YUpFrom(up);
    std::string real, imaginary;
    AppendNumber(turn.w(), &real);
    AppendTuple(turn.vec(), &imaginary);
    usd->Line(absl::StrCat("    quatd xformOp:orient = (", real, ", ", imaginary.substr(1)));
    order = absl::StrCat("\"xformOp:orient\", ", order);
  }
  usd->Line(absl::StrCat("    uniform token[] xformOpOrder = [", order, "]"));
}

}  // namespace

absl::Status WriteUsdSurface(const DisplacedSurface& surface, int level, const ScanPlace& place,
                             const RunContext& context, std::ostream& out) {
  if (level < 0 || level > surface.max_level) {
    return absl::InvalidArgumentError(absl::StrCat("level = ", level,
                                                   ": USD can be written for 0 to ",
                                                   surface.max_level, ", the levels of heights"));
  }
  RILIEVO_ASSIGN_OR_RETURN(const Cage cage, MakeCage(surface, level, context));
  UsdText usd(out);
  WriteLayer(place, &usd);
  usd.Line("def Mesh \"surface\"\n{");
  WriteMeshArrays(cage, &usd);
  usd.Line(absl::StrCat("    uniform token subdivisionScheme = \"",
                        cage.sides == 4 ? "catmullClark" : "loop", "\""));
  // A boundary is a crease; its vertices of a single face are not pinned.
  usd.Line("    uniform token interpolateBoundary = \"edgeOnly\"");
  usd.Line("    uniform token orientation = \"rightHanded\"");
  WriteSharpness(cage, &usd);
  const std::string varying = " (\n        interpolation = \"varying\"\n    )";
  usd.Array(
      "float[] primvars:displacement", cage.points.cols(),
      [&](int64_t v, std::string* text) {
        const double height = surface.heights[static_cast<size_t>(v)];
        AppendNumber(static_cast<float>(height * surface.frame.diagonal), text);
      },
      varying);
  usd.Array(
      "int[] primvars:heightSource", cage.points.cols(),
      [&](int64_t v, std::string* text) {
        absl::StrAppend(text, static_cast<int>(surface.sources[static_cast<size_t>(v)]));
      },
      varying);
  WriteTransform(surface.frame.center, UpOrZ(place), &usd);
  usd.Line("}");
  return absl::OkStatus();
}

}  // namespace rilievo
