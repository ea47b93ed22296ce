#include <algorithm>
#include <array>
#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

#include "absl/strings/str_cat.h"
#include "client/formats/byte_source.h"
#include "client/formats/ply_elements.h"
#include "client/formats/ply_header.h"
#include "client/formats/ply_stations.h"
#include "client/formats/ply_vertex.h"
#include "client/formats/point_collector.h"
#include "client/formats/scan_reader.h"
#include "client/formats/sight_collector.h"
#include "core/base/status_macros.h"

namespace rilievo {
namespace {

// Of a scalar property; -1: there is none.
int FindScalar(const PlyElement& element, std::string_view name) {
  const int property = element.Find(name);
  return property >= 0 && !element.properties[static_cast<size_t>(property)].is_list ? property
                                                                                     : -1;
}

// The properties to read of a vertex, and what they are.
class VertexColumns {
 public:
  // `stations`: of the file.
  VertexColumns(const PlyElement& element, const std::array<int, 3>& position,
                const WantedLayers& wanted, const PlyStations& stations, SightCollector* sights)
      : scalars_(position.begin(), position.end()) {
    const auto find = [&](std::string_view name) { return FindScalar(element, name); };
    sight_columns_ = SightColumns(wanted, find, &scalars_);
    const int red = sight_columns_.color_column(scalars_);
    if (red >= 0) {
      sights->set_color_kind(
          ColorCollector::KindOf(element.properties[static_cast<size_t>(red)].type));
    }
    const int station = find("station");
    if (station < 0 || stations.element() < 0 || sight_columns_.has_sensor()) return;
    station_at_ = scalars_.size();
    scalars_.push_back(station);
  }

  std::span<const int> scalars() const { return scalars_; }

  void Take(const double* values, PlyStations* stations, PointCollector* points,
            SightCollector* sights) const {
    if (!sight_columns_.Take(values, points, sights)) return;
    if (station_at_ > 0) stations->AddVertex(values[station_at_]);
  }

 private:
  std::vector<int> scalars_;
  SightColumns sight_columns_;
  size_t station_at_ = 0;  // in scalars_; 0: none
};

}  // namespace

absl::StatusOr<ScanFile> ReadPlyScan(std::istream& in, const WantedLayers& wanted) {
  ByteSource source(in);
  RILIEVO_ASSIGN_OR_RETURN(const PlyHeader header, ReadPlyHeader(&source));
  RILIEVO_ASSIGN_OR_RETURN(const PlyVertexLayout vertex, FindPlyVertex(header));
  const PlyElement& element = header.elements[vertex.element_index];
  PlyStations stations(header, wanted);
  SightCollector sights(wanted);
  PointCollector points(wanted);
  const VertexColumns columns(element, vertex.position, wanted, stations, &sights);
  ScanFile scan;
  const auto read_vertices = [&]() -> absl::Status {
    RILIEVO_RETURN_IF_ERROR(CheckElementFits(element, header.ascii(), source));
    if (source.remaining()) RILIEVO_RETURN_IF_ERROR(points.Reserve(element.count));
    PlyElementReader reader(&source, header, element, columns.scalars(), -1);
    for (uint64_t i = 0; i < element.count; ++i) {
      RILIEVO_RETURN_IF_ERROR(reader.Next());
      columns.Take(reader.scalars(), &stations, &points, &sights);
      RILIEVO_RETURN_IF_ERROR(points.status());
    }
    return absl::OkStatus();
  };
  const int last = std::max(static_cast<int>(vertex.element_index), stations.element());
  for (int i = 0; i <= last; ++i) {
    if (i == static_cast<int>(vertex.element_index)) {
      RILIEVO_RETURN_IF_ERROR(read_vertices());
    } else if (i == stations.element()) {
      RILIEVO_RETURN_IF_ERROR(stations.Read(&source, header));
    } else {
      RILIEVO_RETURN_IF_ERROR(SkipPlyElement(&source, header, header.elements[i]));
    }
  }
  RILIEVO_RETURN_IF_ERROR(stations.Finish(&sights));
  scan.cloud.sights = sights.Finish(points.count());
  scan.layers.intensity = sights.FinishIntensity(points.count());
  scan.cloud.points = points.Finish();
  scan.class_counts = points.class_counts();
  scan.format = absl::StrCat("PLY ", PlyFormatName(header.format));
  for (const PlyElement& other : header.elements) {
    if (other.name == "face" || other.name == "tristrips") scan.faces += other.count;
  }
  return scan;
}

}  // namespace rilievo
