#include "client/formats/meshopt/compress_glb.h"

#include <meshoptimizer.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "client/formats/glb_contents.h"
#include "core/base/status_macros.h"

namespace rilievo {
namespace {

static_assert(std::endian::native == std::endian::little, "rows are compressed as they lie");

constexpr double kMostSteps = 65535;
constexpr int kNormalBits = 8;
constexpr unsigned int kUnusedVertex = ~0u;

// Triangles and vertices in an order that compresses well.
struct CodingOrder {
  std::vector<unsigned int> corners;   // of the triangles, as numbers of the new order
  std::vector<unsigned int> place_of;  // of a vertex in the new order, or kUnusedVertex
  size_t vertices = 0;                 // that are used
};

CodingOrder OrderOf(const TriangleMesh& mesh) {
  const auto count = static_cast<size_t>(mesh.vertices.cols());
  const std::vector<unsigned int> given(mesh.triangles.data(),
                                        mesh.triangles.data() + mesh.triangles.size());
  CodingOrder order;
  order.corners.resize(given.size());
  meshopt_optimizeVertexCacheStrip(order.corners.data(), given.data(), given.size(), count);
  order.place_of.resize(count);
  order.vertices = meshopt_optimizeVertexFetchRemap(order.place_of.data(), order.corners.data(),
                                                    given.size(), count);
  meshopt_remapIndexBuffer(order.corners.data(), order.corners.data(), given.size(),
                           order.place_of.data());
  return order;
}

// `packed`: what takes the place of the rows of the column.
void PackColumn(const char* mode, std::string packed, GlbColumn* column) {
  column->mode = mode;
  column->bytes = packed.size();
  column->write = [bytes = std::move(packed)](BlockWriter* writer) { writer->text() += bytes; };
}

std::string PackRows(const std::string& rows, size_t count, size_t stride) {
  std::string packed(meshopt_encodeVertexBufferBound(count, stride), '\0');
  meshopt_encodeVertexVersion(0);
  packed.resize(meshopt_encodeVertexBuffer(reinterpret_cast<unsigned char*>(packed.data()),
                                           packed.size(), rows.data(), count, stride));
  return packed;
}

// A column whose rows are values of one type, as many as fit the stride; `value(vertex)` gives a
// row of them as a std::array.
template <typename Value>
GlbColumn PackedColumn(const char* attribute, int component, const char* type,
                       const CodingOrder& order, const Value& value) {
  using Row = decltype(value(size_t{0}));
  static_assert(sizeof(Row) % 4 == 0, "rows are aligned");
  std::string rows(order.vertices * sizeof(Row), '\0');
  for (size_t v = 0; v < order.place_of.size(); ++v) {
    if (order.place_of[v] == kUnusedVertex) continue;
    const Row row = value(v);
    std::memcpy(rows.data() + order.place_of[v] * sizeof(Row), row.data(), sizeof(Row));
  }
  GlbColumn column{attribute, component, type, order.vertices, sizeof(Row)};
  PackColumn("ATTRIBUTES", PackRows(rows, order.vertices, sizeof(Row)), &column);
  return column;
}

// Positions as whole steps, those of the low corner of the bounding box taken off.
struct PositionGrid {
  double step = 1;  // scan unit
  Eigen::Vector3d low;

