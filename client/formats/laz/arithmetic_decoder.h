// The arithmetic coder of LASzip, its decoding half.
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <string_view>

#include "client/formats/byte_source.h"
#include "client/formats/laz/arithmetic_model.h"

namespace rilievo::laz {

// A. Said, "Introduction to Arithmetic Coding Theory and Practice", HP Labs report HPL-2004-76,
// section 2; Isenburg, "LASzip: lossless compression of LiDAR data", 2013. Its encoder ends with as
// many bytes as the decoder has read when the last symbol is out, so a stream of symbols needs no
// length. One that was not started has no bytes, and fails.
//
// Any bytes decode to some symbols; none of them makes this read outside its memory: value_ stays
// below length_ whatever is decoded.
class ArithmeticDecoder {
 public:
  // Decodes these bytes, which must outlive their use.
  void Start(std::string_view bytes);
  // Decodes from the next byte of the source on; until Stop() it belongs to this decoder.
  void Start(ByteSource* source);
  // Puts the source behind the last byte decoded.
  void Stop();

  // More bytes were asked for than there are, or symbols turned up that no encoder writes.
  bool failed() const { return failed_; }
  // All bytes of Start(bytes) were decoded.
  bool at_end() const { return next_ == end_; }

  uint32_t Decode(SymbolModel* model) {
    const uint32_t share = length_ >> SymbolModel::kBits;
    const uint32_t symbol = model->Find(value_ / share);
    const uint32_t begin = model->lower(symbol) * share;
    const uint32_t end =
        symbol == model->last_symbol() ? length_ : model->lower(symbol + 1) * share;
    Narrow(begin, end - begin);
    model->Count(symbol);
    return symbol;
  }

  uint32_t DecodeBit(BitModel* model) {
    const uint32_t zeros = model->zeros() * (length_ >> BitModel::kBits);
    const uint32_t bit = value_ >= zeros ? 1 : 0;
    if (bit == 0) {
      Narrow(0, zeros);
    } else {
      Narrow(zeros, length_ - zeros);
    }
    model->Count(bit);
    return bit;
  }

  // `count` (1 to 32) equally likely bits.
  uint32_t DecodeBits(int count) {
    if (count <= 19) return DecodeFewBits(count);
    const uint32_t low = DecodeFewBits(16);
    return DecodeFewBits(count - 16) << 16 | low;
  }

 private:
  uint32_t DecodeFewBits(int count) {
    const uint32_t share = length_ >> count;
    const uint32_t bits = value_ / share;
    Narrow(bits * share, share);
    if (bits >> count != 0) failed_ = true;
    return bits & ((1u << count) - 1);
  }

  // Narrows the interval to [begin, begin + length), then shifts whole bytes in until its length
  // has more than 24 bits. Without a branch on how many, which cannot be foretold.
  void Narrow(uint32_t begin, uint32_t length) {
    value_ -= begin;
    length_ = length;
    if (end_ - next_ < 4) {
      ShiftNearEnd();
      return;
    }
    const int shift = std::countl_zero(length) & 24;
    const auto* bytes = reinterpret_cast<const uint8_t*>(next_);
    const uint64_t ahead = static_cast<uint64_t>(value_) << 32 | uint32_t{bytes[0]} << 24 |
                           uint32_t{bytes[1]} << 16 | uint32_t{bytes[2]} << 8 | bytes[3];
    value_ = static_cast<uint32_t>(ahead << shift >> 32);
    length_ = length << shift;
    next_ += shift / 8;
  }
  void ShiftNearEnd();

  uint8_t NextByte() {
    if (next_ == end_ && !Refill()) return 0;
    return static_cast<uint8_t>(*next_++);
  }
  bool Refill();
  void Begin();

  static constexpr size_t kWindow = size_t{1} << 16;  // bytes of the source

  uint32_t value_ = 0, length_ = 0xffffffff;
  const char *begin_ = nullptr, *next_ = nullptr, *end_ = nullptr;
  ByteSource* source_ = nullptr;
  bool failed_ = false;
};

inline void ArithmeticDecoder::ShiftNearEnd() {
  while (length_ < (1u << 24)) {
    value_ = value_ << 8 | NextByte();
    length_ <<= 8;
  }
}

inline void ArithmeticDecoder::Stop() {
  source_->Skip(static_cast<uint64_t>(next_ - begin_));
  begin_ = next_ = end_ = nullptr;
}

inline bool ArithmeticDecoder::Refill() {
  if (source_ != nullptr) {
    Stop();
    const std::string_view window = source_->Peek(kWindow);
    begin_ = next_ = window.data();
    end_ = next_ + window.size();
  }
  if (next_ == end_) failed_ = true;
  return next_ != end_;
}

}  // namespace rilievo::laz
