#include "core/codec/bytes/range_coder.h"

#include <utility>

namespace rilievo {

void RangeEncoder::ShiftLow() {
  const bool carry = low_ > 0xffffffffu;
  // No carry can reach beyond the first byte: it is held like any other, even when it is 255.
  if (carry || low_ < 0xff000000u || held_count_ == 0) {
    if (held_count_ > 0) {
      bytes_.push_back(static_cast<uint8_t>(held_ + (carry ? 1 : 0)));
      bytes_.insert(bytes_.end(), static_cast<size_t>(held_count_ - 1), carry ? 0x00 : 0xff);
    }
    held_ = static_cast<uint8_t>(low_ >> 24);
    held_count_ = 1;
  } else {
    ++held_count_;
  }
  low_ = (low_ & 0x00ffffffu) << 8;
}

std::vector<uint8_t> RangeEncoder::Finish() {
  // Any value in [low, low + range) will do: the one with the most zeros at its end.
  const uint64_t high = low_ + range_ - 1;
  for (int zeros = 32; zeros > 0; --zeros) {
    const uint64_t rounded = (high >> zeros) << zeros;
    if (rounded >= low_) {
      low_ = rounded;
      break;
    }
  }
  for (int i = 0; i < 5; ++i) ShiftLow();
  // Zeros at the end are understood; a decoder takes no more of them than this.
  for (int i = 0; i < static_cast<int>(kMaxLeftOff) && !bytes_.empty() && bytes_.back() == 0; ++i)
    bytes_.pop_back();
  return std::move(bytes_);
}

}  // namespace rilievo
