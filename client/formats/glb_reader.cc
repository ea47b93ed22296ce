#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "client/formats/byte_source.h"
#include "client/formats/glb_document.h"
#include "client/formats/glb_nodes.h"
#include "client/formats/mesh_reader.h"
#include "client/formats/vertex_welder.h"
#include "core/base/status_macros.h"

namespace rilievo {
namespace {

using Json = GlbDocument::Json;

// glTF 2.0, section 5.24.4.
constexpr uint64_t kTriangles = 4, kTriangleFan = 6;  // 5 is a strip

// glTF's vertex colours are linear (section 3.7.2.1), a scan's are sRGB (IEC 61966-2-1).
uint8_t SrgbFromLinear(double linear) {
  const double value =
      linear <= 0.0031308 ? 12.92 * linear : 1.055 * std::pow(linear, 1 / 2.4) - 0.055;
  return static_cast<uint8_t>(std::lround(255 * std::clamp(value, 0.0, 1.0)));
}

struct Primitive {
  GlbRows positions;
  std::optional<GlbRows> colors, indices;
  uint64_t mode = kTriangles;

  uint64_t corners() const { return indices ? indices->count : positions.count; }
};

// Nullopt where the attribute or the member is missing.
absl::StatusOr<std::optional<GlbRows>> RowsNamed(const GlbDocument& document, const Json& owner,
                                                 const char* name) {
  if (GlbDocument::Find(owner, name) == nullptr) return std::nullopt;
  RILIEVO_ASSIGN_OR_RETURN(const uint64_t accessor, GlbDocument::Whole(owner, name));
  RILIEVO_ASSIGN_OR_RETURN(const GlbRows rows, document.Rows(accessor));
  return rows;
}

absl::Status CheckPrimitive(const Primitive& primitive) {
  const GlbRows& positions = primitive.positions;
  if (positions.type == ScalarType::kU32 || positions.width != 3) {
    return absl::InvalidArgumentError("POSITION must be VEC3 of float, bytes or shorts");
  }
  if (primitive.colors) {
    const GlbRows& colors = *primitive.colors;
    const bool is_byte_or_short = colors.type == ScalarType::kU8 || colors.type == ScalarType::kU16;
    if (colors.width < 3 ||
        !(colors.type == ScalarType::kF32 || (is_byte_or_short && colors.normalized))) {
      return absl::InvalidArgumentError(
          "COLOR_0 must be VEC3 or VEC4 of float or of normalized bytes or shorts");
    }
    if (colors.count != positions.count) {
      return absl::InvalidArgumentError(
          absl::StrCat("COLOR_0 has ", colors.count, " rows, POSITION ", positions.count));
    }
  }
  if (primitive.indices) {
    const GlbRows& indices = *primitive.indices;
    if (indices.width != 1 ||
        (indices.type != ScalarType::kU8 && indices.type != ScalarType::kU16 &&
         indices.type != ScalarType::kU32)) {
      return absl::InvalidArgumentError("'indices' must be SCALAR of unsigned integers");
    }
  }
  const uint64_t corners = primitive.corners();
  if (corners < 3 || (primitive.mode == kTriangles && corners % 3 != 0)) {
    return absl::InvalidArgumentError(
        absl::StrCat(corners, " corners do not make whole triangles"));
  }
  return absl::OkStatus();
}

// Nullopt for one without triangles.
absl::StatusOr<std::optional<Primitive>> ReadPrimitive(const GlbDocument& document,
                                                       const Json& json) {
  Primitive primitive;
  RILIEVO_ASSIGN_OR_RETURN(primitive.mode, GlbDocument::Whole(json, "mode", kTriangles));
  if (primitive.mode > kTriangleFan) {
    return absl::InvalidArgumentError(absl::StrCat("'mode' is ", primitive.mode));
  }
  const Json* attributes = GlbDocument::Find(json, "attributes");
  if (primitive.mode < kTriangles || attributes == nullptr) return std::nullopt;
  RILIEVO_ASSIGN_OR_RETURN(const std::optional<GlbRows> positions,
                           RowsNamed(document, *attributes, "POSITION"));
  if (!positions) return std::nullopt;
  primitive.positions = *positions;
  RILIEVO_ASSIGN_OR_RETURN(primitive.colors, RowsNamed(document, *attributes, "COLOR_0"));
  RILIEVO_ASSIGN_OR_RETURN(primitive.indices, RowsNamed(document, json, "indices"));
  RILIEVO_RETURN_IF_ERROR(CheckPrimitive(primitive));
  return primitive;
}

class MeshOfScene {
 public:
  // Meshes may be placed again and again, but not so often that a small file becomes a large mesh.
  explicit MeshOfScene(const GlbDocument& document)
      : document_(document), corners_left_(kFreeCorners + document.binary_bytes()) {}

  absl::Status Add(const PlacedMesh& placed) {
    RILIEVO_ASSIGN_OR_RETURN(const Json* mesh, document_.Item("meshes", placed.mesh));
    RILIEVO_ASSIGN_OR_RETURN(const Json* primitives, GlbDocument::List(*mesh, "primitives"));
    RILIEVO_RETURN_IF_ERROR(Spend(primitives->size()));
    for (size_t i = 0; i < primitives->size(); ++i) {
      absl::StatusOr<std::optional<Primitive>> primitive =
          ReadPrimitive(document_, (*primitives)[i]);
      absl::Status status = primitive.status();
      if (status.ok() && *primitive) status = AddTriangles(**primitive, placed.scene_from_mesh);
      if (!status.ok()) {
        return absl::Status(status.code(), absl::StrCat("meshes[", placed.mesh, "], primitive ", i,
                                                        ": ", status.message()));
      }
    }
    return absl::OkStatus();
  }

