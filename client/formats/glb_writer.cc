#include "client/formats/glb_writer.h"

#include <cmath>
#include <limits>
#include <utility>

#include "absl/strings/str_cat.h"
#include "client/formats/glb_contents.h"
#include "core/base/status_macros.h"

namespace rilievo {
namespace {

template <typename Write>
GlbColumn Column(const char* attribute, int component, const char* type, uint64_t rows, int stride,
                 Write write) {
  GlbColumn column{attribute, component, type, rows, stride};
  column.bytes = rows * static_cast<uint64_t>(stride);
  column.write = std::move(write);
  return column;
}

GlbColumn PositionColumn(const TriangleMesh& mesh, const Eigen::Vector3d& middle) {
  const auto moved = [&mesh, middle](Eigen::Index vertex) -> Eigen::Vector3f {
    return (mesh.vertices.col(vertex) - middle).cast<float>();
  };
  Eigen::Vector3f low = Eigen::Vector3f::Constant(std::numeric_limits<float>::infinity());
  Eigen::Vector3f high = -low;
  for (Eigen::Index v = 0; v < mesh.vertices.cols(); ++v) {
    low = low.cwiseMin(moved(v));
    high = high.cwiseMax(moved(v));
  }
  GlbColumn column =
      Column("POSITION", kGlbFloat, "VEC3", static_cast<uint64_t>(mesh.vertices.cols()), 12,
             [&mesh, moved](BlockWriter* writer) {
               for (Eigen::Index v = 0; v < mesh.vertices.cols(); ++v) {
                 const Eigen::Vector3f position = moved(v);
                 for (int axis = 0; axis < 3; ++axis) writer->Little(position(axis));
               }
             });
  column.bounds = absl::StrCat(",\"min\":", GlbRow(low), ",\"max\":", GlbRow(high));
  return column;
}

GlbColumn ColorColumn(const std::vector<Rgb>& colors) {
  // With an alpha, for alignment's sake.
  GlbColumn column = Column("COLOR_0", kGlbUnsignedShort, "VEC4", colors.size(), 8,
                            [&colors](BlockWriter* writer) {
                              const std::array<uint16_t, 256> linear = GlbColorsFromSrgb();
                              for (const Rgb& color : colors) {
                                for (const uint8_t channel : color) writer->Little(linear[channel]);
                                writer->Little(uint16_t{65535});
                              }
                            });
  column.normalized = true;
  return column;
}

// The columns refer to what they are made of.
std::vector<GlbColumn> ColumnsOf(const TriangleMesh& mesh, std::span<const HeightSource> sources,
                                 const PointLayers& layers, const GlbTexture* texture,
                                 const GlbClip* clip, const Eigen::Vector3d& middle) {
  const auto vertices = static_cast<uint64_t>(mesh.vertices.cols());
  std::vector<GlbColumn> columns = {PositionColumn(mesh, middle)};
  if (mesh.normals.cols() == mesh.vertices.cols()) {
    columns.push_back(
        Column("NORMAL", kGlbFloat, "VEC3", vertices, 12, [&mesh](BlockWriter* writer) {
          for (const double value : mesh.normals.reshaped()) {
            writer->Little(static_cast<float>(value));
          }
        }));
  }
  if (!sources.empty()) {  // one byte used of four: vertex attributes are aligned
    columns.push_back(
        Column("_SOURCE", kGlbUnsignedByte, "SCALAR", vertices, 4, [sources](BlockWriter* writer) {
          for (const HeightSource source : sources) writer->Little(static_cast<uint32_t>(source));
        }));
  }
  if (!layers.colors.empty()) columns.push_back(ColorColumn(layers.colors));
  if (!layers.intensity.empty()) {
    columns.push_back(
        Column("_INTENSITY", kGlbFloat, "SCALAR", vertices, 4, [&layers](BlockWriter* writer) {
          for (const float intensity : layers.intensity) writer->Little(intensity);
        }));
  }
  if (texture != nullptr) {
    columns.push_back(
        Column("TEXCOORD_0", kGlbFloat, "VEC2", vertices, 8, [texture](BlockWriter* writer) {
          for (const float place : texture->places.reshaped()) writer->Little(place);
        }));
  }
  if (clip != nullptr) AppendClipColumns(*clip, &columns);
  columns.push_back(Column("", kGlbUnsignedInt, "SCALAR",
                           static_cast<uint64_t>(mesh.triangles.size()), 4,
                           [&mesh](BlockWriter* writer) {
                             for (const int corner : mesh.triangles.reshaped()) {
                               writer->Little(static_cast<uint32_t>(corner));
                             }
                           }));
  return columns;
}

}  // namespace

absl::Status WriteGlbMesh(const TriangleMesh& mesh, std::span<const HeightSource> sources,
                          std::ostream& out, const PointLayers& layers, const ScanPlace& place,
                          const GlbTexture* texture, const GlbClip* clip) {
  RILIEVO_RETURN_IF_ERROR(CheckGlbMesh(mesh, sources, layers));
  GlbContents contents;
  contents.translation =
      (mesh.vertices.rowwise().minCoeff() + mesh.vertices.rowwise().maxCoeff()) / 2;
  contents.columns = ColumnsOf(mesh, sources, layers, texture, clip, contents.translation);
  contents.has_colors = !layers.colors.empty() || texture != nullptr;
  if (texture != nullptr) contents.png = &texture->png;
  return WriteGlbContents(contents, place, out);
}

absl::Status CheckGlbMesh(const TriangleMesh& mesh, std::span<const HeightSource> sources,
                          const PointLayers& layers) {
  if (!sources.empty() && static_cast<Eigen::Index>(sources.size()) != mesh.vertices.cols()) {
    return absl::InvalidArgumentError(
        absl::StrCat(sources.size(), " height sources for ", mesh.vertices.cols(), " vertices"));
  }
  if (mesh.vertices.cols() == 0 || mesh.triangles.cols() == 0) {
    return absl::InvalidArgumentError("GLB holds no mesh without triangles");
  }
  return CheckLayers(layers, mesh.vertices.cols());
}

std::array<uint16_t, 256> GlbColorsFromSrgb() {
  std::array<uint16_t, 256> linear;
  for (size_t i = 0; i < linear.size(); ++i) {
    linear[i] = static_cast<uint16_t>(std::lround(65535 * LinearFromSrgb(i / 255.0)));
  }
  return linear;
}

}  // namespace rilievo
