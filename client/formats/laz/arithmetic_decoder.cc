#include "client/formats/laz/arithmetic_decoder.h"

namespace rilievo::laz {

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

}  // namespace rilievo::laz
