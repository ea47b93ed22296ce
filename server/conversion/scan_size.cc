#include "server/conversion/scan_size.h"

#include <algorithm>

#include "absl/strings/str_cat.h"
#include "core/scan/clean/check_scan.h"
#include "server/conversion/option_reader.h"

namespace rilievo {
namespace {

constexpr uint64_t kFewestVertices = 3;
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
  if (header.point_count() > kMostRecords || header.triangle_count() > kMostRecords) return 0;
  return BytesOfRecords(LayoutOf(header), static_cast<int64_t>(header.point_count()),
                        static_cast<int64_t>(header.triangle_count()));
}

std::optional<Excess> ReadScanSize(const v1::ReconstructHeader& header, const ServerOptions& limits,
                                   JobRequest* request, std::vector<FieldViolation>* violations) {
  OptionReader reader("header", violations);
  request->layout = LayoutOf(header);
  if (header.coordinate_format() != v1::COORDINATE_FORMAT_FLOAT32_LE &&
      header.coordinate_format() != v1::COORDINATE_FORMAT_FLOAT64_LE) {
    reader.Violate("coordinate_format",
                   absl::StrCat(header.coordinate_format(),
                                " is no CoordinateFormat; give FLOAT32_LE or FLOAT64_LE"));
  }
  const uint64_t count = header.point_count();
  const bool mesh = header.triangle_count() > 0;
  const uint64_t fewest = mesh ? kFewestVertices : kMinScanPoints;
  if (count < fewest) {
    reader.Violate("point_count",
                   absl::StrCat(count, mesh ? " vertices; a mesh" : " points; a surface",
                                " needs at least ", fewest));
    return std::nullopt;
  }
  // Compared without a product that could overflow.
  const int64_t most = std::min(limits.max_points, limits.max_scan_bytes / request->layout.bytes());
  if (count > static_cast<uint64_t>(most)) {
    reader.Violate("point_count",
                   absl::StrCat(count, " points in this format; this server takes at most ", most,
                                " in one scan, send fewer"));
    return Excess{most, count};
  }
  request->point_count = static_cast<int64_t>(count);
  const int64_t rest = limits.max_scan_bytes - request->point_count * request->layout.bytes();
  return ReadTriangleCount(header.triangle_count(), rest, limits, &reader,
                           &request->triangle_count);
}

}  // namespace rilievo