  Eigen::Vector3d StepsTo(const Eigen::Vector3d& position) const {
    return (position / step).array().round().matrix() - low;
  }
};

absl::StatusOr<PositionGrid> GridOf(const Eigen::Matrix3Xd& vertices, double step) {
  const Eigen::Vector3d low = vertices.rowwise().minCoeff(), high = vertices.rowwise().maxCoeff();
  const double longest = (high - low).maxCoeff();
  PositionGrid grid;
  grid.step = step > 0 ? step : longest > 0 ? longest / kMostSteps : 1;
  grid.low = (low / grid.step).array().round();
  if (step > 0 && grid.StepsTo(high).maxCoeff() > kMostSteps) {
    return absl::InvalidArgumentError(absl::StrCat("step = ", step, ": the mesh is ", longest,
                                                   " long; at least ", longest / kMostSteps));
  }
  return grid;
}

GlbColumn PackedPositions(const TriangleMesh& mesh, const PositionGrid& grid,
                          const CodingOrder& order) {
  const auto steps = [&](size_t v) {
    std::array<uint16_t, 4> row{};
    const Eigen::Vector3d place = grid.StepsTo(mesh.vertices.col(static_cast<Eigen::Index>(v)));
    for (int axis = 0; axis < 3; ++axis) {
      row[static_cast<size_t>(axis)] =
          static_cast<uint16_t>(std::clamp(place(axis), 0.0, kMostSteps));
    }
    return row;
  };
  GlbColumn column = PackedColumn("POSITION", kGlbUnsignedShort, "VEC3", order, steps);
  Eigen::Vector3d least = Eigen::Vector3d::Constant(kMostSteps), most = Eigen::Vector3d::Zero();
  for (size_t v = 0; v < order.place_of.size(); ++v) {
    if (order.place_of[v] == kUnusedVertex) continue;
    const std::array<uint16_t, 4> row = steps(v);
    const Eigen::Vector3d position(row[0], row[1], row[2]);
    least = least.cwiseMin(position);
    most = most.cwiseMax(position);
  }
  column.bounds = absl::StrCat(",\"min\":", GlbRow(least), ",\"max\":", GlbRow(most));
  return column;
}

GlbColumn PackedNormals(const Eigen::Matrix3Xd& normals, const CodingOrder& order) {
  GlbColumn column = PackedColumn("NORMAL", kGlbByte, "VEC3", order, [&](size_t v) {
    const Eigen::Vector3f normal = normals.col(static_cast<Eigen::Index>(v)).cast<float>();
    const std::array<float, 4> given = {normal.x(), normal.y(), normal.z(), 0};
    std::array<int8_t, 4> row;
    meshopt_encodeFilterOct(row.data(), 1, row.size(), kNormalBits, given.data());
    return row;
  });
  column.normalized = true;
  column.filter = "OCTAHEDRAL";
  return column;
}

GlbColumn PackedColors(const std::vector<Rgb>& colors, const CodingOrder& order) {
  const std::array<uint16_t, 256> linear = GlbColorsFromSrgb();
  GlbColumn column = PackedColumn("COLOR_0", kGlbUnsignedShort, "VEC4", order, [&](size_t v) {
    const Rgb& color = colors[v];
    return std::array<uint16_t, 4>{linear[color[0]], linear[color[1]], linear[color[2]], 65535};
  });
  column.normalized = true;
  return column;
}

GlbColumn PackedPlaces(const Eigen::Matrix2Xf& places, const CodingOrder& order) {
  GlbColumn column = PackedColumn("TEXCOORD_0", kGlbUnsignedShort, "VEC2", order, [&](size_t v) {
    std::array<uint16_t, 2> row;
    for (int axis = 0; axis < 2; ++axis) {
      row[static_cast<size_t>(axis)] = static_cast<uint16_t>(
          meshopt_quantizeUnorm(places(axis, static_cast<Eigen::Index>(v)), 16));
    }
    return row;
  });
  column.normalized = true;
  return column;
}

GlbColumn PackedTriangles(const CodingOrder& order) {
  const size_t corners = order.corners.size();
  std::string packed(meshopt_encodeIndexBufferBound(corners, order.vertices), '\0');
  meshopt_encodeIndexVersion(1);
  packed.resize(meshopt_encodeIndexBuffer(reinterpret_cast<unsigned char*>(packed.data()),
                                          packed.size(), order.corners.data(), corners));
  GlbColumn column{"", kGlbUnsignedInt, "SCALAR", corners, 4};
  PackColumn("TRIANGLES", std::move(packed), &column);
  return column;
}

}  // namespace

absl::Status WriteCompressedGlbMesh(const TriangleMesh& mesh, std::span<const HeightSource> sources,
                                    std::ostream& out, const PointLayers& layers,
                                    const ScanPlace& place, const GlbTexture* texture,
                                    double step) {
  RILIEVO_RETURN_IF_ERROR(CheckGlbMesh(mesh, sources, layers));
  const CodingOrder order = OrderOf(mesh);
  RILIEVO_ASSIGN_OR_RETURN(const PositionGrid grid, GridOf(mesh.vertices, step));
  GlbContents contents;
  contents.translation = grid.low * grid.step;
  contents.scale = grid.step;
  contents.has_colors = !layers.colors.empty() || texture != nullptr;
  std::vector<GlbColumn>& columns = contents.columns;
  columns.push_back(PackedPositions(mesh, grid, order));
  if (mesh.normals.cols() == mesh.vertices.cols()) {
    columns.push_back(PackedNormals(mesh.normals, order));
  }
  if (!sources.empty()) {
    columns.push_back(PackedColumn("_SOURCE", kGlbUnsignedByte, "SCALAR", order, [&](size_t v) {
      return std::array<uint32_t, 1>{static_cast<uint32_t>(sources[v])};
    }));
  }
  if (!layers.colors.empty()) columns.push_back(PackedColors(layers.colors, order));
  if (!layers.intensity.empty()) {
    columns.push_back(PackedColumn("_INTENSITY", kGlbFloat, "SCALAR", order, [&](size_t v) {
      return std::array<float, 1>{layers.intensity[v]};
    }));
  }
  if (texture != nullptr) {
    columns.push_back(PackedPlaces(texture->places, order));
    contents.png = &texture->png;
  }
  columns.push_back(PackedTriangles(order));
  return WriteGlbContents(contents, place, out);
}

}  // namespace rilievo
