// The values of one field of the records.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "client/formats/e57/scan_description.h"

namespace rilievo::e57 {

// A bytestream of bitPackCodec, the codec of ASTM E2807-11: values without gaps between them,
// lowest bits first. A value may begin in one packet and end in the next.
class ValueStream {
 public:
  // `field` must outlive this and be of a type that is read.
  explicit ValueStream(const Field& field) : field_(&field) {}

  void Append(const char* bytes, size_t size);

  // Number of complete values; the greatest number for a field whose values take no bits.
  uint64_t available() const;
  // Whether a part of a value is left over behind the complete ones.
  bool holds_part() const;

  // The next `count` of the available values.
  void Take(size_t count, double* values);

 private:
  uint64_t bits_held() const {
    return 8 * uint64_t{bytes_.size() - begin_} - static_cast<uint64_t>(bit_);
  }
  template <typename Real>
  void TakeReals(size_t count, double* values);
  void TakeIntegers(size_t count, double* values);

  const Field* field_;
  std::vector<char> bytes_;
  size_t begin_ = 0;  // first byte that is not used up
  int bit_ = 0;       // first bit of it that is not
};

}  // namespace rilievo::e57
