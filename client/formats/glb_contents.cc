#include "client/formats/glb_contents.h"

#include <limits>

#include "absl/strings/str_cat.h"
#include "client/formats/export_axes.h"
#include "client/formats/glb_clip.h"

namespace rilievo {
namespace {

// Names of the format, glTF 2.0 sections 3.6.1.1, 3.8.4 and 4.4.1.
constexpr int kArrayBuffer = 34962, kElementArrayBuffer = 34963;
constexpr int kLinear = 9729, kClampToEdge = 33071;
constexpr uint32_t kMagic = 0x46546c67, kJson = 0x4e4f534a, kBinary = 0x004e4942;

uint64_t Padded(uint64_t bytes) { return (bytes + 3) / 4 * 4; }

uint64_t PlainBytes(const GlbColumn& column) {
  return column.rows * static_cast<uint64_t>(column.stride);
}

bool IsCompressed(const GlbContents& contents) { return contents.columns.back().mode != nullptr; }

uint64_t BinaryBytes(const GlbContents& contents) {
  uint64_t bytes = contents.png != nullptr ? Padded(contents.png->size()) : 0;
  for (const GlbColumn& column : contents.columns) bytes += Padded(column.bytes);
  return bytes;
}

void AppendJoined(const std::string& item, std::string* list) {
  absl::StrAppend(list, list->empty() ? "" : ",", item);
}

// Where the bytes of a column lie: in the file, or, of a compressed one, in a buffer that exists
// only once it has been unpacked.
std::string View(const GlbColumn& column, uint64_t offset, uint64_t unpacked_offset) {
  const bool is_attribute = !column.attribute.empty() && !column.of_animation;
  const std::string stride = absl::StrCat(",\"byteStride\":", column.stride);
  std::string view =
      absl::StrCat("{\"buffer\":", column.mode != nullptr ? 1 : 0,
                   ",\"byteOffset\":", column.mode != nullptr ? unpacked_offset : offset,
                   ",\"byteLength\":", PlainBytes(column));
  if (!column.of_animation) {
    absl::StrAppend(&view, is_attribute ? stride : "",
                    ",\"target\":", is_attribute ? kArrayBuffer : kElementArrayBuffer);
  }
  if (column.mode != nullptr) {
    absl::StrAppend(
        &view, ",\"extensions\":{\"EXT_meshopt_compression\":{\"buffer\":0,\"byteOffset\":", offset,
        ",\"byteLength\":", column.bytes, stride, ",\"count\":", column.rows, ",\"mode\":\"",
        column.mode, "\"",
        column.filter != nullptr ? absl::StrCat(",\"filter\":\"", column.filter, "\"") : "", "}}");
  }
  return view + '}';
}

std::string Accessor(const GlbColumn& column, size_t view) {
  return absl::StrCat("{\"bufferView\":", view, ",\"componentType\":", column.component,
                      ",\"count\":", column.rows, ",\"type\":\"", column.type, "\"",
                      column.normalized ? ",\"normalized\":true" : "", column.bounds, "}");
}

// The scene: the mesh in its place, within a scan that stands as glTF wants it.
std::string Nodes(const GlbContents& contents, const ScanPlace& place) {
  std::string turn = "[";
  const Eigen::Quaterniond y_up = YUpFrom(UpOrZ(place));
  for (const double part : {y_up.x(), y_up.y(), y_up.z(), y_up.w()}) {
    if (turn.size() > 1) turn += ',';
    AppendNumber(part, &turn);
  }
  const auto scale = [](double factor) {
    return absl::StrCat(",\"scale\":", GlbRow(Eigen::Vector3d::Constant(factor).eval()));
  };
  return absl::StrCat("\"nodes\":[{\"name\":\"scan\",\"children\":[1],\"rotation\":", turn, "]",
                      scale(MetresPerUnitOrOne(place)), "},{\"mesh\":0,\"name\":\"surface\"",
                      contents.scale != 1 ? scale(contents.scale) : "",
                      ",\"translation\":", GlbRow(contents.translation), "}]");
}

struct Lists {
  std::string attributes, views, accessors;
};

Lists ListColumns(const GlbContents& contents, uint64_t* unpacked) {
  Lists lists;
  uint64_t offset = 0;
  for (size_t i = 0; i < contents.columns.size(); ++i) {
    const GlbColumn& column = contents.columns[i];
    if (!column.attribute.empty() && column.target < 0 && !column.of_animation) {
      AppendJoined(absl::StrCat("\"", column.attribute, "\":", i), &lists.attributes);
    }
    AppendJoined(View(column, offset, *unpacked), &lists.views);
    AppendJoined(Accessor(column, i), &lists.accessors);
    offset += Padded(column.bytes);
    *unpacked += PlainBytes(column);
  }
  if (contents.png != nullptr) {
    AppendJoined(absl::StrCat("{\"buffer\":0,\"byteOffset\":", offset,
                              ",\"byteLength\":", contents.png->size(), "}"),
                 &lists.views);
  }
  return lists;
}

// Filtered without smaller pictures, in which the faces of an atlas would run together.
std::string TextureJson(size_t view) {
  return absl::StrCat(
      "\"textures\":[{\"sampler\":0,\"source\":0}],\"samplers\":[{\"magFilter\":", kLinear,
      ",\"minFilter\":", kLinear, ",\"wrapS\":", kClampToEdge, ",\"wrapT\":", kClampToEdge,
      "}],\"images\":[{\"bufferView\":", view, ",\"mimeType\":\"image/png\"}],");
}

std::string GlbJson(const GlbContents& contents, const ScanPlace& place) {
  constexpr char kExtensions[] = "[\"EXT_meshopt_compression\",\"KHR_mesh_quantization\"],";
  uint64_t unpacked = 0;
  const Lists lists = ListColumns(contents, &unpacked);
  const size_t indices = contents.columns.size() - 1;
  const bool compressed = IsCompressed(contents), textured = contents.png != nullptr;
  std::string buffers = absl::StrCat("{\"byteLength\":", BinaryBytes(contents), "}");
  if (compressed) {
    absl::StrAppend(&buffers, ",{\"byteLength\":", unpacked,
                    ",\"extensions\":{\"EXT_meshopt_compression\":{\"fallback\":true}}}");
  }
  return absl::StrCat(
      "{\"asset\":{\"version\":\"2.0\",\"generator\":\"rilievo\"},",
      compressed
          ? absl::StrCat("\"extensionsUsed\":", kExtensions, "\"extensionsRequired\":", kExtensions)
          : "",
      "\"scene\":0,\"scenes\":[{\"nodes\":[0]}],", Nodes(contents, place),
      ",\"materials\":[{\"doubleSided\":true,\"pbrMetallicRoughness\":{",
      textured ? "\"baseColorTexture\":{\"index\":0}," : "",
      // COLOR_0 and the texture are multiplied by it.
      "\"baseColorFactor\":", contents.has_colors ? "[1,1,1,1]" : "[0.8,0.8,0.78,1]",
      ",\"metallicFactor\":0,\"roughnessFactor\":0.9}}],", textured ? TextureJson(indices + 1) : "",
      "\"meshes\":[{\"primitives\":[{\"attributes\":{", lists.attributes, "},\"indices\":", indices,
      ",\"material\":0", GlbTargets(contents.columns), "}]}]", GlbAnimations(contents.columns),
      ",\"accessors\":[", lists.accessors, "],\"bufferViews\":[", lists.views, "],\"buffers\":[",
      buffers, "]}");
}

}  // namespace

absl::Status WriteGlbContents(const GlbContents& contents, const ScanPlace& place,
                              std::ostream& out) {
  std::string json = GlbJson(contents, place);
  json.resize(Padded(json.size()), ' ');
  const uint64_t binary = BinaryBytes(contents);
  const uint64_t total = 12 + 8 + json.size() + 8 + binary;
  if (total > std::numeric_limits<uint32_t>::max()) {
    return absl::InvalidArgumentError(absl::StrCat("GLB holds at most 4 GiB, this mesh would take ",
                                                   total, " bytes; take a lower level"));
  }
  BlockWriter writer(out);
  for (const uint64_t word :
       {uint64_t{kMagic}, uint64_t{2}, total, uint64_t{json.size()}, uint64_t{kJson}}) {
    writer.Little(static_cast<uint32_t>(word));
  }
  writer.text() += json;
  writer.Little(static_cast<uint32_t>(binary));
  writer.Little(kBinary);
  const auto pad = [&](uint64_t bytes) { writer.text().append(Padded(bytes) - bytes, '\0'); };
  for (const GlbColumn& column : contents.columns) {
    column.write(&writer);
    pad(column.bytes);
  }
  if (contents.png == nullptr) return absl::OkStatus();
  writer.text() += *contents.png;
  pad(contents.png->size());
  return absl::OkStatus();
}

}  // namespace rilievo
