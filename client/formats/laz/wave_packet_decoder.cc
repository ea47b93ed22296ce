#include "client/formats/laz/wave_packet_decoder.h"

namespace rilievo::laz {
namespace {

// Of the offset: the same and the next to the last need nothing more.
constexpr uint32_t kDifference = 2;
constexpr uint32_t kWhole = 3;

}  // namespace

void WavePacketDecoder::Skip(ArithmeticDecoder* decoder) {
  decoder->Decode(&descriptors_);
  offset_kind_ = decoder->Decode(&offset_kinds_[offset_kind_]);
  if (offset_kind_ == kDifference) {
    offsets_.Decode(decoder, 0);
  } else if (offset_kind_ == kWhole) {
    decoder->DecodeBits(32);
    decoder->DecodeBits(32);
  }
  sizes_.Decode(decoder, 0);
  returns_.Decode(decoder, 0);
  for (uint32_t axis = 0; axis < 3; ++axis) directions_.Decode(decoder, axis);
}

}  // namespace rilievo::laz
