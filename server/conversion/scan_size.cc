#include "server/conversion/scan_size.h"

#include <algorithm>

#include "absl/strings/str_cat.h"
#include "core/scan/clean/check_scan.h"
#include "core/scan/clean/settings.h"
#include "server/conversion/option_reader.h"

namespace rilievo {
namespace {

constexpr uint64_t kFewestVertices = 3, kFewestOfUpdate = 1;
constexpr uint64_t kMostRecords = uint64_t{1} << 40;  // more than any scan has

// `rest`: of the server's bytes, what the points leave.
std::optional<Excess> ReadTriangleCount(uint64_t count, int64_t rest, const ServerOptions& limits,
                                        OptionReader* reader, int64_t* triangle_count) {
  const int64_t most = std::min(limits.MaxTriangles(), rest / kTriangleBytes);
  if (count > static_cast<uint64_t>(most)) {
    reader->Violate("triangle_count",
                    absl::StrCat(count, " triangles; this server takes at most ", most,
                                 " with so many points, send a simpler mesh"));
    return Excess{most, count};
  }
  *triangle_count = static_cast<int64_t>(count);
  return std::nullopt;
}

// `rest`: as above.
std::optional<Excess> ReadBase(const v1::BaseSurface& base, int64_t rest,
                               const ServerOptions& limits, OptionReader* reader,
                               JobRequest* request) {
  if (base.bytes() == 0) reader->Violate("base_surface.bytes", "0; say how many follow the points");
  if (base.vertices() == 0) {
    reader->Violate("base_surface.vertices", "0; say how many its finest level has");
  }
  if (base.bytes() > static_cast<uint64_t>(rest)) {
    reader->Violate("base_surface.bytes",
                    absl::StrCat(base.bytes(), " bytes; this server takes at most ", rest,
                                 " with so many points"));
    return Excess{rest, base.bytes()};
  }
  // A closed surface has half as many vertices as faces, an open one of few triangles a face each.
  if (base.vertices() > static_cast<uint64_t>(limits.max_surface_faces)) {
    reader->Violate("base_surface.vertices",
                    absl::StrCat(base.vertices(), " vertices; this server builds at most ",
                                 limits.max_surface_faces, " faces"));
    return Excess{limits.max_surface_faces, base.vertices()};
  }
  request->size.base_bytes = static_cast<int64_t>(base.bytes());
  request->base_vertices = static_cast<int64_t>(base.vertices());
  request->update.whole = base.whole();
  return std::nullopt;
}

}  // namespace

PointLayout LayoutOf(const v1::ReconstructHeader& header) {
  return {.coordinates = header.coordinate_format() == v1::COORDINATE_FORMAT_FLOAT32_LE
                             ? CoordinateType::kFloat32
                             : CoordinateType::kFloat64,
          .stations = !header.stations().empty(),
          .normals = header.normals(),
          .colors = header.colors()};
}

int64_t ScanBytesOf(const v1::ReconstructHeader& header) {
  const uint64_t points = header.point_count(), triangles = header.triangle_count(),
                 base_bytes = header.base_surface().bytes();
  if (std::max({points, triangles, base_bytes}) > kMostRecords) return 0;
  return PayloadSize{LayoutOf(header), static_cast<int64_t>(points),
                     static_cast<int64_t>(triangles), static_cast<int64_t>(base_bytes)}
      .bytes();
}

std::optional<Excess> ReadScanSize(const v1::ReconstructHeader& header, const ServerOptions& limits,
                                   JobRequest* request, std::vector<FieldViolation>* violations) {
  OptionReader reader("header", violations);
  request->size.layout = LayoutOf(header);
  if (header.coordinate_format() != v1::COORDINATE_FORMAT_FLOAT32_LE &&
      header.coordinate_format() != v1::COORDINATE_FORMAT_FLOAT64_LE) {
    reader.Violate("coordinate_format",
                   absl::StrCat(header.coordinate_format(),
                                " is no CoordinateFormat; give FLOAT32_LE or FLOAT64_LE"));
  }
  const uint64_t count = header.point_count();
  const bool mesh = header.triangle_count() > 0;
  const bool update = header.has_base_surface();
  const uint64_t fewest = update ? kFewestOfUpdate
                          : mesh ? kFewestVertices
                                 : kCheckScan.min_scan_points;
  if (count < fewest) {
    reader.Violate("point_count", absl::StrCat(count,
                                               mesh     ? " vertices; a mesh"
                                               : update ? " points; an update"
                                                        : " points; a surface",
                                               " needs at least ", fewest));
    return std::nullopt;
  }
  // Compared without a product that could overflow.
  const int64_t most =
      std::min(limits.max_points, limits.max_scan_bytes / request->size.layout.bytes());
  if (count > static_cast<uint64_t>(most)) {
    reader.Violate("point_count",
                   absl::StrCat(count, " points in this format; this server takes at most ", most,
                                " in one scan, send fewer"));
    return Excess{most, count};
  }
  request->size.points = static_cast<int64_t>(count);
  const int64_t rest = limits.max_scan_bytes - request->size.points * request->size.layout.bytes();
  if (update) return ReadBase(header.base_surface(), rest, limits, &reader, request);
  return ReadTriangleCount(header.triangle_count(), rest, limits, &reader,
                           &request->size.triangles);
}

}  // namespace rilievo
