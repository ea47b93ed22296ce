#include "client/formats/laz/gps_time_decoder.h"

namespace rilievo::laz {
namespace {

// Symbols for a step: 0 none of the multiples, 1 to 500 that multiple, 501 to 510 the multiples -1
// to -10, 511 the same time where that has a symbol, then a whole time, and another of the
// sequences.
constexpr uint32_t kLargestMultiple = 500;
constexpr uint32_t kSmallestMultiple = 510;

}  // namespace

GpsTimeDecoder::GpsTimeDecoder(uint64_t first, Repeats repeats)
    : repeat_symbols_(repeats == Repeats::kHaveSymbols ? 1 : 0),
      without_step_(5 + repeat_symbols_),
      multiples_(515 + repeat_symbols_) {
  sequences_[0].time = first;
}

uint64_t GpsTimeDecoder::Decode(ArithmeticDecoder* decoder) {
  while (sequences_[current_].step == 0 ? DecodeWithoutStep(decoder) : DecodeWithStep(decoder)) {
    if (decoder->failed()) break;
  }
  return last();
}

// Symbols: the same time where that has one, a step, a whole time, and another of the sequences.
bool GpsTimeDecoder::DecodeWithoutStep(ArithmeticDecoder* decoder) {
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

bool GpsTimeDecoder::DecodeWithStep(ArithmeticDecoder* decoder) {
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

void GpsTimeDecoder::DecodeWholeTime(ArithmeticDecoder* decoder) {
  const auto high = static_cast<uint32_t>(last() >> 32);
  const uint32_t new_high = high + corrections_.Decode(decoder, 8);
  const uint32_t low = decoder->DecodeBits(32);
  current_ = newest_ = (newest_ + 1) & 3;
  sequences_[current_] = {.time = uint64_t{new_high} << 32 | low};
}

void GpsTimeDecoder::Advance(uint32_t step) {
  sequences_[current_].time += static_cast<uint64_t>(int64_t{static_cast<int32_t>(step)});
}

void GpsTimeDecoder::AdvanceFar(uint32_t step) {
  Advance(step);
  Sequence& sequence = sequences_[current_];
  if (++sequence.extreme_steps <= 3) return;
  sequence.step = step;
  sequence.extreme_steps = 0;
}

}  // namespace rilievo::laz
