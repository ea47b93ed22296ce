// Places that clients share.
#pragma once

#include <map>
#include <mutex>
#include <string>

namespace rilievo {

// Whether a client that has `own` of the `taken` ones of `places` may take another: it leaves at
// least as many free as it has. Alone it gets half of them, two get a third each, and who comes
// next finds one.
inline bool MayTakePlace(int places, int taken, int own) { return own < places - taken; }

// Thread-safe.
class ClientPlaces {
 public:
  explicit ClientPlaces(int places) : places_(places) {}

  // Whether the client has got one, for Give() to take back.
  bool Take(const std::string& client);
  void Give(const std::string& client);

 private:
  const int places_;
  std::mutex mutex_;
  int taken_ = 0;
  std::map<std::string, int> of_client_;
};

}  // namespace rilievo
