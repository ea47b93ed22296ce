#include "client/formats/laz/arithmetic_model.h"

#include <algorithm>

namespace rilievo::laz {
namespace {

// Buckets for the search of a symbol: so many that most of them hold one symbol's start or none.
int BucketBits(uint32_t symbols) {
  int bits = 4;
  while (bits < 8 && (1u << bits) < 2 * symbols) ++bits;
  return bits;
}

}  // namespace

SymbolModel::SymbolModel(uint32_t symbols)
    : last_symbol_(symbols - 1),
      bucket_shift_(kBits - BucketBits(symbols)),
      interval_(symbols),
      shares_(size_t{symbols} + 1, Share{.lower = 0xffff, .count = 1}),
      // One bucket more: what is asked for may lie a little beyond 2^kBits.
      first_((size_t{1} << BucketBits(symbols)) + 1) {
  Update();
  until_update_ = interval_ = (symbols + 6) / 2;
}

void SymbolModel::Update() {
  total_ += interval_;
  if (total_ > (1u << kBits)) {
    total_ = 0;
    for (size_t symbol = 0; symbol <= last_symbol_; ++symbol) {
      uint16_t& count = shares_[symbol].count;
      count = static_cast<uint16_t>((count + 1) / 2);
      total_ += count;
    }
  }
  const uint32_t scale = (1u << 31) / total_;
  uint32_t sum = 0;
  size_t bucket = 0;
  for (size_t symbol = 0; symbol <= last_symbol_; ++symbol) {
    const uint32_t lower = (scale * sum) >> (31 - kBits);
    shares_[symbol].lower = static_cast<uint16_t>(lower);
    sum += shares_[symbol].count;
    for (; bucket << bucket_shift_ < lower; ++bucket) {
      first_[bucket] = static_cast<uint16_t>(symbol - 1);
    }
  }
  std::fill(first_.begin() + static_cast<std::ptrdiff_t>(bucket), first_.end(),
            static_cast<uint16_t>(last_symbol_));
  interval_ = std::min(interval_ * 5 / 4, (last_symbol_ + 7) * 8);
  until_update_ = interval_;
}

void BitModel::Update() {
  count_ += interval_;
  if (count_ > (1u << kBits)) {
    count_ = (count_ + 1) / 2;
    zero_count_ = (zero_count_ + 1) / 2;
    if (zero_count_ == count_) ++count_;
  }
  const uint32_t scale = (1u << 31) / count_;
  zeros_ = (zero_count_ * scale) >> (31 - kBits);
  interval_ = std::min(interval_ * 5 / 4, 64u);
  until_update_ = interval_;
}

}  // namespace rilievo::laz
