// The GPS time of a point of the formats 1, 3, 4 and 5.
#pragma once

#include <array>
#include <cstdint>

#include "client/formats/laz/arithmetic_decoder.h"
#include "client/formats/laz/integer_decoder.h"

namespace rilievo::laz {

// LASzip's item GPSTIME11, version 2: up to four interleaved sequences of times, each continued by
// a multiple of its last step and a correction (Isenburg 2013, section "Compressing gpstime11").
// Nobody reads the times here, so that only what the decoding of later points hangs on is kept of
// them: the steps.
class GpsTimeDecoder {
 public:
  void Skip(ArithmeticDecoder* decoder);

 private:
  struct Sequence {
    uint32_t step = 0;      // modulo 2^32
    int extreme_steps = 0;  // in a row that were no multiple of `step`
  };

  // Both return whether the point's time is another sequence's.
  bool SkipWithoutStep(ArithmeticDecoder* decoder);
  bool SkipWithStep(ArithmeticDecoder* decoder);
  void SkipWholeTime(ArithmeticDecoder* decoder);
  // The next step is not a multiple of the last; the fourth in a row replaces it.
  void NoteExtremeStep(uint32_t step);

  std::array<Sequence, 4> sequences_;
  uint32_t current_ = 0, newest_ = 0;
  SymbolModel without_step_{6}, multiples_{516};
  IntegerDecoder corrections_{32, 9};
};

}  // namespace rilievo::laz
