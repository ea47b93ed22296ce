// Little-endian bytes in and out; the reader never looks past its span.
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace rilievo {

class ByteWriter {
 public:
  explicit ByteWriter(std::vector<uint8_t>& bytes) : bytes_(bytes) {}

  void Byte(uint8_t value) { bytes_.push_back(value); }
  void Bytes(std::span<const uint8_t> values) {
    for (uint8_t value : values) bytes_.push_back(value);
  }
  void U32(uint32_t value) { Fixed(value, 4); }
  void F64(double value) { Fixed(std::bit_cast<uint64_t>(value), 8); }
  // A double as a count n and its n highest bytes, highest first; those left off are zero.
  void ShortF64(double value) {
    const uint64_t bits = std::bit_cast<uint64_t>(value);
    int count = 8;
    while (count > 0 && (bits >> (8 * (8 - count)) & 0xff) == 0) --count;
    Byte(static_cast<uint8_t>(count));
    for (int i = 0; i < count; ++i) Byte(static_cast<uint8_t>(bits >> (56 - 8 * i)));
  }
  // LEB128: seven bits a byte, low ones first, the top bit set on all but the last byte.
  void Varint(uint64_t value) {
    for (; value >= 0x80; value >>= 7) Byte(static_cast<uint8_t>(value | 0x80));
    Byte(static_cast<uint8_t>(value));
  }

 private:
  void Fixed(uint64_t value, int count) {
    for (int i = 0; i < count; ++i) Byte(static_cast<uint8_t>(value >> (8 * i)));
  }
  std::vector<uint8_t>& bytes_;
};

// After the first read past the end every read gives zero and ok() is false.
class ByteReader {
 public:
  explicit ByteReader(std::span<const uint8_t> bytes) : bytes_(bytes) {}

  bool ok() const { return ok_; }
  size_t position() const { return position_; }
  size_t remaining() const { return bytes_.size() - position_; }

  uint8_t Byte() { return static_cast<uint8_t>(Fixed(1)); }
  uint32_t U32() { return static_cast<uint32_t>(Fixed(4)); }
  double F64() { return std::bit_cast<double>(Fixed(8)); }
  double ShortF64() {
    const int count = Byte();
    if (count > 8) ok_ = false;
    uint64_t bits = 0;
    for (int i = 0; ok_ && i < count; ++i) bits |= uint64_t{Byte()} << (56 - 8 * i);
    return std::bit_cast<double>(bits);
  }
  // At most 63 bits, in at most nine bytes.
  uint64_t Varint() {
    uint64_t value = 0;
    for (int shift = 0; shift < 63; shift += 7) {
      const uint8_t byte = Byte();
      value |= static_cast<uint64_t>(byte & 0x7f) << shift;
      if ((byte & 0x80) == 0) return value;
    }
    ok_ = false;
    return 0;
  }
  // The next `count` bytes; empty, and ok() false, when they are not there.
  std::span<const uint8_t> Bytes(uint64_t count) {
    if (!ok_ || count > remaining()) {
      ok_ = false;
      return {};
    }
    const auto part = bytes_.subspan(position_, count);
    position_ += count;
    return part;
  }

 private:
  uint64_t Fixed(size_t count) {
    uint64_t value = 0;
    const auto part = Bytes(count);
    for (size_t i = 0; i < part.size(); ++i) value |= static_cast<uint64_t>(part[i]) << (8 * i);
    return value;
  }
  std::span<const uint8_t> bytes_;
  size_t position_ = 0;
  bool ok_ = true;
};

}  // namespace rilievo
