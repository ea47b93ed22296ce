#include "client/formats/laz/point10_decoder.h"

#include <algorithm>

#include "client/formats/laz/record_fields.h"
#include "client/formats/laz/return_contexts.h"

namespace rilievo::laz {

Point10Decoder::Point10Decoder(const char* first)
    : x_(Load<uint32_t>(first)),
      y_(Load<uint32_t>(first + 4)),
      returns_(Load<uint8_t>(first + 14)),
      classification_(Load<uint8_t>(first + 15)),
      user_data_(Load<uint8_t>(first + 17)) {}

void Point10Decoder::DecodeAttributes(ArithmeticDecoder* decoder, uint32_t changed) {
  if (changed & 32) {
    returns_ = static_cast<uint8_t>(decoder->Decode(&returns_models_[returns_]));
  }
  const uint32_t context = kReturnContexts(count(), number());
  if (changed & 16) {
    last_intensities_[context] +=
        static_cast<uint16_t>(intensities_.Decode(decoder, std::min(context, 3u)));
  }
  if (changed & 8) {
    classification_ = static_cast<uint8_t>(decoder->Decode(&classifications_[classification_]));
  }
  if (changed & 4) decoder->Decode(&scan_angles_[(returns_ >> 6) & 1u]);
  if (changed & 2) {
    user_data_ = static_cast<uint8_t>(decoder->Decode(&user_data_models_[user_data_]));
  }
  if (changed & 1) sources_.Decode(decoder, 0);
  intensity_ = last_intensities_[context];
}

void Point10Decoder::Decode(ArithmeticDecoder* decoder, char* record) {
  const uint32_t changed = decoder->Decode(&changed_);
  if (changed != 0) DecodeAttributes(decoder, changed);

  const uint32_t single = count() == 1 ? 1 : 0;
  place_.MoveXY(decoder, kReturnContexts(count(), number()), single, &x_, &y_);
  const uint32_t z = place_.DecodeZ(decoder, kReturnLevels(count(), number()), single);

  Store(x_, record);
  Store(y_, record + 4);
  Store(z, record + 8);
  Store(intensity_, record + 12);
  Store(returns_, record + 14);
  Store(classification_, record + 15);
}

}  // namespace rilievo::laz
