#include "client/formats/laz/arithmetic_decoder.h"

namespace rilievo::laz {
namespace {

constexpr size_t kWindow = size_t{1} << 16;

}  // namespace

void ArithmeticDecoder::Start(std::string_view bytes) {
  source_ = nullptr;
  begin_ = next_ = bytes.data();
  end_ = next_ + bytes.size();
  Begin();
}

void ArithmeticDecoder::Start(ByteSource* source) {
  source_ = source;
  begin_ = next_ = end_ = nullptr;
  Begin();
}

void ArithmeticDecoder::Begin() {
  failed_ = false;
  length_ = 0xffffffff;
  value_ = 0;
  for (int i = 0; i < 4; ++i) value_ = value_ << 8 | NextByte();
  if (value_ == length_) {
    failed_ = true;
    value_ = 0;
  }
}

void ArithmeticDecoder::ShiftNearEnd() {
  while (length_ < (1u << 24)) {
    value_ = value_ << 8 | NextByte();
    length_ <<= 8;
  }
}

void ArithmeticDecoder::Stop() {
  source_->Skip(static_cast<uint64_t>(next_ - begin_));
  begin_ = next_ = end_ = nullptr;
}

bool ArithmeticDecoder::Refill() {
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
