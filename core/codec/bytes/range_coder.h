// Binary range coder (Martin 1979; carries resolved as in Subbotin's and LZMA's coders): bits in,
// bytes out, each bit at the cost of its own probability.
//
// Encoder and decoder share one interface, Code(bit, probability) -> bit, so that a model written
// as a template over the coder is the same for both by construction: the encoder returns the bit
// that it was given, the decoder ignores it and returns the one it read.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace rilievo {

class RangeEncoder {
 public:
  static constexpr bool kDecodes = false;

  // `one_probability`: of a 1, in 1 / 65536, [1, 65535].
  bool Code(bool bit, uint32_t one_probability) {
    const uint32_t bound =
        static_cast<uint32_t>((static_cast<uint64_t>(range_) * one_probability) >> 16);
    if (bit) {
      range_ = bound;
    } else {
      low_ += bound;
      range_ -= bound;
    }
    while (range_ < kBottom) {
      range_ <<= 8;
      ShiftLow();
    }
    return bit;
  }

  // The coded bytes, trailing zeros left off: a decoder reads zeros beyond the end.
  std::vector<uint8_t> Finish();

  static constexpr uint32_t kBottom = 1u << 24;
  static constexpr size_t kMaxLeftOff = 4;

 private:
  void ShiftLow();

  uint64_t low_ = 0;  // below 2^33: bit 32 is a carry into the bytes held back
  uint32_t range_ = 0xffffffffu;
  uint8_t held_ = 0;        // the byte a carry would reach first,
  int64_t held_count_ = 0;  // 0: none yet; n: held_ and n - 1 bytes of 255 after it
  std::vector<uint8_t> bytes_;
};

// In the place of an encoder whose bytes nobody asks for.
class NoBytes {
 public:
  static constexpr bool kDecodes = false;
  bool Code(bool bit, uint32_t /*one_probability*/) { return bit; }
  std::vector<uint8_t> Finish() { return {}; }
};

class RangeDecoder {
 public:
  static constexpr bool kDecodes = true;

  explicit RangeDecoder(std::span<const uint8_t> bytes) : bytes_(bytes) {
    for (int i = 0; i < 4; ++i) code_ = (code_ << 8) | NextByte();
  }

  bool Code(bool /*ignored*/, uint32_t one_probability) {
    const uint32_t bound =
        static_cast<uint32_t>((static_cast<uint64_t>(range_) * one_probability) >> 16);
    const bool bit = code_ < bound;
    if (bit) {
      range_ = bound;
    } else {
      code_ -= bound;
      range_ -= bound;
    }
    while (range_ < RangeEncoder::kBottom) {
      range_ <<= 8;
      code_ = (code_ << 8) | NextByte();
    }
    return bit;
  }

  // More bytes were asked for than an encoder can have left off: the data was cut or made up.
  bool overrun() const { return position_ > bytes_.size() + RangeEncoder::kMaxLeftOff; }

 private:
  uint8_t NextByte() {
    const size_t at = position_++;
    return at < bytes_.size() ? bytes_[at] : 0;
  }

  std::span<const uint8_t> bytes_;
  size_t position_ = 0;
  uint32_t code_ = 0;
  uint32_t range_ = 0xffffffffu;
};

}  // namespace rilievo
