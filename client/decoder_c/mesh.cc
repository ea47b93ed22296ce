#include "client/decoder_c/mesh.h"

#include <limits>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "client/decoder_c/guarded.h"
#include "client/decoder_c/surface.h"
#include "core/base/status_macros.h"
#include "core/codec/container/decode_region.h"
#include "core/surface/adaptive_tessellation.h"

namespace rilievo::decoder_c {
namespace {

// Flags before the mesh: they are made in the same order, and a mesh is handed out only complete.
std::vector<uint8_t> Flags(const std::vector<HeightSource>& sources) {
  std::vector<uint8_t> flags;
  flags.reserve(sources.size());
  for (const HeightSource source : sources) flags.push_back(static_cast<uint8_t>(source));
  return flags;
}

absl::Status TessellateLevel(const DisplacedSurface& surface, int level, const RunContext& context,
                             RilievoMesh** mesh) {
  RILIEVO_ASSIGN_OR_RETURN(TriangleMesh triangles, Tessellate(surface, level, context));
  std::vector<uint8_t> flags = Flags(SourcesAtLevel(surface, level));
  std::vector<Rgb> colors = ColorsAtLevel(surface, level);
  *mesh = WrapMesh(std::move(triangles));
  (*mesh)->flags = std::move(flags);
  (*mesh)->colors = std::move(colors);
  return absl::OkStatus();
}

absl::Status Region(std::span<const uint8_t> bytes, std::span<const uint32_t> faces, int level,
                    const RunContext& context, RilievoMesh** mesh) {
  std::vector<int> control_faces;
  control_faces.reserve(faces.size());
  for (uint32_t face : faces) {
    // What is not an int becomes an index of no face.
    control_faces.push_back(face > std::numeric_limits<int>::max() ? -1 : static_cast<int>(face));
  }
  RILIEVO_ASSIGN_OR_RETURN(
      DecodedRegion part,
      DecodeRegion(bytes, control_faces, level < 0 ? kFinestLevel : level, context));
  std::vector<uint8_t> flags = Flags(part.sources);
  *mesh = WrapMesh(std::move(part.region.mesh));
  (*mesh)->flags = std::move(flags);
  (*mesh)->colors = std::move(part.colors);
  (*mesh)->numbers = std::move(part.region.vertices);
  return absl::OkStatus();
}

absl::Status TessellateSparsely(const DisplacedSurface& surface, const AdaptiveOptions& options,
                                const RunContext& context, RilievoMesh** mesh, double* error) {
  RILIEVO_ASSIGN_OR_RETURN(AdaptiveMesh adaptive, TessellateAdaptively(surface, options, context));
  std::vector<HeightSource> sources;
  std::vector<Rgb> colors;
  sources.reserve(adaptive.vertices.size());
  for (const int v : adaptive.vertices) {
    sources.push_back(surface.sources[v]);
    if (!surface.colors.empty()) colors.push_back(surface.colors[v]);
  }
  std::vector<uint8_t> flags = Flags(sources);
  *mesh = WrapMesh(std::move(adaptive.mesh));
  (*mesh)->flags = std::move(flags);
  (*mesh)->colors = std::move(colors);
  if (error != nullptr) *error = adaptive.error;
  return absl::OkStatus();
}

}  // namespace

RilievoMesh* WrapMesh(TriangleMesh mesh) {
  auto wrapped = std::make_unique<RilievoMesh>();
  wrapped->normals = mesh.normals.cast<float>();
  wrapped->vertices = std::move(mesh.vertices);
  wrapped->faces = std::move(mesh.triangles);
  return wrapped.release();
}

}  // namespace rilievo::decoder_c

using rilievo::decoder_c::Elements;

RilievoCode rilievo_tessellate(const RilievoSurface* surface, int level, int threads,
                               RilievoMesh** mesh) {
  using namespace rilievo::decoder_c;
  return Guarded([&]() -> absl::Status {
    RILIEVO_RETURN_IF_ERROR(NotNull(mesh, "mesh"));
    *mesh = nullptr;
    RILIEVO_RETURN_IF_ERROR(NotNull(surface, "surface"));
    rilievo::RunContext context;
    context.threads = Threads(threads);
    return TessellateLevel(surface->decoded.surface, level, context, mesh);
  });
}

RilievoCode rilievo_tessellate_adaptively(const RilievoSurface* surface, double tolerance,
                                          int64_t triangles, int threads, RilievoMesh** mesh,
                                          double* error) {
  using namespace rilievo::decoder_c;
  return Guarded([&]() -> absl::Status {
    RILIEVO_RETURN_IF_ERROR(NotNull(mesh, "mesh"));
    *mesh = nullptr;
    RILIEVO_RETURN_IF_ERROR(NotNull(surface, "surface"));
    rilievo::AdaptiveOptions options;
    if (triangles != 0) {
      options.triangles = triangles;
    } else {
      options.tolerance = tolerance;
    }
    rilievo::RunContext context;
    context.threads = Threads(threads);
    return TessellateSparsely(surface->decoded.surface, options, context, mesh, error);
  });
}

RilievoCode rilievo_decode_region(const uint8_t* bytes, size_t size, const uint32_t* faces,
                                  size_t face_count, int level, int threads, RilievoMesh** mesh) {
  using namespace rilievo::decoder_c;
  return Guarded([&]() -> absl::Status {
    RILIEVO_RETURN_IF_ERROR(NotNull(mesh, "mesh"));
    *mesh = nullptr;
    if (size > 0) RILIEVO_RETURN_IF_ERROR(NotNull(bytes, "bytes"));
    if (face_count > 0) RILIEVO_RETURN_IF_ERROR(NotNull(faces, "faces"));
    rilievo::RunContext context;
    context.threads = Threads(threads);
    return Region({bytes, size}, {faces, face_count}, level, context, mesh);
  });
}

void rilievo_mesh_free(RilievoMesh* mesh) { delete mesh; }

const double* rilievo_mesh_vertices(const RilievoMesh* mesh, size_t* count) {
  return Elements(mesh->vertices, count);
}

const uint32_t* rilievo_mesh_faces(const RilievoMesh* mesh, size_t* count) {
  return rilievo::decoder_c::AsUnsigned(Elements(mesh->faces, count));
}

const float* rilievo_mesh_normals(const RilievoMesh* mesh, size_t* count) {
  return Elements(mesh->normals, count);
}

const uint8_t* rilievo_mesh_flags(const RilievoMesh* mesh, size_t* count) {
  return Elements(mesh->flags, count);
}

const uint8_t* rilievo_mesh_colors(const RilievoMesh* mesh, size_t* count) {
  return rilievo::decoder_c::BytesOf(mesh->colors, count);
}

const uint32_t* rilievo_mesh_vertex_numbers(const RilievoMesh* mesh, size_t* count) {
  return rilievo::decoder_c::AsUnsigned(Elements(mesh->numbers, count));
}
