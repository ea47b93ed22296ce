#include <algorithm>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "absl/strings/str_cat.h"
#include "client/formats/byte_source.h"
#include "client/formats/ply_elements.h"
#include "client/formats/ply_header.h"
#include "client/formats/ply_vertex.h"
#include "client/formats/point_collector.h"
#include "client/formats/scan_reader.h"
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

  std::span<const int> scalars() const { return scalars_; }

  void Take(const double* values, PointLayers* layers) const {
    if (intensity_at_ > 0) layers->intensity.push_back(static_cast<float>(values[intensity_at_]));
    if (color_at_ == 0) return;
    std::array<uint8_t, 3> color;
    for (size_t channel = 0; channel < 3; ++channel) {
      const double value = values[color_at_ + channel] * color_scale_;
      color[channel] = static_cast<uint8_t>(value >= 255 ? 255 : value > 0 ? value : 0);
    }
    layers->colors.push_back(color);
  }

 private:
  // Of a scalar property; -1: there is none.
  static int Find(const PlyElement& element, const char* name) {
    const int property = element.Find(name);
    return property >= 0 && !element.properties[static_cast<size_t>(property)].is_list ? property
                                                                                       : -1;
  }

  void AddColors(const PlyElement& element, const std::array<int, 3>& color) {
    const ScalarType type = element.properties[static_cast<size_t>(color[0])].type;
    if (!IsInteger(type)) {
      color_scale_ = 255;
    } else if (ScalarSize(type) > 1) {
      color_scale_ = 1.0 / 256;
    }
    color_at_ = scalars_.size();
    scalars_.insert(scalars_.end(), color.begin(), color.end());
  }

  std::vector<int> scalars_;
  size_t color_at_ = 0, intensity_at_ = 0;  // in scalars_; 0: none
  double color_scale_ = 1;
};

}  // namespace

absl::StatusOr<ScanFile> ReadPlyScan(std::istream& in, const WantedLayers& wanted) {
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
  const LayerColumns columns(element, vertex.position, wanted);
  PlyElementReader reader(&source, header, element, columns.scalars(), -1);
  ScanFile scan;
  for (uint64_t i = 0; i < element.count; ++i) {
    RILIEVO_RETURN_IF_ERROR(reader.Next());
    points.Add(reader.scalars()[0], reader.scalars()[1], reader.scalars()[2]);
    columns.Take(reader.scalars(), &scan.layers);
  }
  scan.cloud.points = points.Finish();
  scan.format = absl::StrCat("PLY ", PlyFormatName(header.format));
  return scan;
}

}  // namespace rilievo
