// The point of the formats 6 to 10, layer by layer.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <string_view>

#include "client/formats/laz/arithmetic_decoder.h"
#include "client/formats/laz/gps_time_decoder.h"

namespace rilievo::laz {

// The layers that are read; one that is empty stays as the first point of the chunk has it.
struct Point14Layers {
  std::string_view place;  // scanner channel, returns, x and y
  std::string_view z, classes, flags, intensity, times;
};

// LASzip's item POINT14, versions 3 and 4: the prediction of POINT10 with four scanner channels
// that know nothing of each other, and an arithmetic coder for each layer (Isenburg, "A compressed
// LAS 1.4", 2014, and the source of LASzip 3).
class Point14Decoder {
 public:
  // A chunk that begins with the record `first`.
  Point14Decoder(const char* first, const Point14Layers& layers);
  ~Point14Decoder();

  // Writes x, y, z, intensity, returns, flags, class and time of the next point into `record`, the
  // rest stays. Returns whether its scanner channel is not that of the point before.
  bool Decode(char* record);

  uint32_t channel() const { return channel_; }
  bool failed() const;
  // All bytes of all layers were used, as they are after the last point.
  bool at_end() const;

 private:
  struct Point {
    uint32_t x = 0, y = 0, z = 0;  // modulo 2^32
    uint16_t intensity = 0;
    uint32_t number = 0, count = 0;  // of the return; of the returns
    uint32_t flags = 0;              // classification flags, 16 scan direction, 32 edge
    uint32_t classification = 0;
  };
  struct Channel;

  void DecodeReturn(Channel* channel, uint32_t changed);

  // A coder and whether the layer has anything to decode.
  struct Layer {
    explicit Layer(std::string_view bytes) : present(!bytes.empty()) {
      if (present) decoder.Start(bytes);
    }
    bool present;
    ArithmeticDecoder decoder;
  };

  Layer place_, z_, classes_, flags_, intensity_, times_;
  uint32_t channel_;
  std::array<std::unique_ptr<Channel>, 4> channels_;
};

}  // namespace rilievo::laz
