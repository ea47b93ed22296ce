#include "client/formats/threemf/threemf_writer.h"

#include <array>
#include <cmath>
#include <cstdint>
#include <string>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "client/formats/export_axes.h"
#include "client/formats/number_text.h"
#include "client/formats/threemf/zip_stream.h"
#include "core/base/status_macros.h"
#include "core/geometry/mesh_topology.h"

namespace rilievo {
namespace {

constexpr char kXmlHead[] = "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n";
constexpr char kContentTypes[] =
    "<Types xmlns=\"http://schemas.openxmlformats.org/package/2006/content-types\">"
    "<Default Extension=\"rels\" "
    "ContentType=\"application/vnd.openxmlformats-package.relationships+xml\"/>"
    "<Default Extension=\"model\" "
    "ContentType=\"application/vnd.ms-package.3dmanufacturing-3dmodel+xml\"/></Types>\n";
constexpr char kRelationships[] =
    "<Relationships xmlns=\"http://schemas.openxmlformats.org/package/2006/relationships\">"
    "<Relationship Id=\"rel0\" Target=\"/3D/3dmodel.model\" "
    "Type=\"http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel\"/></Relationships>\n";
constexpr int kObjectId = 1, kColorsId = 2;

// What coordinates are multiplied with, and the unit that they then have.
struct FileUnit {
  const char* name;
  double factor;
};

FileUnit UnitOf(const ScanPlace& place) {
  constexpr double kSame = 1e-9;
  constexpr std::array<std::pair<const char*, double>, 6> kUnits = {{{"micron", 1e-6},
                                                                     {"millimeter", 1e-3},
                                                                     {"centimeter", 1e-2},
                                                                     {"inch", 0.0254},
                                                                     {"foot", 0.3048},
                                                                     {"meter", 1}}};
  const double metres = place.metres_per_unit;
  if (!(metres > 0)) return {"millimeter", 1};
  for (const auto& [name, length] : kUnits) {
    if (std::abs(metres / length - 1) < kSame) return {name, 1};
  }
  return {"millimeter", metres * 1000};
}

// The rotation that brings the way up to z, as the format multiplies: rows of the transposed
// matrix. Empty where nothing is to be turned.
std::string TransformAttribute(UpDirection up) {
  if (up == UpDirection::kUnknown || up == UpDirection::kZ) return "";
  const Eigen::Matrix3d turn =
      (YUpFrom(UpDirection::kZ).conjugate() * YUpFrom(up)).toRotationMatrix();
  std::string text = " transform=\"";
  for (const double entry : turn.reshaped()) absl::StrAppend(&text, std::round(entry) + 0.0, " ");
  return absl::StrCat(text, "0 0 0\"");
}

// Text that is packed a block at a time.
class ModelText {
 public:
  explicit ModelText(ZipStream* zip) : zip_(zip) {}
  ~ModelText() { Flush(); }
  ModelText(const ModelText&) = delete;
  ModelText& operator=(const ModelText&) = delete;

  std::string& text() {
    constexpr size_t kBlock = size_t{1} << 18;
    if (text_.size() > kBlock) Flush();
    return text_;
  }

 private:
  void Flush() {
    zip_->Append(text_);
    text_.clear();
  }
  ZipStream* const zip_;
  std::string text_;
};

void WriteColors(const std::vector<Rgb>& colors, ModelText* model) {
  absl::StrAppend(&model->text(), "<m:colorgroup id=\"", kColorsId, "\">\n");
  for (const Rgb& color : colors) {
    absl::StrAppendFormat(&model->text(), "<m:color color=\"#%02X%02X%02X\"/>\n", color[0],
                          color[1], color[2]);
  }
  model->text() += "</m:colorgroup>\n";
}

void WriteVertices(const Eigen::Matrix3Xd& vertices, double factor, ModelText* model) {
  constexpr std::array<const char*, 3> kAxes = {"<vertex x=\"", "\" y=\"", "\" z=\""};
  for (Eigen::Index v = 0; v < vertices.cols(); ++v) {
    std::string& text = model->text();
    for (int axis = 0; axis < 3; ++axis) {
      text += kAxes[static_cast<size_t>(axis)];
      AppendNumber(static_cast<float>(vertices(axis, v) * factor), &text);
    }
    text += "\"/>\n";
  }
}

void WriteTriangles(const Eigen::Matrix3Xi& triangles, bool colored, ModelText* model) {
  for (Eigen::Index t = 0; t < triangles.cols(); ++t) {
    const Eigen::Vector3i corner = triangles.col(t);
    absl::StrAppend(&model->text(), "<triangle v1=\"", corner[0], "\" v2=\"", corner[1], "\" v3=\"",
                    corner[2]);
    if (colored) {  // a vertex and its colour have one number
      absl::StrAppend(&model->text(), "\" pid=\"", kColorsId, "\" p1=\"", corner[0], "\" p2=\"",
                      corner[1], "\" p3=\"", corner[2]);
    }
    model->text() += "\"/>\n";
  }
}

void WriteModel(const TriangleMesh& mesh, const PointLayers& layers, const ScanPlace& place,
                ModelText* model) {
  const FileUnit unit = UnitOf(place);
  const bool closed =
      SummarizeTopology(mesh.triangles, static_cast<int>(mesh.vertices.cols())).closed();
  const bool colored = !layers.colors.empty();
  absl::StrAppend(
      &model->text(), kXmlHead, "<model unit=\"", unit.name,
      "\" xml:lang=\"en-US\" xmlns=\"http://schemas.microsoft.com/3dmanufacturing/core/2015/02\"",
      colored ? " xmlns:m=\"http://schemas.microsoft.com/3dmanufacturing/material/2015/02\"" : "",
      ">\n<metadata name=\"Application\">rilievo</metadata>\n<resources>\n");
  if (colored) WriteColors(layers.colors, model);
  absl::StrAppend(&model->text(), "<object id=\"", kObjectId, "\" type=\"",
                  closed ? "model" : "surface", "\" name=\"surface\"",
                  colored ? absl::StrCat(" pid=\"", kColorsId, "\" pindex=\"0\"") : "",
                  ">\n<mesh>\n<vertices>\n");
  WriteVertices(mesh.vertices, unit.factor, model);
  model->text() += "</vertices>\n<triangles>\n";
  WriteTriangles(mesh.triangles, colored, model);
  absl::StrAppend(&model->text(),
                  "</triangles>\n</mesh>\n</object>\n</resources>\n<build>\n<item objectid=\"",
                  kObjectId, "\"", TransformAttribute(place.up), "/>\n</build>\n</model>\n");
}

}  // namespace

absl::Status Write3mfMesh(const TriangleMesh& mesh, std::ostream& out, const PointLayers& layers,
                          const ScanPlace& place) {
  if (mesh.triangles.cols() == 0) {
    return absl::InvalidArgumentError("3MF holds no mesh without triangles");
  }
  RILIEVO_RETURN_IF_ERROR(CheckLayers(layers, mesh.vertices.cols()));
  ZipStream zip(out);
  zip.Begin("[Content_Types].xml");
  zip.Append(absl::StrCat(kXmlHead, kContentTypes));
  zip.Begin("_rels/.rels");
  zip.Append(absl::StrCat(kXmlHead, kRelationships));
  zip.Begin("3D/3dmodel.model");
  {
    ModelText model(&zip);
    WriteModel(mesh, layers, place, &model);
  }
  return zip.Finish();
}

}  // namespace rilievo