  MeshFile Finish() {
    MeshFile file;
    file.format = "GLB";
    file.place = {1, UpDirection::kY, ""};
    file.mesh.vertices = vertices_.Finish();
    file.mesh.triangles = Eigen::Map<const Eigen::Matrix3Xi>(
        corners_.data(), 3, static_cast<Eigen::Index>(corners_.size() / 3));
    if (all_have_colors_) file.colors = std::move(colors_);
    return file;
  }

 private:
  static constexpr uint64_t kFreeCorners = uint64_t{1} << 22;

  absl::Status Spend(uint64_t corners) {
    if (corners > corners_left_) {
      return absl::InvalidArgumentError(
          "the scene places its meshes so often that they are too many triangles; export fewer");
    }
    corners_left_ -= corners;
    return absl::OkStatus();
  }

  // The number of the vertex.
  absl::StatusOr<int> AddCorner(const Primitive& primitive, const Eigen::Affine3d& scene_from_mesh,
                                uint64_t corner) {
    uint64_t row = corner;
    if (primitive.indices) row = static_cast<uint64_t>(primitive.indices->Value(corner, 0));
    const GlbRows& positions = primitive.positions;
    if (row >= positions.count) {
      return absl::InvalidArgumentError(
          absl::StrCat("index ", corner, " names vertex ", row, " of ", positions.count));
    }
    if (vertices_.count() == std::numeric_limits<int>::max()) {
      return absl::ResourceExhaustedError("more than 2^31 - 1 vertices");
    }
    const Eigen::Vector3d place =
        scene_from_mesh *
        Eigen::Vector3d(positions.Real(row, 0), positions.Real(row, 1), positions.Real(row, 2));
    const int64_t before = vertices_.count();
    const int vertex = vertices_.Add(place.x(), place.y(), place.z());
    if (vertices_.count() > before && all_have_colors_) AddColor(*primitive.colors, row);
    return vertex;
  }

  void AddColor(const GlbRows& colors, uint64_t row) {
    Rgb& color = colors_.emplace_back();
    for (size_t channel = 0; channel < 3; ++channel) {
      color[channel] = SrgbFromLinear(colors.Real(row, channel));
    }
  }

  absl::Status AddTriangles(const Primitive& primitive, const Eigen::Affine3d& scene_from_mesh) {
    const uint64_t corners = primitive.corners();
    RILIEVO_RETURN_IF_ERROR(Spend(corners));
    all_have_colors_ &= primitive.colors.has_value();
    const bool mirrored = scene_from_mesh.linear().determinant() < 0;
    const auto add = [&](int a, int b, int c) {
      if (a == b || b == c || c == a) return;  // strips are joined by triangles without an area
      corners_.insert(corners_.end(), {a, mirrored ? c : b, mirrored ? b : c});
    };
    std::array<int, 3> last{};  // the corners so far that the next triangle may have
    for (uint64_t i = 0; i < corners; ++i) {
      RILIEVO_ASSIGN_OR_RETURN(const int vertex, AddCorner(primitive, scene_from_mesh, i));
      if (i < 2) {
        last[i] = vertex;
        continue;
      }
      if (primitive.mode == kTriangles) {
        last[i % 3] = vertex;
        if (i % 3 == 2) add(last[0], last[1], last[2]);
      } else if (primitive.mode == kTriangleFan) {
        add(last[0], last[1], vertex);
        last[1] = vertex;
      } else {
        const bool odd = i % 2 == 1;
        add(last[odd ? 1 : 0], last[odd ? 0 : 1], vertex);
        last = {last[1], vertex, 0};
      }
    }
    return absl::OkStatus();
  }

  const GlbDocument& document_;
  uint64_t corners_left_;
  VertexWelder vertices_;
  std::vector<int> corners_;
  std::vector<Rgb> colors_;
  bool all_have_colors_ = true;
};

absl::StatusOr<MeshFile> ReadScene(ByteSource* source) {
  RILIEVO_ASSIGN_OR_RETURN(const GlbDocument document, GlbDocument::Read(source));
  RILIEVO_ASSIGN_OR_RETURN(const std::vector<PlacedMesh> scene, FlattenScene(document));
  MeshOfScene mesh(document);
  for (const PlacedMesh& placed : scene) RILIEVO_RETURN_IF_ERROR(mesh.Add(placed));
  MeshFile file = mesh.Finish();
  if (file.mesh.triangles.cols() > 0) return file;
  return absl::InvalidArgumentError("the scene has no triangles");
}

}  // namespace

absl::StatusOr<MeshFile> ReadGlbMesh(std::istream& in) {
  ByteSource source(in);
  absl::StatusOr<MeshFile> file = ReadScene(&source);
  if (file.ok()) return file;
  return absl::Status(file.status().code(), absl::StrCat("GLB: ", file.status().message()));
}

}  // namespace rilievo
