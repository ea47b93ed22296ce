#include <limits>
#include <utility>

#include "absl/strings/str_cat.h"
#include "client/decoder_c/guarded.h"
#include "client/decoder_c/mesh.h"
#include "core/base/status_macros.h"
#include "core/booleans/combine_solids.h"
#include "core/booleans/solid_of_mesh.h"

namespace rilievo::decoder_c {
namespace {

constexpr size_t kMostNumbers = std::numeric_limits<int>::max();

absl::StatusOr<TriangleMesh> SolidOfArrays(const double* vertices, size_t vertex_count,
                                           const uint32_t* faces, size_t face_count, int threads) {
  if (vertex_count > kMostNumbers || face_count > kMostNumbers) {
    return absl::InvalidArgumentError(absl::StrCat(vertex_count, " vertices and ", face_count,
                                                   " triangles: at most ", kMostNumbers,
                                                   " of each are taken"));
  }
  PointCloud cloud;
  cloud.points = Eigen::Map<const Eigen::Matrix3Xd>(vertices, 3, vertex_count);
  // What is not an int becomes an index of no vertex.
  cloud.triangles =
      Eigen::Map<const Eigen::Matrix<uint32_t, 3, Eigen::Dynamic>>(faces, 3, face_count)
          .unaryExpr([](uint32_t v) { return v > kMostNumbers ? -1 : static_cast<int>(v); });
  RunContext context;
  context.threads = Threads(threads);
  return SolidOfMesh(cloud, context);
}

absl::Status Combine(const RilievoMesh& a, const RilievoMesh& b, int operation, int threads,
                     RilievoMesh** mesh) {
  if (operation < RILIEVO_UNION || operation > RILIEVO_DIFFERENCE) {
    return absl::InvalidArgumentError(
        absl::StrCat("operation ", operation, ": must be from 0 to 2"));
  }
  RunContext context;
  context.threads = Threads(threads);
  RILIEVO_ASSIGN_OR_RETURN(CombinedSolids combined,
                           CombineSolids({a.vertices, a.faces, {}}, {b.vertices, b.faces, {}},
                                         static_cast<SolidOperation>(operation), context));
  *mesh = WrapMesh(std::move(combined.mesh));
  return absl::OkStatus();
}

}  // namespace
}  // namespace rilievo::decoder_c

RilievoCode rilievo_mesh_create(const double* vertices, size_t vertex_count, const uint32_t* faces,
                                size_t face_count, int threads, RilievoMesh** mesh) {
  using namespace rilievo::decoder_c;
  return Guarded([&]() -> absl::Status {
    RILIEVO_RETURN_IF_ERROR(NotNull(mesh, "mesh"));
    *mesh = nullptr;
    if (vertex_count > 0) RILIEVO_RETURN_IF_ERROR(NotNull(vertices, "vertices"));
    if (face_count > 0) RILIEVO_RETURN_IF_ERROR(NotNull(faces, "faces"));
    RILIEVO_ASSIGN_OR_RETURN(rilievo::TriangleMesh solid,
                             SolidOfArrays(vertices, vertex_count, faces, face_count, threads));
    *mesh = WrapMesh(std::move(solid));
    return absl::OkStatus();
  });
}

RilievoCode rilievo_combine(const RilievoMesh* a, const RilievoMesh* b, int operation, int threads,
                            RilievoMesh** mesh) {
  using namespace rilievo::decoder_c;
  return Guarded([&]() -> absl::Status {
    RILIEVO_RETURN_IF_ERROR(NotNull(mesh, "mesh"));
    *mesh = nullptr;
    RILIEVO_RETURN_IF_ERROR(NotNull(a, "a"));
    RILIEVO_RETURN_IF_ERROR(NotNull(b, "b"));
    return Combine(*a, *b, operation, threads, mesh);
  });
}
