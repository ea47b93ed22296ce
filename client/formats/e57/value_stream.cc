#include "client/formats/e57/value_stream.h"

#include <algorithm>
#include <cstring>
#include <limits>

#include "client/formats/scalar_type.h"

namespace rilievo::e57 {
namespace {

// The bits of up to 8 bytes, fewer before `end`.
uint64_t LoadWord(const char* bytes, const char* end) {
  if (end - bytes >= 8) return LoadAs<uint64_t>(bytes, kSwapLittle);
  char padded[8] = {};
  std::copy(bytes, end, padded);
  return LoadAs<uint64_t>(padded, kSwapLittle);
}

}  // namespace

void ValueStream::Append(const char* bytes, size_t size) {
  // Used bytes are dropped only when they are the larger half: a stream that runs ahead of the
  // others would otherwise be moved for each packet.
  if (begin_ > bytes_.size() / 2) {
    bytes_.erase(bytes_.begin(), bytes_.begin() + static_cast<std::ptrdiff_t>(begin_));
    begin_ = 0;
  }
  bytes_.insert(bytes_.end(), bytes, bytes + size);
}

uint64_t ValueStream::available() const {
  if (field_->bits == 0) return std::numeric_limits<uint64_t>::max();
  return bits_held() / static_cast<uint64_t>(field_->bits);
}

bool ValueStream::holds_part() const {
  return field_->bits > 0 && bits_held() % static_cast<uint64_t>(field_->bits) != 0;
}

void ValueStream::Take(size_t count, double* values) {
  if (field_->type == FieldType::kSingle) return TakeReals<float>(count, values);
  if (field_->type == FieldType::kDouble) return TakeReals<double>(count, values);
  TakeIntegers(count, values);
}

template <typename Real>
void ValueStream::TakeReals(size_t count, double* values) {
  const char* bytes = bytes_.data() + begin_;
  for (size_t i = 0; i < count; ++i)
    values[i] = LoadAs<Real>(bytes + i * sizeof(Real), kSwapLittle);
  begin_ += count * sizeof(Real);
}

void ValueStream::TakeIntegers(size_t count, double* values) {
  const int bits = field_->bits;
  const uint64_t mask = bits == 64 ? ~uint64_t{0} : (uint64_t{1} << bits) - 1;
  const auto minimum = static_cast<uint64_t>(field_->minimum);
  const char* end = bytes_.data() + bytes_.size();
  for (size_t i = 0; i < count; ++i) {
    uint64_t stored = 0;
    if (bits > 0) {
      const char* bytes = bytes_.data() + begin_;
      stored = LoadWord(bytes, end) >> bit_;
      // The ninth byte, which a value of more than 57 bits may reach into.
      if (bit_ + bits > 64) stored |= uint64_t{static_cast<uint8_t>(bytes[8])} << (64 - bit_);
      const int next = bit_ + bits;
      begin_ += static_cast<size_t>(next / 8);
      bit_ = next % 8;
    }
    const auto value = static_cast<int64_t>(minimum + (stored & mask));
    values[i] = static_cast<double>(value) * field_->scale + field_->offset;
  }
}

}  // namespace rilievo::e57
