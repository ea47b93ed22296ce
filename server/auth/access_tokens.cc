#include "server/auth/access_tokens.h"

#include <sys/random.h>

#include <algorithm>

#include "absl/strings/ascii.h"
#include "absl/strings/escaping.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "core/base/sha256.h"
#include "core/base/status_macros.h"

namespace rilievo {
namespace {

constexpr size_t kSecretBytes = 32, kSaltBytes = 16, kHashBytes = 32;
constexpr size_t kMaxName = 64;

bool IsName(absl::string_view name) {
  return !name.empty() && name.size() <= kMaxName &&
         std::all_of(name.begin(), name.end(), [](unsigned char c) {
           return absl::ascii_isalnum(c) || c == '-' || c == '_';
         });
}

absl::StatusOr<std::string> RandomBytes(size_t size) {
  std::string bytes(size, '\0');
  if (getrandom(bytes.data(), size, 0) != static_cast<ssize_t>(size)) {
    return absl::InternalError("the system gives no random bytes");
  }
  return bytes;
}

std::array<uint8_t, kHashBytes> HashOf(absl::string_view salt, absl::string_view token) {
  Sha256 hash;
  for (const absl::string_view part : {salt, token}) {
    hash.Add({reinterpret_cast<const uint8_t*>(part.data()), part.size()});
  }
  return hash.Finish();
}

// Looks at every byte, whatever they are.
bool AreEqual(const std::array<uint8_t, kHashBytes>& a, const std::array<uint8_t, kHashBytes>& b) {
  volatile uint8_t difference = 0;
  for (size_t i = 0; i < kHashBytes; ++i) difference = difference | (a[i] ^ b[i]);
  return difference == 0;
}

// The bytes of exactly 2 `size` hexadecimal digits.
std::optional<std::string> FromHex(absl::string_view digits, size_t size) {
  const bool right = digits.size() == 2 * size &&
                     std::all_of(digits.begin(), digits.end(),
                                 [](unsigned char c) { return absl::ascii_isxdigit(c); });
  if (!right) return std::nullopt;
  return absl::HexStringToBytes(std::string(digits));
}

}  // namespace

absl::StatusOr<NewToken> MakeToken(const std::string& name) {
  if (!IsName(name)) {
    return absl::InvalidArgumentError(absl::StrCat("the name of a token has 1 to ", kMaxName,
                                                   " letters, digits, '-' and '_'; \"",
                                                   absl::CHexEscape(name), "\" has not"));
  }
  RILIEVO_ASSIGN_OR_RETURN(const std::string secret, RandomBytes(kSecretBytes));
  RILIEVO_ASSIGN_OR_RETURN(const std::string salt, RandomBytes(kSaltBytes));
  std::string encoded = absl::WebSafeBase64Escape(secret);
  while (!encoded.empty() && encoded.back() == '=') encoded.pop_back();
  NewToken made;
  made.token = absl::StrCat(name, ".", encoded);
  const auto hash = HashOf(salt, made.token);
  made.line = absl::StrCat(name, " sha256:", absl::BytesToHexString(salt), ":",
                           absl::BytesToHexString(std::string(hash.begin(), hash.end())));
  return made;
}

absl::StatusOr<AccessTokens> AccessTokens::Parse(absl::string_view text) {
  AccessTokens tokens;
  int number = 0;
  for (const absl::string_view raw : absl::StrSplit(text, '\n')) {
    ++number;
    const absl::string_view line = absl::StripAsciiWhitespace(raw);
    if (line.empty() || line[0] == '#') continue;
    const std::vector<std::string> words = absl::StrSplit(line, ' ', absl::SkipEmpty());
    const std::vector<std::string> parts =
        words.size() == 2 ? absl::StrSplit(words[1], ':') : std::vector<std::string>();
    std::optional<std::string> salt, hash;
    if (parts.size() == 3 && parts[0] == "sha256" && IsName(words[0])) {
      salt = FromHex(parts[1], kSaltBytes);
      hash = FromHex(parts[2], kHashBytes);
    }
    if (!salt || !hash) {
      return absl::InvalidArgumentError(absl::StrCat(
          "line ", number, " is not a token; make one with rilievod --make-token NAME"));
    }
    Fingerprint& added = tokens.fingerprints_[words[0]].emplace_back();
    added.salt = *std::move(salt);
    std::copy(hash->begin(), hash->end(), added.hash.begin());
  }
  return tokens;
}

std::optional<std::string> AccessTokens::OwnerOf(absl::string_view token) const {
  const auto found = fingerprints_.find(token.substr(0, token.find('.')));
  if (found == fingerprints_.end()) return std::nullopt;
  bool right = false;
  for (const Fingerprint& known : found->second) {
    if (AreEqual(HashOf(known.salt, token), known.hash)) right = true;
  }
  if (!right) return std::nullopt;
  return found->first;
}

}  // namespace rilievo
