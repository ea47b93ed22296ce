#include "client/formats/laz/gps_time_decoder.h"

namespace rilievo::laz {
namespace {

// Symbols for a step: 0 none of the multiples, 1 to 500 that multiple, 501 to 510 the multiples -1
// to -10, 511 the same time, then a whole time, and another of the sequences.
constexpr uint32_t kLargestMultiple = 500;
constexpr uint32_t kSmallestMultiple = 510;
constexpr uint32_t kWholeTime = 512;

}  // namespace

void GpsTimeDecoder::Skip(ArithmeticDecoder* decoder) {
  while (sequences_[current_].step == 0 ? SkipWithoutStep(decoder) : SkipWithStep(decoder)) {
    if (decoder->failed()) return;
  }
}

bool GpsTimeDecoder::SkipWithoutStep(ArithmeticDecoder* decoder) {
  const uint32_t symbol = decoder->Decode(&without_step_);
  if (symbol == 1) {
    sequences_[current_] = {.step = corrections_.Decode(decoder, 0)};
  } else if (symbol == 2) {
    SkipWholeTime(decoder);
  } else if (symbol > 2) {
    current_ = (current_ + symbol - 2) & 3;
    return true;
  }
  return false;
}

bool GpsTimeDecoder::SkipWithStep(ArithmeticDecoder* decoder) {
  const uint32_t symbol = decoder->Decode(&multiples_);
  Sequence& sequence = sequences_[current_];
  if (symbol == 1) {
    corrections_.Decode(decoder, 1);
    sequence.extreme_steps = 0;
  } else if (symbol == 0) {
    NoteExtremeStep(corrections_.Decode(decoder, 7));
  } else if (symbol < kLargestMultiple) {
    corrections_.Decode(decoder, symbol < 10 ? 2 : 3);
  } else if (symbol == kLargestMultiple) {
    NoteExtremeStep(kLargestMultiple * sequence.step + corrections_.Decode(decoder, 4));
  } else if (symbol < kSmallestMultiple) {
    corrections_.Decode(decoder, 5);
  } else if (symbol == kSmallestMultiple) {
    NoteExtremeStep(corrections_.Decode(decoder, 6) - 10 * sequence.step);
  } else if (symbol == kWholeTime) {
    SkipWholeTime(decoder);
  } else if (symbol > kWholeTime) {
    current_ = (current_ + symbol - kWholeTime) & 3;
    return true;
  }
  return false;
}

void GpsTimeDecoder::SkipWholeTime(ArithmeticDecoder* decoder) {
  corrections_.Decode(decoder, 8);
  decoder->DecodeBits(32);
  current_ = newest_ = (newest_ + 1) & 3;
  sequences_[current_] = {};
}

void GpsTimeDecoder::NoteExtremeStep(uint32_t step) {
  Sequence& sequence = sequences_[current_];
  if (++sequence.extreme_steps > 3) sequence = {.step = step};
}

}  // namespace rilievo::laz
