#include "client/formats/mesh_reader.h"

#include <algorithm>
#include <array>
#include <initializer_list>
#include <limits>
#include <utility>

#include "absl/strings/str_cat.h"
#include "client/formats/byte_source.h"
#include "client/formats/color_collector.h"
#include "client/formats/face_collector.h"
#include "client/formats/file_kind.h"
#include "client/formats/number_text.h"
#include "client/formats/obj_lines.h"
#include "client/formats/open_input.h"
#include "client/formats/ply_elements.h"
#include "client/formats/ply_header.h"
#include "client/formats/ply_vertex.h"
#include "client/formats/point_collector.h"
#include "client/formats/scan_reader.h"
#include "client/formats/with_input.h"
#include "core/base/status_macros.h"

namespace rilievo {
namespace {

// Vertices of an element, with normals and sources where the file has them.
absl::Status ReadPlyVertices(ByteSource* source, const PlyHeader& header,
                             const PlyVertexLayout& layout, MeshFile* file) {
  const PlyElement& element = header.elements[layout.element_index];
  RILIEVO_RETURN_IF_ERROR(CheckElementFits(element, header.ascii(), *source));
  if (element.count > static_cast<uint64_t>(std::numeric_limits<int>::max())) {
    return absl::ResourceExhaustedError(absl::StrCat("PLY mesh of ", element.count, " vertices"));
  }
  std::vector<int> wanted(layout.position.begin(), layout.position.end());
  // Where the element has all of them, as scalars: the slot of the first; 0: none.
  const auto want = [&](std::initializer_list<const char*> names) -> size_t {
    const size_t slot = wanted.size();
    for (const char* name : names) {
      const int property = element.Find(name);
      if (property < 0 || element.properties[static_cast<size_t>(property)].is_list) {
        wanted.resize(slot);
        return 0;
      }
      wanted.push_back(property);
    }
    return slot;
  };
  const size_t normal_slot = want({"nx", "ny", "nz"});
  const size_t source_slot = want({"source"});
  size_t color_slot = want({"red", "green", "blue"});
  if (color_slot == 0) color_slot = want({"r", "g", "b"});
  ColorCollector colors;
  if (color_slot > 0) {
    const auto red = static_cast<size_t>(wanted[color_slot]);
    colors.set_kind(ColorCollector::KindOf(element.properties[red].type));
  }
  PlyElementReader reader(source, header, element, wanted, -1);
  PointCollector points, normals;
  if (source->remaining()) RILIEVO_RETURN_IF_ERROR(points.Reserve(element.count));
  for (uint64_t i = 0; i < element.count; ++i) {
    RILIEVO_RETURN_IF_ERROR(reader.Next());
    const double* value = reader.scalars();
    points.Add(value[0], value[1], value[2]);
    if (normal_slot > 0) normals.Add(value[3], value[4], value[5]);
    if (color_slot > 0) colors.Add(value + color_slot);
    if (source_slot > 0)
      file->source.push_back(value[source_slot] >= 0 && value[source_slot] < 256
                                 ? static_cast<uint8_t>(value[source_slot])
                                 : 255);
  }
  file->mesh.vertices = points.Finish();
  file->mesh.normals = normals.Finish();
  file->colors = colors.Finish();
  return absl::OkStatus();
}

int FindFaceList(const PlyElement& element) {
  for (const char* name : {"vertex_indices", "vertex_index"}) {
    const int property = element.Find(name);
    if (property >= 0 && element.properties[static_cast<size_t>(property)].is_list) return property;
  }
  return -1;
}

absl::Status ReadPlyFaces(ByteSource* source, const PlyHeader& header, const PlyElement& element,
                          int64_t vertices, FaceCollector* faces) {
  const int list = FindFaceList(element);
  const std::string name = absl::StrCat("PLY element '", element.name, "'");
  if (list < 0 && element.count > 0) {
    return absl::InvalidArgumentError(
        absl::StrCat(name, ": no list property 'vertex_indices' or 'vertex_index'"));
  }
  const auto add = element.name == "tristrips" ? &FaceCollector::AddStrips : &FaceCollector::Add;
  RILIEVO_RETURN_IF_ERROR(CheckElementFits(element, header.ascii(), *source));
  PlyElementReader reader(source, header, element, {}, list);
  for (uint64_t i = 0; i < element.count; ++i) {
    RILIEVO_RETURN_IF_ERROR(reader.Next());
    if (const absl::Status status = (faces->*add)(reader.list(), vertices); !status.ok()) {
      return absl::InvalidArgumentError(
          absl::StrCat(name, ", number ", i + 1, ": ", status.message()));
    }
  }
  return absl::OkStatus();
}

// One "a/b/c" of a face: a counts from 1, or from the end when negative.
absl::Status ParseObjCorner(std::string_view word, int64_t vertices, double* corner) {
  RILIEVO_RETURN_IF_ERROR(ParseNumber(word.substr(0, word.find('/')), corner));
  *corner = *corner < 0 ? static_cast<double>(vertices) + *corner : *corner - 1;
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<MeshFile> ReadPlyMesh(std::istream& in) {
  ByteSource source(in);
  RILIEVO_ASSIGN_OR_RETURN(const PlyHeader header, ReadPlyHeader(&source));
  RILIEVO_ASSIGN_OR_RETURN(const PlyVertexLayout vertex, FindPlyVertex(header));
  MeshFile file;
  file.format = absl::StrCat("PLY ", PlyFormatName(header.format));
  const auto vertices = static_cast<int64_t>(header.elements[vertex.element_index].count);
  FaceCollector faces;
  for (size_t i = 0; i < header.elements.size(); ++i) {
    const PlyElement& element = header.elements[i];
    if (i == vertex.element_index) {
      RILIEVO_RETURN_IF_ERROR(ReadPlyVertices(&source, header, vertex, &file));
    } else if (element.name == "face" || element.name == "tristrips") {
      RILIEVO_RETURN_IF_ERROR(ReadPlyFaces(&source, header, element, vertices, &faces));
    } else {
      RILIEVO_RETURN_IF_ERROR(SkipPlyElement(&source, header, element));
    }
  }
  file.mesh.triangles = faces.Finish();
  file.corner_counts = faces.corner_counts();
  return file;
}

namespace {

// One number of a tag that is due next, at least 0.
template <typename Number>
absl::Status NextOfTag(std::string_view* words, std::vector<Number>* numbers) {
  double number = 0;
  RILIEVO_RETURN_IF_ERROR(ParseNumber(NextWord(words), &number));
  if (!(number >= 0 && number < std::numeric_limits<int>::max())) {
    return absl::InvalidArgumentError("a number of a tag is below 0, or beyond any vertex");
  }
  numbers->push_back(static_cast<Number>(number));
  return absl::OkStatus();
}

// "crease N/M/0", N vertices of a chain of edges, counted from 0, and M sharpnesses, of which the
// last is that of all further edges; "corner N/M/0" likewise with vertices. Corners that are not
// sharp for ever are passed over, as are the other tags of OpenSubdiv.
absl::Status ParseTag(std::string_view words, std::optional<MeshTags>* tags) {
  const std::string_view kind = NextWord(&words);
  if (kind != "crease" && kind != "corner") return absl::OkStatus();
  const std::string_view counts = NextWord(&words);
  const size_t slash = counts.find('/'), second = counts.find('/', slash + 1);
  uint64_t vertex_count = 0, sharpness_count = 0;
  if (second == std::string_view::npos || !ParseCount(counts.substr(0, slash), &vertex_count) ||
      !ParseCount(counts.substr(slash + 1, second - slash - 1), &sharpness_count) ||
      sharpness_count == 0) {
    return absl::InvalidArgumentError(absl::StrCat(
        "a tag begins 't crease 2/1/0' or 't corner 1/1/0', not with ", Quoted(counts)));
  }
  std::vector<int> vertices;
  std::vector<float> sharpness;
  while (vertices.size() < vertex_count) RILIEVO_RETURN_IF_ERROR(NextOfTag(&words, &vertices));
  while (sharpness.size() < sharpness_count) {
    RILIEVO_RETURN_IF_ERROR(NextOfTag(&words, &sharpness));
  }
  if (!*tags) tags->emplace();
  const auto sharpness_of = [&](size_t i) { return sharpness[std::min(i, sharpness.size() - 1)]; };
  for (size_t i = 0; kind == "corner" && i < vertices.size(); ++i) {
    if (sharpness_of(i) >= kInfiniteSharpness) (*tags)->corners.push_back(vertices[i]);
  }
  for (size_t i = 0; kind == "crease" && i + 1 < vertices.size(); ++i) {
    const auto [a, b] = std::minmax(vertices[i], vertices[i + 1]);
    if (sharpness_of(i) > 0) (*tags)->creases.push_back({a, b, sharpness_of(i)});
  }
  return absl::OkStatus();
}

absl::Status CheckTags(const MeshTags& tags, int64_t vertex_count) {
  int64_t largest = 0;
  for (const Crease& crease : tags.creases) largest = std::max<int64_t>(largest, crease.b);
  for (const int corner : tags.corners) largest = std::max<int64_t>(largest, corner);
  if (largest < vertex_count) return absl::OkStatus();
  return absl::InvalidArgumentError(absl::StrCat("OBJ: a tag names vertex ", largest, " of ",
                                                 vertex_count, ", which are counted from 0"));
}

}  // namespace

absl::StatusOr<MeshFile> ReadObjMesh(std::istream& in) {
  ByteSource source(in);
  PointCollector points;
  ColorCollector colors;
  int64_t color_count = 0;
  FaceCollector faces;
  std::vector<double> corners;
  // Faces may name vertices that come later, so ranges are checked against the most an int holds
  // first and against the real number at the end.
  constexpr int64_t kMost = std::numeric_limits<int>::max();
  ObjVisitor visitor;
  visitor.vertex = [&](const Eigen::Vector3d& p, std::string_view words) {
    points.Add(p.x(), p.y(), p.z());
    if (const auto color = ParseObjColor(words)) {
      colors.Add(color->data());
      ++color_count;
    }
    return absl::OkStatus();
  };
  visitor.face = [&](std::string_view words) {
    corners.clear();
    for (auto word = NextWord(&words); !word.empty(); word = NextWord(&words)) {
      corners.emplace_back();
      RILIEVO_RETURN_IF_ERROR(ParseObjCorner(word, points.count(), &corners.back()));
    }
    return faces.Add(corners, kMost);
  };
  MeshFile file;
  visitor.tag = [&](std::string_view words) { return ParseTag(words, &file.tags); };
  RILIEVO_RETURN_IF_ERROR(VisitObjLines(&source, visitor));
  if (points.count() == 0) return absl::InvalidArgumentError("OBJ: no 'v' line, no vertices");
  if (file.tags) RILIEVO_RETURN_IF_ERROR(CheckTags(*file.tags, points.count()));
  file.format = "OBJ";
  if (color_count == points.count()) file.colors = colors.Finish();
  file.mesh.vertices = points.Finish();
  file.mesh.triangles = faces.Finish();
  file.corner_counts = faces.corner_counts();
  if (file.mesh.triangles.size() > 0 &&
      file.mesh.triangles.maxCoeff() >= file.mesh.vertices.cols()) {
    return absl::InvalidArgumentError(absl::StrCat("OBJ: a face names vertex ",
                                                   file.mesh.triangles.maxCoeff() + 1, " of ",
                                                   file.mesh.vertices.cols()));
  }
  return file;
}

PolygonMesh PolygonsOf(const MeshFile& file) {
  const Eigen::Matrix3Xi& fans = file.mesh.triangles;
  PolygonMesh mesh;
  mesh.vertices = file.mesh.vertices;
  std::vector<int> face;
  Eigen::Index column = 0;
  for (size_t f = 0; column < fans.cols(); ++f) {
    const int corners = file.corner_counts.empty() ? 3 : file.corner_counts[f];
    face = {fans(0, column), fans(1, column)};
    for (int i = 2; i < corners; ++i) face.push_back(fans(2, column++));
    mesh.AddFace(face);
  }
  return mesh;
}

absl::StatusOr<MeshFile> ReadMeshStream(std::istream& in, const std::string& name) {
  HeadedInput input(in);
  RILIEVO_ASSIGN_OR_RETURN(const FileKind kind, RecognizeFile(input.head(), input.size(), name));
  if (kind == FileKind::kPly) return ReadPlyMesh(input.stream());
  if (kind == FileKind::kObj) return ReadObjMesh(input.stream());
  if (kind == FileKind::kStl) return ReadStlMesh(input.stream());
  if (kind == FileKind::kGlb) return ReadGlbMesh(input.stream());
  RILIEVO_ASSIGN_OR_RETURN(ScanFile scan, ReadScanStream(input.stream(), name, {.colors = true}));
  MeshFile file;
  file.mesh.vertices = std::move(scan.cloud.points);
  file.colors = std::move(scan.cloud.sights.colors);
  file.format = std::move(scan.format);
  file.place = std::move(scan.place);
  return file;
}

absl::StatusOr<MeshFile> ReadMesh(const std::string& path) {
  return WithInput(path, [&](std::istream& in) { return ReadMeshStream(in, path); });
}

}  // namespace rilievo
