#include "client/formats/glb_writer.h"

#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <string>

#include "absl/strings/str_cat.h"
#include "client/formats/block_writer.h"
#include "client/formats/export_axes.h"
#include "client/formats/number_text.h"
#include "core/base/status_macros.h"

namespace rilievo {
namespace {

// Names of the format, glTF 2.0 sections 3.6.2 and 3.6.1.
constexpr int kUnsignedByte = 5121, kUnsignedShort = 5123, kUnsignedInt = 5125, kFloat = 5126;
constexpr int kArrayBuffer = 34962, kElementArrayBuffer = 34963;
constexpr int kLinear = 9729, kClampToEdge = 33071;
constexpr uint32_t kMagic = 0x46546c67, kJson = 0x4e4f534a, kBinary = 0x004e4942;

struct Layout {
  uint64_t vertices = 0, triangles = 0;
  bool normals = false, sources = false, colors = false, intensity = false;
  bool texture = false;
  uint64_t image_bytes = 0;
  Eigen::Vector3d middle;
  Eigen::Vector3f low, high;  // of the positions as floats

  uint64_t position_bytes() const { return 12 * vertices; }
  uint64_t normal_bytes() const { return normals ? 12 * vertices : 0; }
  // One byte used of four: vertex attributes are aligned.
  uint64_t source_bytes() const { return sources ? 4 * vertices : 0; }
  // With an alpha, for alignment's sake; of 16 bits, for linear bytes would merge dark colours.
  uint64_t color_bytes() const { return colors ? 8 * vertices : 0; }
  uint64_t intensity_bytes() const { return intensity ? 4 * vertices : 0; }
  uint64_t place_bytes() const { return texture ? 8 * vertices : 0; }
  uint64_t index_bytes() const { return 12 * triangles; }
  // With the filling that all chunks end with.
  uint64_t padded_image_bytes() const { return (image_bytes + 3) / 4 * 4; }
  uint64_t bytes() const {
    return position_bytes() + normal_bytes() + source_bytes() + color_bytes() + intensity_bytes() +
           place_bytes() + index_bytes() + padded_image_bytes();
  }
};

Eigen::Vector3f Moved(const TriangleMesh& mesh, const Layout& layout, Eigen::Index vertex) {
  return (mesh.vertices.col(vertex) - layout.middle).cast<float>();
}

Layout LayOut(const TriangleMesh& mesh, bool sources, const PointLayers& layers) {
  Layout layout;
  layout.vertices = static_cast<uint64_t>(mesh.vertices.cols());
  layout.triangles = static_cast<uint64_t>(mesh.triangles.cols());
  layout.normals = mesh.normals.cols() == mesh.vertices.cols();
  layout.sources = sources;
  layout.colors = !layers.colors.empty();
  layout.intensity = !layers.intensity.empty();
  layout.middle = (mesh.vertices.rowwise().minCoeff() + mesh.vertices.rowwise().maxCoeff()) / 2;
  layout.low = Eigen::Vector3f::Constant(std::numeric_limits<float>::infinity());
  layout.high = -layout.low;
  for (Eigen::Index v = 0; v < mesh.vertices.cols(); ++v) {
    const Eigen::Vector3f position = Moved(mesh, layout, v);
    layout.low = layout.low.cwiseMin(position);
    layout.high = layout.high.cwiseMax(position);
  }
  return layout;
}

template <typename Vector>
std::string Row(const Vector& values) {
  std::string text = "[";
  for (int axis = 0; axis < 3; ++axis) {
    if (axis > 0) text += ',';
    AppendNumber(values(axis), &text);
  }
  return text + ']';
}

std::string View(uint64_t offset, uint64_t bytes, int target, int stride) {
  return absl::StrCat("{\"buffer\":0,\"byteOffset\":", offset, ",\"byteLength\":", bytes,
                      stride > 0 ? absl::StrCat(",\"byteStride\":", stride) : "",
                      ",\"target\":", target, "}");
}

std::string Accessor(int view, int component, uint64_t count, const char* type,
                     const std::string& more) {
  return absl::StrCat("{\"bufferView\":", view, ",\"componentType\":", component,
                      ",\"count\":", count, ",\"type\":\"", type, "\"", more, "}");
}

// The scene: the mesh about its middle, within a scan that stands as glTF wants it.
std::string Nodes(const Layout& layout, const ScanPlace& place) {
  std::string turn = "[";
  const Eigen::Quaterniond y_up = YUpFrom(UpOrZ(place));
  for (const double part : {y_up.x(), y_up.y(), y_up.z(), y_up.w()}) {
    if (turn.size() > 1) turn += ',';
    AppendNumber(part, &turn);
  }
  return absl::StrCat(
      "\"nodes\":[{\"name\":\"scan\",\"children\":[1],\"rotation\":", turn,
      "],\"scale\":", Row(Eigen::Vector3d::Constant(MetresPerUnitOrOne(place)).eval()),
      "},{\"mesh\":0,\"name\":\"surface\",\"translation\":", Row(layout.middle), "}]");
}

std::string Describe(const Layout& layout, const ScanPlace& place) {
  std::string attributes = "\"POSITION\":0", views, accessors;
  uint64_t offset = 0;
  int count = 0;
  const auto add = [&](uint64_t bytes, int target, int stride, const std::string& accessor) {
    absl::StrAppend(&views, count > 0 ? "," : "", View(offset, bytes, target, stride));
    absl::StrAppend(&accessors, count > 0 ? "," : "", accessor);
    offset += bytes;
    ++count;
  };
  add(layout.position_bytes(), kArrayBuffer, 12,
      Accessor(0, kFloat, layout.vertices, "VEC3",
               absl::StrCat(",\"min\":", Row(layout.low), ",\"max\":", Row(layout.high))));
  if (layout.normals) {
    absl::StrAppend(&attributes, ",\"NORMAL\":", count);
    add(layout.normal_bytes(), kArrayBuffer, 12,
        Accessor(count, kFloat, layout.vertices, "VEC3", ""));
  }
  if (layout.sources) {
    absl::StrAppend(&attributes, ",\"_SOURCE\":", count);
    add(layout.source_bytes(), kArrayBuffer, 4,
        Accessor(count, kUnsignedByte, layout.vertices, "SCALAR", ""));
  }
  if (layout.colors) {
    absl::StrAppend(&attributes, ",\"COLOR_0\":", count);
    add(layout.color_bytes(), kArrayBuffer, 8,
        Accessor(count, kUnsignedShort, layout.vertices, "VEC4", ",\"normalized\":true"));
  }
  if (layout.intensity) {
    absl::StrAppend(&attributes, ",\"_INTENSITY\":", count);
    add(layout.intensity_bytes(), kArrayBuffer, 4,
        Accessor(count, kFloat, layout.vertices, "SCALAR", ""));
  }
  if (layout.texture) {
    absl::StrAppend(&attributes, ",\"TEXCOORD_0\":", count);
    add(layout.place_bytes(), kArrayBuffer, 8,
        Accessor(count, kFloat, layout.vertices, "VEC2", ""));
  }
  const int indices = count;
  add(layout.index_bytes(), kElementArrayBuffer, 0,
      Accessor(indices, kUnsignedInt, 3 * layout.triangles, "SCALAR", ""));
  std::string material, picture;
  if (layout.texture) {
    absl::StrAppend(&views, ",{\"buffer\":0,\"byteOffset\":", offset,
                    ",\"byteLength\":", layout.image_bytes, "}");
    material = "\"baseColorTexture\":{\"index\":0},";
    // Filtered without smaller pictures, in which the faces of an atlas would run together.
    picture = absl::StrCat(
        "\"textures\":[{\"sampler\":0,\"source\":0}],\"samplers\":[{\"magFilter\":", kLinear,
        ",\"minFilter\":", kLinear, ",\"wrapS\":", kClampToEdge, ",\"wrapT\":", kClampToEdge,
        "}],\"images\":[{\"bufferView\":", count, ",\"mimeType\":\"image/png\"}],");
  }
  const bool has_colors = layout.colors || layout.texture;
  return absl::StrCat(
      "{\"asset\":{\"version\":\"2.0\",\"generator\":\"rilievo\"},\"scene\":0,\"scenes\":[{"
      "\"nodes\":[0]}],",
      Nodes(layout, place), ",\"materials\":[{\"doubleSided\":true,\"pbrMetallicRoughness\":{",
      // COLOR_0 and the texture are multiplied by it.
      material, "\"baseColorFactor\":", has_colors ? "[1,1,1,1]" : "[0.8,0.8,0.78,1]",
      ",\"metallicFactor\":0,\"roughnessFactor\":0.9}}],", picture,
      "\"meshes\":[{\"primitives\":[{\"attributes\":{", attributes, "},\"indices\":", indices,
      ",\"material\":0}]}],\"accessors\":[", accessors, "],\"bufferViews\":[", views,
      "],\"buffers\":[{\"byteLength\":", layout.bytes(), "}]}");
}

// glTF's vertex colours are linear (section 3.7.2.1), a scan's are sRGB (IEC 61966-2-1).
std::array<uint16_t, 256> LinearFromSrgb() {
  std::array<uint16_t, 256> linear;
  for (size_t i = 0; i < linear.size(); ++i) {
    const double value = static_cast<double>(i) / 255;
    linear[i] = static_cast<uint16_t>(std::lround(
        65535 * (value <= 0.04045 ? value / 12.92 : std::pow((value + 0.055) / 1.055, 2.4))));
  }
  return linear;
}

void WriteBinary(const TriangleMesh& mesh, std::span<const HeightSource> sources,
                 const PointLayers& layers, const GlbTexture* texture, const Layout& layout,
                 BlockWriter* writer) {
  for (Eigen::Index v = 0; v < mesh.vertices.cols(); ++v) {
    const Eigen::Vector3f position = Moved(mesh, layout, v);
    for (int axis = 0; axis < 3; ++axis) writer->Little(position(axis));
  }
  if (layout.normals) {
    for (Eigen::Index i = 0; i < mesh.normals.size(); ++i) {
      writer->Little(static_cast<float>(mesh.normals.data()[i]));
    }
  }
  for (const HeightSource source : sources) writer->Little(static_cast<uint32_t>(source));
  const std::array<uint16_t, 256> linear = LinearFromSrgb();
  for (const std::array<uint8_t, 3>& color : layers.colors) {
    for (const uint8_t channel : color) writer->Little(linear[channel]);
    writer->Little(uint16_t{65535});
  }
  for (const float intensity : layers.intensity) writer->Little(intensity);
  if (texture != nullptr) {
    for (const float place : texture->places.reshaped()) writer->Little(place);
  }
  for (Eigen::Index i = 0; i < mesh.triangles.size(); ++i) {
    writer->Little(static_cast<uint32_t>(mesh.triangles.data()[i]));
  }
  if (texture == nullptr) return;
  writer->text() += texture->png;
  writer->text().append(layout.padded_image_bytes() - layout.image_bytes, '\0');
}

}  // namespace

absl::Status WriteGlbMesh(const TriangleMesh& mesh, std::span<const HeightSource> sources,
                          std::ostream& out, const PointLayers& layers, const ScanPlace& place,
                          const GlbTexture* texture) {
  if (!sources.empty() && static_cast<Eigen::Index>(sources.size()) != mesh.vertices.cols()) {
    return absl::InvalidArgumentError(
        absl::StrCat(sources.size(), " height sources for ", mesh.vertices.cols(), " vertices"));
  }
  if (mesh.vertices.cols() == 0 || mesh.triangles.cols() == 0) {
    return absl::InvalidArgumentError("GLB holds no mesh without triangles");
  }
  RILIEVO_RETURN_IF_ERROR(CheckLayers(layers, mesh.vertices.cols()));
  Layout layout = LayOut(mesh, !sources.empty(), layers);
  if (texture != nullptr) {
    layout.texture = true;
    layout.image_bytes = texture->png.size();
  }
  std::string json = Describe(layout, place);
  json.resize((json.size() + 3) / 4 * 4, ' ');
  const uint64_t total = 12 + 8 + json.size() + 8 + layout.bytes();
  if (total > UINT32_MAX) {
    return absl::InvalidArgumentError(absl::StrCat("GLB holds at most 4 GiB, this mesh would take ",
                                                   total, " bytes; take a lower level"));
  }
  BlockWriter writer(out);
  for (const uint64_t word :
       {uint64_t{kMagic}, uint64_t{2}, total, uint64_t{json.size()}, uint64_t{kJson}}) {
    writer.Little(static_cast<uint32_t>(word));
  }
  writer.text() += json;
  writer.Little(static_cast<uint32_t>(layout.bytes()));
  writer.Little(kBinary);
  WriteBinary(mesh, sources, layers, texture, layout, &writer);
  return absl::OkStatus();
}

}  // namespace rilievo
