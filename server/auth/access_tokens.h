// Bearer tokens (RFC 6750), of which a server knows only salted hashes.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

namespace rilievo {

// `token` is for the client, and nowhere kept; `line` is for the server's file.
struct NewToken {
  std::string token;  // "NAME.SECRET", the secret 256 random bits in base64url
  std::string line;   // "NAME sha256:SALT:HASH", hexadecimal; HASH = SHA-256(SALT, token)
};

// INVALID_ARGUMENT when `name` has not 1 to 64 letters, digits, '-' and '_'.
absl::StatusOr<NewToken> MakeToken(const std::string& name);

// The secrets are as long as the hash, so one round of it is as hard to turn round as any number.
class AccessTokens {
 public:
  // Lines as MakeToken() makes them; empty ones and those that begin with '#' are skipped. A name
  // may have several, while one token takes the place of another. INVALID_ARGUMENT names the line.
  static absl::StatusOr<AccessTokens> Parse(absl::string_view text);

  // The name whose token it is. The time it takes tells nothing of a secret.
  std::optional<std::string> OwnerOf(absl::string_view token) const;

 private:
  struct Fingerprint {
    std::string salt;
    std::array<uint8_t, 32> hash;
  };

  std::map<std::string, std::vector<Fingerprint>, std::less<>> fingerprints_;
};

}  // namespace rilievo
