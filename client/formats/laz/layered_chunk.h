// A chunk of points of the formats 6 to 10, whose fields are coded in layers.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>

#include "absl/status/statusor.h"
#include "client/formats/byte_source.h"
#include "client/formats/laz/color_layer.h"
#include "client/formats/laz/laz_parameters.h"
#include "client/formats/laz/point14_decoder.h"
#include "client/formats/point_layers.h"

namespace rilievo::laz {

// Behind the first point, as it is, stand the number of points, the size of each layer and the
// layers. Those that nobody asks for are passed over, and so are classes, scan angles, user data,
// sources, near infrared, waveforms and extra bytes.
class LayeredChunk {
 public:
  // Reads it all. DATA_LOSS for a chunk of no points and for one that is cut off. The source must
  // not be used while the chunk is.
  static absl::StatusOr<std::unique_ptr<LayeredChunk>> Read(const LazParameters& parameters,
                                                            const WantedLayers& wanted,
                                                            const char* first, ByteSource* source);

  // As the chunk says, the first included.
  uint32_t point_count() const { return point_count_; }

  // Writes what is read of the next point into `record`. False: a layer is too short, or not of
  // this coder.
  bool Decode(char* record);

  // All layers were used up, as they are after the last point.
  bool at_end() const { return point_.at_end() && (!colors_ || colors_->at_end()); }

 private:
  LayeredChunk(uint32_t point_count, const char* first, const Point14Layers& layers)
      : point_count_(point_count), point_(first, layers) {}

  const uint32_t point_count_;
  Point14Decoder point_;
  std::optional<ColorLayer> colors_;
  size_t color_offset_ = 0;
};

}  // namespace rilievo::laz
