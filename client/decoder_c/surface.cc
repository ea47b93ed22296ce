#include "client/decoder_c/surface.h"

#include <memory>
#include <utility>

#include "client/decoder_c/guarded.h"
#include "core/base/status_macros.h"

namespace rilievo::decoder_c {

RilievoSurface* WrapSurface(DecodedSurface decoded) {
  auto surface = std::make_unique<RilievoSurface>();
  const SpatialFrame& frame = decoded.surface.frame;
  surface->frame = {frame.center.x(), frame.center.y(), frame.center.z(), frame.diagonal};
  const ControlMesh& control = decoded.surface.control_mesh;
  surface->control_vertices = (control.vertices * frame.diagonal).colwise() + frame.center;
  surface->crease_ends.resize(2, static_cast<Eigen::Index>(control.creases.size()));
  Eigen::Index column = 0;
  for (const Crease& crease : control.creases) {
    surface->crease_ends.col(column++) << static_cast<uint32_t>(crease.a),
        static_cast<uint32_t>(crease.b);
    surface->sharpness.push_back(crease.sharpness);
  }
  surface->info = InfoJson(decoded);
  surface->decoded = std::move(decoded);
  return surface.release();
}

}  // namespace rilievo::decoder_c

using rilievo::decoder_c::AsUnsigned;
using rilievo::decoder_c::Elements;

RilievoCode rilievo_decode(const uint8_t* bytes, size_t size, int threads,
                           RilievoSurface** surface) {
  using namespace rilievo::decoder_c;
  return Guarded([&]() -> absl::Status {
    RILIEVO_RETURN_IF_ERROR(NotNull(surface, "surface"));
    *surface = nullptr;
    if (size > 0) RILIEVO_RETURN_IF_ERROR(NotNull(bytes, "bytes"));
    rilievo::RunContext context;
    context.threads = Threads(threads);
    RILIEVO_ASSIGN_OR_RETURN(rilievo::DecodedSurface decoded,
                             rilievo::DecodeDss({bytes, size}, context));
    *surface = WrapSurface(std::move(decoded));
    return absl::OkStatus();
  });
}

void rilievo_surface_free(RilievoSurface* surface) { delete surface; }

int rilievo_surface_max_level(const RilievoSurface* surface) {
  return surface->decoded.surface.max_level;
}

int rilievo_surface_declared_max_level(const RilievoSurface* surface) {
  return surface->decoded.declared_max_level;
}

const char* rilievo_surface_info(const RilievoSurface* surface, size_t* count) {
  return Elements(surface->info, count);
}

const double* rilievo_surface_frame(const RilievoSurface* surface, size_t* count) {
  return Elements(surface->frame, count);
}

const float* rilievo_surface_heights(const RilievoSurface* surface, size_t* count) {
  return Elements(surface->decoded.surface.heights, count);
}

const float* rilievo_surface_height_changes(const RilievoSurface* surface, size_t* count) {
  return Elements(surface->decoded.height_changes, count);
}

const uint8_t* rilievo_surface_colors(const RilievoSurface* surface, size_t* count) {
  return rilievo::decoder_c::BytesOf(surface->decoded.surface.colors, count);
}

const double* rilievo_control_vertices(const RilievoSurface* surface, size_t* count) {
  return Elements(surface->control_vertices, count);
}

const uint32_t* rilievo_control_faces(const RilievoSurface* surface, size_t* count) {
  return AsUnsigned(Elements(surface->decoded.surface.control_mesh.faces, count));
}

const uint32_t* rilievo_control_creases(const RilievoSurface* surface, size_t* count) {
  return Elements(surface->crease_ends, count);
}

const float* rilievo_control_sharpness(const RilievoSurface* surface, size_t* count) {
  return Elements(surface->sharpness, count);
}

const uint32_t* rilievo_control_corners(const RilievoSurface* surface, size_t* count) {
  return AsUnsigned(Elements(surface->decoded.surface.control_mesh.corners, count));
}

const uint32_t* rilievo_control_diagonals(const RilievoSurface* surface, size_t* count) {
  const auto& diagonals = surface->decoded.surface.control_mesh.diagonals;
  if (count != nullptr) *count = 2 * diagonals.size();
  return diagonals.empty() ? nullptr : AsUnsigned(diagonals.front().data());
}
