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
  GpsTimeDecoder(uint64_t first, Repeats repeats)
      : repeat_symbols_(repeats == Repeats::kHaveSymbols ? 1 : 0),
        without_step_(5 + repeat_symbols_),
        multiples_(515 + repeat_symbols_) {
    sequences_[0].time = first;
  }

  // The bits of the next time.
  uint64_t Decode(ArithmeticDecoder* decoder);

  uint64_t last() const { return sequences_[current_].time; }

 private:
  struct Sequence {
    uint64_t time = 0;      // bits of a double
    uint32_t step = 0;      // modulo 2^32, of both signs
    int extreme_steps = 0;  // in a row that were no multiple of `step`
  };

  // Symbols for a step: 0 none of the multiples, 1 to 500 that multiple, 501 to 510 the multiples
  // -1 to -10, 511 the same time where that has a symbol, then a whole time, and another of the
  // sequences.
  static constexpr uint32_t kLargestMultiple = 500;
  static constexpr uint32_t kSmallestMultiple = 510;

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

inline uint64_t GpsTimeDecoder::Decode(ArithmeticDecoder* decoder) {
  while (sequences_[current_].step == 0 ? DecodeWithoutStep(decoder) : DecodeWithStep(decoder)) {
    if (decoder->failed()) break;
  }
  return last();
}

// Symbols: the same time where that has one, a step, a whole time, and another of the sequences.
inline bool GpsTimeDecoder::DecodeWithoutStep(ArithmeticDecoder* decoder) {
  const uint32_t step = repeat_symbols_, whole_time = step + 1;
  const uint32_t symbol = decoder->Decode(&without_step_);
  if (symbol == step) {
    Sequence& sequence = sequences_[current_];
    sequence.step = corrections_.Decode(decoder, 0);
    sequence.extreme_steps = 0;
    Advance(sequence.step);
  } else if (symbol == whole_time) {
    DecodeWholeTime(decoder);
  } else if (symbol > whole_time) {
    current_ = (current_ + symbol - whole_time) & 3;
    return true;
  }
  return false;
}

inline bool GpsTimeDecoder::DecodeWithStep(ArithmeticDecoder* decoder) {
  const uint32_t whole_time = kSmallestMultiple + 1 + repeat_symbols_;
  const uint32_t symbol = decoder->Decode(&multiples_);
  Sequence& sequence = sequences_[current_];
  const uint32_t step = sequence.step;
  if (symbol == 1) {
    Advance(step + corrections_.Decode(decoder, 1));
    sequence.extreme_steps = 0;
  } else if (symbol == 0) {
    AdvanceFar(corrections_.Decode(decoder, 7));
  } else if (symbol < kLargestMultiple) {
    Advance(symbol * step + corrections_.Decode(decoder, symbol < 10 ? 2 : 3));
  } else if (symbol == kLargestMultiple) {
    AdvanceFar(kLargestMultiple * step + corrections_.Decode(decoder, 4));
  } else if (symbol < kSmallestMultiple) {
    Advance((kLargestMultiple - symbol) * step + corrections_.Decode(decoder, 5));
  } else if (symbol == kSmallestMultiple) {
    AdvanceFar((kLargestMultiple - symbol) * step + corrections_.Decode(decoder, 6));
  } else if (symbol == whole_time) {
    DecodeWholeTime(decoder);
  } else if (symbol > whole_time) {
    current_ = (current_ + symbol - whole_time) & 3;
    return true;
  }
  return false;
}

inline void GpsTimeDecoder::DecodeWholeTime(ArithmeticDecoder* decoder) {
  const auto high = static_cast<uint32_t>(last() >> 32);
  const uint32_t new_high = high + corrections_.Decode(decoder, 8);
  const uint32_t low = decoder->DecodeBits(32);
  current_ = newest_ = (newest_ + 1) & 3;
  sequences_[current_] = {.time = uint64_t{new_high} << 32 | low};
}

inline void GpsTimeDecoder::Advance(uint32_t step) {
  sequences_[current_].time += static_cast<uint64_t>(int64_t{static_cast<int32_t>(step)});
}

inline void GpsTimeDecoder::AdvanceFar(uint32_t step) {
  Advance(step);
  Sequence& sequence = sequences_[current_];
  if (++sequence.extreme_steps <= 3) return;
  sequence.step = step;
  sequence.extreme_steps = 0;
}

}  // namespace rilievo::laz
