// A chunk of points of the formats 0 to 5, whose items are coded one point after the other.
#pragma once

#include <optional>

#include "client/formats/laz/color_decoder.h"
#include "client/formats/laz/gps_time_decoder.h"
#include "client/formats/laz/laz_parameters.h"
#include "client/formats/laz/point10_decoder.h"
#include "client/formats/laz/wave_packet_decoder.h"

namespace rilievo::laz {

// The first point stands before the chunk as it is; a coder that starts behind it serves all items.
class PointwiseChunk {
 public:
  // Decodes from the next byte of the source on, until End().
  PointwiseChunk(const LazParameters& parameters, const char* first, ByteSource* source);

  // Writes what is read of the next point into `record`. False: the source has ended, or what it
  // holds is not of this coder.
  bool Decode(char* record);

  void End() { decoder_.Stop(); }

 private:
  const LazParameters& parameters_;
  ArithmeticDecoder decoder_;
  Point10Decoder point_;
  std::optional<GpsTimeDecoder> gps_time_;
  std::optional<ColorDecoder> colors_;
  Color color_;
  std::optional<WavePacketDecoder> wave_packet_;
  ContextModels extra_bytes_;
};

}  // namespace rilievo::laz
