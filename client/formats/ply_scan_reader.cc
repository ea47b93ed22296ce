#include <array>
#include <utility>

#include "absl/strings/str_cat.h"
#include "client/formats/byte_source.h"
#include "client/formats/ply_elements.h"
#include "client/formats/ply_header.h"
#include "client/formats/ply_vertex.h"
#include "client/formats/point_collector.h"
#include "client/formats/scan_reader.h"
#include "core/base/status_macros.h"

namespace rilievo {

absl::StatusOr<ScanFile> ReadPlyScan(std::istream& in) {
  ByteSource source(in);
  RILIEVO_ASSIGN_OR_RETURN(const PlyHeader header, ReadPlyHeader(&source));
  RILIEVO_ASSIGN_OR_RETURN(const PlyVertexLayout vertex, FindPlyVertex(header));
  for (size_t i = 0; i < vertex.element_index; ++i) {
    RILIEVO_RETURN_IF_ERROR(SkipPlyElement(&source, header, header.elements[i]));
  }
  const PlyElement& element = header.elements[vertex.element_index];
  RILIEVO_RETURN_IF_ERROR(CheckElementFits(element, header.ascii(), source));
  PointCollector points;
  if (source.remaining()) points.Reserve(element.count);
  PlyElementReader reader(&source, header, element, vertex.position, -1);
  for (uint64_t i = 0; i < element.count; ++i) {
    RILIEVO_RETURN_IF_ERROR(reader.Next());
    points.Add(reader.scalars()[0], reader.scalars()[1], reader.scalars()[2]);
  }
  return ScanFile{{points.Finish()}, absl::StrCat("PLY ", PlyFormatName(header.format))};
}

}  // namespace rilievo
