// The first 20 bytes of a point of the formats 0 to 5.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>

#include "client/formats/laz/arithmetic_decoder.h"
#include "client/formats/laz/integer_decoder.h"
#include "client/formats/laz/place_decoder.h"
#include "client/formats/laz/record_fields.h"
#include "client/formats/laz/return_contexts.h"

namespace rilievo::laz {

// LASzip's item POINT10, version 2 (Isenburg 2013, section "Compressing point10").
class Point10Decoder {
 public:
  // `first`: the first record of the chunk, which is not compressed.
  explicit Point10Decoder(const char* first)
      : x_(Load<uint32_t>(first)),
        y_(Load<uint32_t>(first + 4)),
        returns_(Load<uint8_t>(first + 14)),
        classification_(Load<uint8_t>(first + 15)),
        user_data_(Load<uint8_t>(first + 17)) {}

  // Writes x, y, z, intensity, returns, flags and classification of the next point into `record`.
  // Scan angle, user data and source stay as they are there: nobody reads them.
  void Decode(ArithmeticDecoder* decoder, char* record);

 private:
  // What is not a coordinate, as far as it changed.
  void DecodeAttributes(ArithmeticDecoder* decoder, uint32_t changed);

  uint32_t number() const { return returns_ & 7u; }
  uint32_t count() const { return (returns_ >> 3) & 7u; }

  uint32_t x_, y_;  // modulo 2^32
  uint16_t intensity_ = 0;
  uint8_t returns_, classification_, user_data_;

  SymbolModel changed_{64};
  ContextModels returns_models_{256, 256}, classifications_{256, 256}, user_data_models_{256, 256};
  ContextModels scan_angles_{2, 256};
  IntegerDecoder intensities_{16, 4}, sources_{16, 1};
  PlaceDecoder place_{0};
  std::array<uint16_t, 16> last_intensities_{};  // by return context
};

inline void Point10Decoder::DecodeAttributes(ArithmeticDecoder* decoder, uint32_t changed) {
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

inline void Point10Decoder::Decode(ArithmeticDecoder* decoder, char* record) {
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
