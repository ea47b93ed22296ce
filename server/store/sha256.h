// SHA-256 (FIPS 180-4), piece by piece.
#pragma once

#include <cstddef>
#include <memory>
#include <string>

struct evp_md_ctx_st;

namespace rilievo {

class Sha256 {
 public:
  Sha256();
  Sha256(Sha256&&) noexcept = default;
  Sha256& operator=(Sha256&&) noexcept = default;

  void Update(const void* data, size_t size);

  // 64 lower-case hexadecimal digits of all that came so far; more may come.
  std::string Hex() const;

 private:
  struct Free {
    void operator()(evp_md_ctx_st* context) const;
  };
  std::unique_ptr<evp_md_ctx_st, Free> context_;
};

std::string Sha256Hex(const std::string& bytes);

// Whether it is 64 lower-case hexadecimal digits.
bool IsSha256Hex(const std::string& text);

}  // namespace rilievo
