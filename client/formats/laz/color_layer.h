// The colours of a chunk of points of the formats 7, 8 and 10.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string_view>

#include "client/formats/laz/color_decoder.h"

namespace rilievo::laz {

// The first layer of LASzip's items RGB14 and RGBNIR14: each scanner channel has models and a last
// colour of its own. In version 3 the channel counts as 0 but for points at which it changes, and a
// point that returns to a channel is predicted from, and becomes, the last colour of the channel
// before: a fault of LASzip that files of it have, mended in version 4.
class ColorLayer {
 public:
  // `layer`: empty where no colour differs from its prediction; `first` and `channel`: of the first
  // point.
  ColorLayer(std::string_view layer, int item_version, const Color& first, uint32_t channel);

  // `channel`: of the point; `changed`: it is not that of the point before.
  const Color& Decode(uint32_t channel, bool changed);

  bool failed() const { return decoder_.failed(); }
  bool at_end() const { return decoder_.at_end(); }

 private:
  struct Channel {
    ColorDecoder models;
    Color last;
  };

  const bool present_, keeps_channels_;
  ArithmeticDecoder decoder_;
  uint32_t current_;
  std::array<std::optional<Channel>, 4> channels_;
};

}  // namespace rilievo::laz
