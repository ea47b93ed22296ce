#include <array>
#include <string_view>

#include "absl/strings/str_cat.h"
#include "client/formats/byte_source.h"
#include "client/formats/obj_lines.h"
#include "client/formats/point_collector.h"
#include "client/formats/scan_reader.h"
#include "client/formats/sight_collector.h"
#include "core/base/status_macros.h"

namespace rilievo {

absl::StatusOr<ScanFile> ReadObjScan(std::istream& in, const WantedLayers& wanted) {
  ByteSource source(in);
  PointCollector points(wanted);
  SightCollector sights(wanted);
  uint64_t faces = 0;
  ObjVisitor visitor;
  visitor.vertex = [&](const Eigen::Vector3d& p, std::string_view words) {
    points.Add(p.x(), p.y(), p.z());
    if (const auto color = ParseObjColor(words)) sights.AddColor(color->data());
    return points.status();
  };
  visitor.face = [&](std::string_view) {
    ++faces;
    return absl::OkStatus();
  };
  RILIEVO_RETURN_IF_ERROR(VisitObjLines(&source, visitor));
  if (points.count() == 0) {
    return absl::InvalidArgumentError("OBJ: no 'v' line, no points; is this an OBJ file?");
  }
  ScanFile scan;
  scan.format = absl::StrCat("OBJ", sights.LeftOut(points.count()));
  scan.cloud.sights = sights.Finish(points.count());
  scan.cloud.points = points.Finish();
  scan.faces = faces;
  return scan;
}

}  // namespace rilievo
