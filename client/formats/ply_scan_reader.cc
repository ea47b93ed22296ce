#include <algorithm>
#include <array>
#include <cmath>
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

// The properties to read of a vertex, and which of them are layers.
class LayerColumns {
 public:
  LayerColumns(const PlyElement& element, const std::array<int, 3>& position,
               const WantedLayers& wanted)
      : scalars_(position.begin(), position.end()) {
    if (wanted.colors) {
      const std::array<int, 3> color = {Find(element, "red"), Find(element, "green"),
                                        Find(element, "blue")};
      if (*std::min_element(color.begin(), color.end()) >= 0) AddColors(element, color);
    }
    if (!wanted.intensity) return;
    int intensity = Find(element, "intensity");
    if (intensity < 0) intensity = Find(element, "scalar_Intensity");
    if (intensity < 0) return;
    intensity_at_ = scalars_.size();
    scalars_.push_back(intensity);
  }

  // After the layers. `stations`: of the file.
  void AddSights(const PlyElement& element, const WantedLayers& wanted,
                 const PlyStations& stations) {
    const auto find = [&](std::string_view name) { return Find(element, name); };
    sights_ = SightColumns(wanted, find, &scalars_);
    const int station = Find(element, "station");
    if (station < 0 || stations.element() < 0 || sights_.has_sensor()) return;
    station_at_ = scalars_.size();
    scalars_.push_back(station);
  }

  std::span<const int> scalars() const { return scalars_; }

  void Take(const double* values, PointLayers* layers) {
    if (intensity_at_ > 0) layers->intensity.push_back(static_cast<float>(values[intensity_at_]));
    if (color_at_ == 0) return;
    const double* channels = values + color_at_;
    if (bytes_) {
      layers->colors.push_back({Clamped(channels[0]), Clamped(channels[1]), Clamped(channels[2])});
      return;
    }
    std::array<float, 3>& color = colors_.emplace_back();
    for (size_t channel = 0; channel < 3; ++channel) {
      color[channel] = static_cast<float>(channels[channel]);
      if (std::isfinite(channels[channel])) largest_ = std::max(largest_, channels[channel]);
    }
  }

  void TakeSights(const double* values, PlyStations* stations, SightCollector* sights) const {
    sights_.Take(values, sights);
    if (station_at_ > 0) stations->AddVertex(values[station_at_]);
  }

  // After the last point.
  void Finish(PointLayers* layers) const {
    const double scale = Scale();
    const double half = integers_ ? 0 : 0.5;  // of integers the highest byte, as LAS readers do
    for (const std::array<float, 3>& color : colors_) {
      layers->colors.push_back({Clamped(color[0] * scale + half), Clamped(color[1] * scale + half),
                                Clamped(color[2] * scale + half)});
    }
  }

 private:
  // Of a scalar property; -1: there is none.
  static int Find(const PlyElement& element, std::string_view name) {
    const int property = element.Find(name);
    return property >= 0 && !element.properties[static_cast<size_t>(property)].is_list ? property
                                                                                       : -1;
  }

  // The format does not say how much full colour is where a channel is no byte: programs write 0 to
  // 255 into ints and floats too, so the largest value of the file tells.
  double Scale() const {
    if (!integers_) return largest_ > 2 ? 1 : 255;
    if (largest_ > 65535) return 0x1p-24;
    return largest_ > 255 ? 0x1p-8 : 1;
  }

  static uint8_t Clamped(double value) {
    return static_cast<uint8_t>(value >= 255 ? 255 : value > 0 ? value : 0);
  }

  void AddColors(const PlyElement& element, const std::array<int, 3>& color) {
    const ScalarType type = element.properties[static_cast<size_t>(color[0])].type;
    integers_ = IsInteger(type);
    bytes_ = integers_ && ScalarSize(type) == 1;
    color_at_ = scalars_.size();
    scalars_.insert(scalars_.end(), color.begin(), color.end());
  }

  std::vector<int> scalars_;
  SightColumns sights_;
  size_t color_at_ = 0, intensity_at_ = 0, station_at_ = 0;  // in scalars_; 0: none
  bool integers_ = false, bytes_ = false;                    // the channels
  double largest_ = 0;                                       // of the channels
  std::vector<std::array<float, 3>> colors_;
};

}  // namespace

absl::StatusOr<ScanFile> ReadPlyScan(std::istream& in, const WantedLayers& wanted) {
  ByteSource source(in);
  RILIEVO_ASSIGN_OR_RETURN(const PlyHeader header, ReadPlyHeader(&source));
  RILIEVO_ASSIGN_OR_RETURN(const PlyVertexLayout vertex, FindPlyVertex(header));
  const PlyElement& element = header.elements[vertex.element_index];
  PlyStations stations(header, wanted);
  SightCollector sights(wanted);
  PointCollector points;
  LayerColumns columns(element, vertex.position, wanted);
  columns.AddSights(element, wanted, stations);
  ScanFile scan;
  const auto read_vertices = [&]() -> absl::Status {
    RILIEVO_RETURN_IF_ERROR(CheckElementFits(element, header.ascii(), source));
    if (source.remaining()) points.Reserve(element.count);
    PlyElementReader reader(&source, header, element, columns.scalars(), -1);
    for (uint64_t i = 0; i < element.count; ++i) {
      RILIEVO_RETURN_IF_ERROR(reader.Next());
      points.Add(reader.scalars()[0], reader.scalars()[1], reader.scalars()[2]);
      columns.Take(reader.scalars(), &scan.layers);
      columns.TakeSights(reader.scalars(), &stations, &sights);
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
  columns.Finish(&scan.layers);
  RILIEVO_RETURN_IF_ERROR(stations.Finish(&sights));
  scan.cloud.sights = sights.Finish(points.count());
  scan.cloud.points = points.Finish();
  scan.format = absl::StrCat("PLY ", PlyFormatName(header.format));
  for (const PlyElement& other : header.elements) {
    if (other.name == "face" || other.name == "tristrips") scan.faces += other.count;
  }
  return scan;
}

}  // namespace rilievo
