#include "client/formats/byte_source.h"
#include "client/formats/obj_lines.h"
#include "client/formats/point_collector.h"
#include "client/formats/scan_reader.h"
#include "core/base/status_macros.h"

namespace rilievo {

absl::StatusOr<ScanFile> ReadObjScan(std::istream& in) {
  ByteSource source(in);
  PointCollector points;
  uint64_t faces = 0;
  ObjVisitor visitor;
  visitor.vertex = [&](const Eigen::Vector3d& p) { points.Add(p.x(), p.y(), p.z()); };
  visitor.face = [&](std::string_view) {
    ++faces;
    return absl::OkStatus();
  };
  RILIEVO_RETURN_IF_ERROR(VisitObjLines(&source, visitor));
  if (points.count() == 0) {
    return absl::InvalidArgumentError("OBJ: no 'v' line, no points; is this an OBJ file?");
  }
  return ScanFile{{points.Finish()}, "OBJ", {}, faces};
}

}  // namespace rilievo
