#include <algorithm>
#include <limits>
#include <span>
#include <utility>

#include "absl/strings/str_cat.h"
#include "client/decoder_c/guarded.h"
#include "client/decoder_c/surface.h"
#include "core/base/status_macros.h"
#include "core/codec/container/deformed_surface.h"

namespace rilievo::decoder_c {
namespace {

constexpr size_t kMostCageNumber = std::numeric_limits<int>::max();

absl::Status CheckCount(size_t count, const char* name) {
  if (count <= kMostCageNumber / 3) return absl::OkStatus();
  return absl::InvalidArgumentError(
      absl::StrCat(name, " = ", count, ": at most ", kMostCageNumber / 3, " are taken"));
}

// What is not an int becomes the number of no vertex.
int CageNumber(uint32_t number) { return number > kMostCageNumber ? -1 : static_cast<int>(number); }

std::vector<Crease> CreasesOf(std::span<const uint32_t> ends, const float* sharpness) {
  std::vector<Crease> creases;
  for (size_t i = 0; 2 * i < ends.size(); ++i) {
    creases.push_back({CageNumber(ends[2 * i]), CageNumber(ends[2 * i + 1]), sharpness[i]});
  }
  return creases;
}

}  // namespace
}  // namespace rilievo::decoder_c

RilievoCode rilievo_surface_with_cage(const RilievoSurface* surface, const double* vertices,
                                      size_t vertex_count, const uint32_t* creases,
                                      const float* sharpness, size_t crease_count,
                                      const uint32_t* corners, size_t corner_count,
                                      RilievoSurface** moved) {
  using namespace rilievo::decoder_c;
  return Guarded([&]() -> absl::Status {
    RILIEVO_RETURN_IF_ERROR(NotNull(moved, "moved"));
    *moved = nullptr;
    RILIEVO_RETURN_IF_ERROR(NotNull(surface, "surface"));
    if (vertex_count > 0) RILIEVO_RETURN_IF_ERROR(NotNull(vertices, "vertices"));
    if (creases != nullptr && crease_count > 0) {
      RILIEVO_RETURN_IF_ERROR(NotNull(sharpness, "sharpness"));
    }
    RILIEVO_RETURN_IF_ERROR(CheckCount(vertex_count, "vertex_count"));
    RILIEVO_RETURN_IF_ERROR(CheckCount(crease_count, "crease_count"));
    RILIEVO_RETURN_IF_ERROR(CheckCount(corner_count, "corner_count"));
    rilievo::ControlMesh cage = surface->decoded.surface.control_mesh;
    cage.vertices =
        Eigen::Map<const Eigen::Matrix3Xd>(vertices, 3, static_cast<Eigen::Index>(vertex_count));
    if (creases != nullptr) cage.creases = CreasesOf({creases, 2 * crease_count}, sharpness);
    if (corners != nullptr) {
      cage.corners.resize(corner_count);
      std::transform(corners, corners + corner_count, cage.corners.begin(), CageNumber);
    }
    RILIEVO_ASSIGN_OR_RETURN(rilievo::DecodedSurface deformed,
                             rilievo::WithControlMesh(surface->decoded, cage));
    *moved = WrapSurface(std::move(deformed));
    return absl::OkStatus();
  });
}
