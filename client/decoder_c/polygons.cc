#include <limits>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "client/decoder_c/guarded.h"
#include "client/decoder_c/mesh.h"
#include "core/base/status_macros.h"
#include "core/loop/interpolate_vertices.h"
#include "core/schemes/subdivide_mesh.h"

struct RilievoPolygons {
  Eigen::Matrix3Xd vertices;
  std::vector<uint32_t> corners, corner_counts;
};

namespace rilievo::decoder_c {
namespace {

constexpr size_t kMostPolygonNumbers = std::numeric_limits<int>::max();

absl::StatusOr<PolygonMesh> MeshOfArrays(std::span<const double> vertices,
                                         std::span<const uint32_t> corners,
                                         std::span<const uint32_t> corner_counts) {
  if (vertices.size() / 3 > kMostPolygonNumbers || corners.size() > kMostPolygonNumbers) {
    return absl::InvalidArgumentError(absl::StrCat(vertices.size() / 3, " vertices and ",
                                                   corners.size(), " corners: at most ",
                                                   kMostPolygonNumbers, " of each are taken"));
  }
  PolygonMesh mesh;
  mesh.vertices = Eigen::Map<const Eigen::Matrix3Xd>(
      vertices.data(), 3, static_cast<Eigen::Index>(vertices.size() / 3));
  mesh.corners.reserve(corners.size());
  // What is not an int becomes an index of no vertex.
  for (const uint32_t v : corners)
    mesh.corners.push_back(v > kMostPolygonNumbers ? -1 : static_cast<int>(v));
  uint64_t end = 0;
  for (const uint32_t count : corner_counts) {
    end += count;
    if (end > corners.size()) break;
    mesh.begin.push_back(static_cast<int>(end));
  }
  if (end == corners.size() && mesh.begin.size() == corner_counts.size() + 1) return mesh;
  return absl::InvalidArgumentError(
      absl::StrCat("the faces have more or fewer corners than the ", corners.size(), " given"));
}

absl::Status Subdivide(const PolygonMesh& mesh, const char* scheme, int levels,
                       RilievoPolygons** polygons) {
  RILIEVO_ASSIGN_OR_RETURN(const SubdivisionScheme named, SchemeNamed(scheme));
  RILIEVO_ASSIGN_OR_RETURN(PolygonMesh made, SubdivideMesh(mesh, named, levels, {}, RunContext()));
  auto result = std::make_unique<RilievoPolygons>();
  result->vertices = std::move(made.vertices);
  result->corners.assign(made.corners.begin(), made.corners.end());
  for (int f = 0; f < made.face_count(); ++f) {
    result->corner_counts.push_back(static_cast<uint32_t>(made.Face(f).size()));
  }
  *polygons = result.release();
  return absl::OkStatus();
}

}  // namespace
}  // namespace rilievo::decoder_c

RilievoCode rilievo_subdivide(const double* vertices, size_t vertex_count, const uint32_t* corners,
                              size_t corner_count, const uint32_t* corner_counts, size_t face_count,
                              const char* scheme, int levels, RilievoPolygons** polygons) {
  using namespace rilievo::decoder_c;
  return Guarded([&]() -> absl::Status {
    RILIEVO_RETURN_IF_ERROR(NotNull(polygons, "polygons"));
    *polygons = nullptr;
    RILIEVO_RETURN_IF_ERROR(NotNull(scheme, "scheme"));
    if (vertex_count > 0) RILIEVO_RETURN_IF_ERROR(NotNull(vertices, "vertices"));
    if (corner_count > 0) RILIEVO_RETURN_IF_ERROR(NotNull(corners, "corners"));
    if (face_count > 0) RILIEVO_RETURN_IF_ERROR(NotNull(corner_counts, "corner_counts"));
    RILIEVO_ASSIGN_OR_RETURN(const rilievo::PolygonMesh mesh,
                             MeshOfArrays({vertices, 3 * vertex_count}, {corners, corner_count},
                                          {corner_counts, face_count}));
    return Subdivide(mesh, scheme, levels, polygons);
  });
}

RilievoCode rilievo_interpolate(const double* vertices, size_t vertex_count, const uint32_t* faces,
                                size_t face_count, RilievoMesh** cage) {
  using namespace rilievo::decoder_c;
  return Guarded([&]() -> absl::Status {
    RILIEVO_RETURN_IF_ERROR(NotNull(cage, "cage"));
    *cage = nullptr;
    if (vertex_count > 0) RILIEVO_RETURN_IF_ERROR(NotNull(vertices, "vertices"));
    if (face_count > 0) RILIEVO_RETURN_IF_ERROR(NotNull(faces, "faces"));
    const std::vector<uint32_t> three(face_count, 3);
    RILIEVO_ASSIGN_OR_RETURN(
        const rilievo::PolygonMesh mesh,
        MeshOfArrays({vertices, 3 * vertex_count}, {faces, 3 * face_count}, three));
    const rilievo::TriangleMesh triangles = FansOf(mesh);
    RILIEVO_ASSIGN_OR_RETURN(rilievo::InterpolatedMesh made,
                             InterpolateVertices({triangles.vertices, triangles.triangles, {}, {}},
                                                 {}, rilievo::RunContext()));
    *cage = WrapMesh({std::move(made.mesh.vertices), std::move(made.mesh.faces), {}});
    return absl::OkStatus();
  });
}

void rilievo_polygons_free(RilievoPolygons* polygons) { delete polygons; }

const double* rilievo_polygons_vertices(const RilievoPolygons* polygons, size_t* count) {
  return rilievo::decoder_c::Elements(polygons->vertices, count);
}
const uint32_t* rilievo_polygons_corners(const RilievoPolygons* polygons, size_t* count) {
  return rilievo::decoder_c::Elements(polygons->corners, count);
}
const uint32_t* rilievo_polygons_corner_counts(const RilievoPolygons* polygons, size_t* count) {
  return rilievo::decoder_c::Elements(polygons->corner_counts, count);
}
