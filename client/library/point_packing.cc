#include "client/library/point_packing.h"

namespace rilievo {

v1::ReconstructHeader HeaderOf(const PointCloud& scan, const PointLayout& layout) {
  v1::ReconstructHeader header;
  header.set_point_count(static_cast<uint64_t>(scan.points.cols()));
  header.set_coordinate_format(layout.coordinates == CoordinateType::kFloat32
                                   ? v1::COORDINATE_FORMAT_FLOAT32_LE
                                   : v1::COORDINATE_FORMAT_FLOAT64_LE);
  if (layout.stations) {
    header.set_stations(PackPoints({scan.sights.stations}, 0, scan.sights.stations.cols(),
                                   {.coordinates = CoordinateType::kFloat64}));
  }
  header.set_normals(layout.normals);
  header.set_colors(layout.colors);
  header.set_triangle_count(static_cast<uint64_t>(scan.triangles.cols()));
  return header;
}

v1::BaseSurface ProtoBase(const UpdatedSurface& base) {
  v1::BaseSurface proto;
  proto.set_bytes(base.dss.size());
  proto.set_vertices(static_cast<uint64_t>(base.vertices));
  proto.set_whole(base.whole);
  return proto;
}

}  // namespace rilievo
