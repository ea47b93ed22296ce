// Texts of coordinate reference systems as they travel.
#pragma once

#include <string>
#include <string_view>

#include "core/geometry/scan_place.h"

namespace rilievo {

// Well-known text is ASCII in practice, and the protocol and terminals want to rely on something:
// control characters become blanks, bytes beyond ASCII '?'. What is too long to be one is left out.
inline std::string CrsText(std::string_view bytes) {
  if (bytes.size() > kMaxCrsBytes) return "";
  std::string text(bytes);
  for (char& c : text) {
    const auto byte = static_cast<unsigned char>(c);
    if (byte < 0x20 || byte == 0x7f) c = ' ';
    if (byte >= 0x80) c = '?';
  }
  return text;
}

}  // namespace rilievo
