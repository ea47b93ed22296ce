// The GPS times of points.
#pragma once

#include <array>
#include <cstdint>

#include "client/formats/laz/arithmetic_decoder.h"
#include "client/formats/laz/integer_decoder.h"

namespace rilievo::laz {

// LASzip's items GPSTIME11, version 2, and the times of POINT14: up to four interleaved sequences
// of times, as the 64 bits of a double, each continued by a multiple of its last step and a
// correction (Isenburg 2013, section "Compressing gpstime11").
class GpsTimeDecoder {
 public:
  // In layers a time that stays has no symbol: it is asked for only where it changes.
  enum class Repeats { kHaveSymbols, kAreLeftOut };

  // `first`: the bits of the time before the first that is decoded.
  GpsTimeDecoder(uint64_t first, Repeats repeats);

  // The bits of the next time.
  uint64_t Decode(ArithmeticDecoder* decoder);

  uint64_t last() const { return sequences_[current_].time; }

 private:
  struct Sequence {
    uint64_t time = 0;      // bits of a double
    uint32_t step = 0;      // modulo 2^32, of both signs
    int extreme_steps = 0;  // in a row that were no multiple of `step`
  };

  // Both return whether the point's time is another sequence's.
  bool DecodeWithoutStep(ArithmeticDecoder* decoder);
  bool DecodeWithStep(ArithmeticDecoder* decoder);
  void DecodeWholeTime(ArithmeticDecoder* decoder);
  void Advance(uint32_t step);
  // By a step that is not a multiple of the last; the fourth in a row replaces it.
  void AdvanceFar(uint32_t step);

  const uint32_t repeat_symbols_;
  std::array<Sequence, 4> sequences_;
  uint32_t current_ = 0, newest_ = 0;
  SymbolModel without_step_, multiples_;
  IntegerDecoder corrections_{32, 9};
};

}  // namespace rilievo::laz
