// Any bytes as a .dss: a clean error, or a surface that holds together. The checksums are set right
// first, for no mutation would pass them.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

#include "core/codec/decode_region.h"
#include "core/codec/dss.h"
#include "core/geometry/mesh_topology.h"
#include "core/surface/adaptive_tessellation.h"
#include "core/surface/region_tessellation.h"
#include "tests/fuzz/require.h"
#include "tests/fuzz/right_checksums.h"

namespace rilievo {
namespace {

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

// Some faces of bytes that may be no file at all: an error, or what the whole file shows there.
void CheckRegion(const std::vector<uint8_t>& bytes, const DecodedSurface* whole) {
  std::vector<int> faces = {0};
  if (whole != nullptr) {
    const int last = static_cast<int>(whole->surface.control_mesh.faces.cols()) - 1;
    if (last > 0) faces.push_back(last);
    if (whole->surface.heights.size() > 100000) return;
  }
  const auto part = DecodeRegion(bytes, faces, kFinestLevel, OneThread());
  if (whole == nullptr) {
    Require(part.ok() || !part.status().message().empty());
    return;
  }
  Require(part.ok());
  const auto mesh = Tessellate(whole->surface, part->level, OneThread());
  Require(mesh.ok());
  for (size_t v = 0; v < part->region.vertices.size(); ++v) {
    const auto column = static_cast<Eigen::Index>(v);
    Require(part->region.mesh.vertices.col(column) == mesh->vertices.col(part->region.vertices[v]));
    Require(part->sources[v] == whole->surface.sources[part->region.vertices[v]]);
  }
}

}  // namespace
}  // namespace rilievo

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  const std::vector<uint8_t> bytes = rilievo::WithRightChecksums({data, size});
  const auto decoded = rilievo::DecodeDss(bytes, rilievo::OneThread());
  if (decoded.ok()) {
    rilievo::CheckSurface(*decoded);
    rilievo::CheckRegion(bytes, &*decoded);
  } else {
    rilievo::Require(!decoded.status().message().empty());
    rilievo::CheckRegion(bytes, nullptr);
  }
  return 0;
}
