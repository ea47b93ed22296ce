// Any bytes as a .dss: a clean error, or a surface that holds together, in memory within the law.
// The checksums are set right first, for no mutation would pass them.
//
// Ten million inputs have to pass in an hour or two, and a file of 300 bytes may claim a quarter of
// a million heights. So most inputs are cut after their last level of at most a thousand
// triangles (a prefix of a file is a file), and what costs more than decoding is done for a share
// of them. Which ones is drawn from the bytes, so that an input always does the same.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

#include "core/codec/bytes/chunk.h"
#include "core/codec/bytes/crc32c.h"
#include "core/codec/container/decode_region.h"
#include "core/codec/container/dss.h"
#include "core/geometry/mesh_topology.h"
#include "core/surface/adaptive_tessellation.h"
#include "core/surface/region_tessellation.h"
#include "tests/fuzz/peak_memory.h"
#include "tests/fuzz/require.h"
#include "tests/fuzz/right_checksums.h"
#include "tests/fuzz/shallow_prefix.h"

namespace rilievo {
namespace {

// Triangles of the level that an input is cut to: most, some, those that are left whole.
constexpr int64_t kFewFaces = 1024, kSomeFaces = 4096, kAllFaces = int64_t{1} << 40;
constexpr int64_t kMostFaces = 50000;    // triangles of the level that is tessellated
constexpr int64_t kMostAdaptive = 2000;  // heights of a surface that is tessellated adaptively
constexpr int64_t kMostRegion = 20000;   // of one whose regions are compared with it

// What is done for an input.
struct Checks {
  int64_t faces;
  bool tessellations, region, adaptive;
};

Checks ChecksOf(std::span<const uint8_t> bytes) {
#ifdef RILIEVO_EVERY_CHECK
  static_cast<void>(bytes);
  return {kAllFaces, true, true, true};
#else
  const uint32_t crc = Crc32c(bytes);
  const auto one_in = [crc](uint32_t odd, uint32_t count) { return (crc * odd >> 8) % count == 0; };
  const bool whole = one_in(0x9e3779b1, 1024);
  const int64_t faces = whole ? kAllFaces : one_in(0x165667b1, 8) ? kSomeFaces : kFewFaces;
  return {faces, whole || one_in(0x85ebca77, 32), whole || one_in(0xc2b2ae3d, 64),
          one_in(0x27d4eb2f, 1024)};
#endif
}

RunContext OneThread() {
  RunContext context;
  context.threads = 1;
  return context;
}

void CheckDecoded(const DecodedSurface& decoded) {
  const DisplacedSurface& surface = decoded.surface;
  const auto topology = BuildMeshTopology(surface.control_mesh.faces,
                                          static_cast<int>(surface.control_mesh.vertices.cols()));
  Require(topology.ok());
  Require(surface.control_mesh.vertices.allFinite());
  Require(surface.max_level <= decoded.declared_max_level);
  Require(surface.sources.size() == surface.heights.size());
  Require(surface.colors.empty() || surface.colors.size() == surface.heights.size());
  int64_t vertices = topology->vertex_count, edges = topology->edge_count(),
          faces = topology->face_count();
  for (int level = 0; level < surface.max_level; ++level) {
    vertices += edges;
    edges = 2 * edges + 3 * faces;
    faces *= 4;
  }
  Require(static_cast<int64_t>(surface.heights.size()) == vertices);
  bool in_range = true;
  for (float height : surface.heights) in_range = in_range && std::abs(height) <= 0x1p24f;
  Require(in_range);
}

// The finest level of at most so many triangles.
int LevelOf(const DisplacedSurface& surface, int64_t most_faces) {
  int level = surface.max_level;
  while (level > 0 && surface.control_mesh.faces.cols() > most_faces >> (2 * level)) --level;
  return level;
}

void CheckAdaptive(const DisplacedSurface& surface) {
  if (static_cast<int64_t>(surface.heights.size()) > kMostAdaptive) return;
  AdaptiveOptions options;
  options.triangles = 2 * surface.control_mesh.faces.cols();
  const auto adaptive = TessellateAdaptively(surface, options, OneThread());
  Require(adaptive.ok());
  Require(adaptive->mesh.triangles.cols() <= *options.triangles);
}

void CheckTessellations(const DisplacedSurface& surface) {
  const int level = LevelOf(surface, kMostFaces);
  const auto mesh = Tessellate(surface, level, OneThread());
  Require(mesh.ok());
  Require(mesh->triangles.cols() == surface.control_mesh.faces.cols() << (2 * level));
  Require(mesh->triangles.minCoeff() >= 0);
  Require(mesh->triangles.maxCoeff() < mesh->vertices.cols());
  Require(mesh->normals.allFinite());
  const std::vector<int> first_face = {0};
  const auto region = TessellateRegion(surface, first_face, level, OneThread());
  Require(region.ok());
  for (size_t v = 0; v < region->vertices.size(); ++v) {
    Require(region->mesh.vertices.col(static_cast<Eigen::Index>(v)) ==
            mesh->vertices.col(region->vertices[v]));
  }
}

// Some faces of bytes that may not be a file at all: an error, or what the whole file shows there.
void CheckRegion(const std::vector<uint8_t>& bytes, const DecodedSurface* whole) {
  std::vector<int> faces = {0};
  if (whole != nullptr) {
    const int last = static_cast<int>(whole->surface.control_mesh.faces.cols()) - 1;
    if (last > 0) faces.push_back(last);
    if (whole->surface.heights.size() > kMostRegion) return;
  }
  const auto part = DecodeRegion(bytes, faces, kFinestLevel, OneThread());
  if (whole == nullptr) {
    Require(part.ok() || !part.status().message().empty());
    return;
  }
  Require(part.ok());
  const auto mesh = Tessellate(whole->surface, part->level, OneThread());
  Require(mesh.ok());
  const std::vector<Rgb> colors = ColorsAtLevel(whole->surface, part->level);
  Require(part->colors.size() == (colors.empty() ? 0 : part->region.vertices.size()));
  for (size_t v = 0; v < part->region.vertices.size(); ++v) {
    const auto column = static_cast<Eigen::Index>(v);
    Require(part->region.mesh.vertices.col(column) == mesh->vertices.col(part->region.vertices[v]));
    Require(part->sources[v] == whole->surface.sources[part->region.vertices[v]]);
    if (!colors.empty()) Require(part->colors[v] == colors[part->region.vertices[v]]);
  }
}

// docs/dss-format.md, "The law": of the reference with one thread.
int64_t MemoryByLaw(size_t bytes) {
  return (32 << 20) + (int64_t{32} << 10) * static_cast<int64_t>(bytes);
}

void Check(const std::vector<uint8_t>& bytes, const Checks& checks) {
  PeakMemory memory;
  const auto decoded = DecodeDss(bytes, OneThread());
  Require(memory.Peak() <= MemoryByLaw(bytes.size()));
  if (decoded.ok()) {
    CheckDecoded(*decoded);
    if (checks.tessellations) CheckTessellations(decoded->surface);
    if (checks.adaptive) CheckAdaptive(decoded->surface);
  } else {
    Require(!decoded.status().message().empty());
  }
  if (checks.region) CheckRegion(bytes, decoded.ok() ? &*decoded : nullptr);
}

}  // namespace
}  // namespace rilievo

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  std::vector<uint8_t> bytes = rilievo::WithRightChecksums({data, size});
  const rilievo::Checks checks = rilievo::ChecksOf(bytes);
  bytes.resize(rilievo::ShallowPrefix(bytes, checks.faces));
  bytes.shrink_to_fit();
  rilievo::Check(bytes, checks);
  return 0;
}
