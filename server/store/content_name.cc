#include "server/store/content_name.h"

#include <algorithm>
#include <array>
#include <cstdint>

#include "absl/strings/escaping.h"

namespace rilievo {

void AddBytes(const void* data, size_t size, Sha256* hash) {
  hash->Add({static_cast<const uint8_t*>(data), size});
}

std::string ContentName(Sha256 hash) {
  const std::array<uint8_t, 32> digest = hash.Finish();
  return absl::BytesToHexString(
      absl::string_view(reinterpret_cast<const char*>(digest.data()), digest.size()));
}

std::string ContentNameOf(const std::string& bytes) {
  Sha256 hash;
  AddBytes(bytes.data(), bytes.size(), &hash);
  return ContentName(hash);
}

bool IsContentName(const std::string& text) {
  return text.size() == 64 && std::all_of(text.begin(), text.end(), [](char c) {
           return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'f');
         });
}

}  // namespace rilievo
