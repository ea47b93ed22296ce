// Any bytes as a .dss: a clean error, or a surface that holds together. The checksums are set right
// first, for no mutation would pass them.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

#include "core/codec/byte_stream.h"
#include "core/codec/crc32c.h"
#include "core/codec/dss.h"
#include "core/geometry/mesh_topology.h"
#include "core/surface/adaptive_tessellation.h"
#include "core/surface/region_tessellation.h"
#include "tests/fuzz/require.h"

namespace rilievo {
namespace {

constexpr uint8_t kSignature[] = {0x89, 0x44, 0x53, 0x53, 0x0d, 0x0a, 0x1a, 0x0a};

std::vector<uint8_t> WithRightChecksums(std::span<const uint8_t> bytes) {
  std::vector<uint8_t> right(bytes.begin(), bytes.end());
  if (right.size() < sizeof(kSignature) + 1) return right;
  std::copy(std::begin(kSignature), std::end(kSignature), right.begin());
  size_t begin = 0, at = sizeof(kSignature) + 1;
  while (at < right.size()) {
    ByteReader reader(std::span<const uint8_t>(right).subspan(at));
    reader.Byte();
    reader.Bytes(reader.Varint());
    if (!reader.ok() || reader.remaining() < 4) break;
    const size_t end = at + reader.position();
    const uint32_t crc = Crc32c(std::span<const uint8_t>(right).subspan(begin, end - begin));
    for (int i = 0; i < 4; ++i) right[end + i] = static_cast<uint8_t>(crc >> 8 * i);
    begin = at = end + 4;
  }
  return right;
}

RunContext OneThread() {
  RunContext context;
  context.threads = 1;
  return context;
}

void CheckOtherTessellations(const DisplacedSurface& surface, int level, const TriangleMesh& mesh) {
  const std::vector<int> first_face = {0};
  const auto region = TessellateRegion(surface, first_face, level, OneThread());
  Require(region.ok());
  for (size_t v = 0; v < region->vertices.size(); ++v) {
    Require(region->mesh.vertices.col(static_cast<Eigen::Index>(v)) ==
            mesh.vertices.col(region->vertices[v]));
  }
  if (surface.heights.size() > 2000) return;
  AdaptiveOptions options;
  options.triangles = 2 * surface.control_mesh.faces.cols();
  const auto adaptive = TessellateAdaptively(surface, options, OneThread());
  Require(adaptive.ok());
  Require(adaptive->mesh.triangles.cols() <= *options.triangles);
}

void CheckSurface(const DecodedSurface& decoded) {
  const DisplacedSurface& surface = decoded.surface;
  const auto topology = BuildMeshTopology(surface.control_mesh.faces,
                                          static_cast<int>(surface.control_mesh.vertices.cols()));
  Require(topology.ok());
  Require(surface.control_mesh.vertices.allFinite());
  Require(surface.max_level <= decoded.declared_max_level);
  Require(surface.sources.size() == surface.heights.size());
  for (float height : surface.heights) Require(std::abs(height) <= 0x1p24f);
  constexpr int64_t kMostFaces = 50000;
  int level = surface.max_level;
  while (level > 0 && topology->face_count() > kMostFaces >> (2 * level)) --level;
  const auto mesh = Tessellate(surface, level, OneThread());
  Require(mesh.ok());
  Require(mesh->triangles.cols() == surface.control_mesh.faces.cols() << (2 * level));
  Require(mesh->triangles.minCoeff() >= 0);
  Require(mesh->triangles.maxCoeff() < mesh->vertices.cols());
  Require(mesh->normals.allFinite());
  CheckOtherTessellations(surface, level, *mesh);
}

}  // namespace
}  // namespace rilievo

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  const std::vector<uint8_t> bytes = rilievo::WithRightChecksums({data, size});
  const auto decoded = rilievo::DecodeDss(bytes, rilievo::OneThread());
  if (decoded.ok()) {
    rilievo::CheckSurface(*decoded);
  } else {
    rilievo::Require(!decoded.status().message().empty());
  }
  return 0;
}
