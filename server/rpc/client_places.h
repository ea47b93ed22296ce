// Places that clients share.
#pragma once

#include <cstdint>
#include <map>
#include <mutex>
#include <string>

namespace rilievo {

// Whether a client that has `own` of the `taken` ones of `places` may take `more`: before it does,
// at least as many are free as it will have. Alone it gets half of them, two get a third each, and
// who comes next finds one.
inline bool MayTakePlace(int64_t places, int64_t taken, int64_t own, int64_t more = 1) {
  return own + more <= places - taken;
}

// Thread-safe.
class ClientPlaces {
 public:
  // Of whatever unit: calls, bytes.
  explicit ClientPlaces(int64_t places) : places_(places) {}

  // Whether the client has got them, for Give() to take back.
  bool Take(const std::string& client, int64_t count = 1);
  void Give(const std::string& client, int64_t count = 1);

  int64_t taken() const;

 private:
  const int64_t places_;
  mutable std::mutex mutex_;
  int64_t taken_ = 0;
  std::map<std::string, int64_t> of_client_;
};

}  // namespace rilievo
