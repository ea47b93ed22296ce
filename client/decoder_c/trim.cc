#include <utility>

#include "absl/strings/str_cat.h"
#include "client/decoder_c/guarded.h"
#include "client/decoder_c/mesh.h"
#include "core/base/status_macros.h"
#include "core/booleans/trim_mesh.h"

namespace rilievo::decoder_c {
namespace {

absl::StatusOr<TrimShape> ShapeOf(int kind, const double* numbers, size_t count) {
  const auto vector = [&](size_t at) {
    return Eigen::Vector3d(numbers[at], numbers[at + 1], numbers[at + 2]);
  };
  if (kind == RILIEVO_PLANE && count == 4) return Plane{vector(0), numbers[3]};
  if (kind == RILIEVO_BOX && count == 6) return TrimBox{vector(0), vector(3)};
  if (kind == RILIEVO_SPHERE && count == 4) return TrimSphere{vector(0), numbers[3]};
  // The greatest number of corners is asked for before anything is copied.
  if (kind == RILIEVO_PRISM && count >= 3 && count % 3 == 0 &&
      count / 3 <= static_cast<size_t>(kMostPrismCorners) + 1) {
    const auto corners = static_cast<Eigen::Index>(count / 3) - 1;
    return TrimPrism{Eigen::Map<const Eigen::Matrix3Xd>(numbers + 3, 3, corners), vector(0)};
  }
  return absl::InvalidArgumentError(absl::StrCat(
      "shape ", kind, " of ", count,
      " numbers: a plane (0) and a sphere (2) have 4, a box (1) has 6, a prism (3) 3 of its "
      "direction and 3 of each corner, of which it has 3 to ",
      kMostPrismCorners));
}

}  // namespace
}  // namespace rilievo::decoder_c

RilievoCode rilievo_trim(const RilievoMesh* mesh, int shape, const double* numbers, size_t count,
                         int outside, int cap, int threads, RilievoMesh** trimmed) {
  using namespace rilievo::decoder_c;
  return Guarded([&]() -> absl::Status {
    RILIEVO_RETURN_IF_ERROR(NotNull(trimmed, "trimmed"));
    *trimmed = nullptr;
    RILIEVO_RETURN_IF_ERROR(NotNull(mesh, "mesh"));
    RILIEVO_RETURN_IF_ERROR(NotNull(numbers, "numbers"));
    RILIEVO_ASSIGN_OR_RETURN(const rilievo::TrimShape by, ShapeOf(shape, numbers, count));
    const rilievo::TriangleMesh given{mesh->vertices, mesh->faces, {}};
    const auto side = outside != 0 ? rilievo::KeptSide::kOutside : rilievo::KeptSide::kInside;
    rilievo::RunContext context;
    context.threads = Threads(threads);
    RILIEVO_ASSIGN_OR_RETURN(rilievo::TrimmedMesh made, cap != 0
                                                            ? TrimSolid(given, by, side, context)
                                                            : TrimMesh(given, by, side, context));
    *trimmed = WrapMesh(std::move(made.mesh));
    return absl::OkStatus();
  });
}
