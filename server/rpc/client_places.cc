#include "server/rpc/client_places.h"

namespace rilievo {

bool ClientPlaces::Take(const std::string& client, int64_t count) {
  const std::lock_guard lock(mutex_);
  const auto found = of_client_.find(client);
  const int64_t own = found == of_client_.end() ? 0 : found->second;
  if (!MayTakePlace(places_, taken_, own, count)) return false;
  taken_ += count;
  of_client_[client] += count;
  return true;
}

void ClientPlaces::Give(const std::string& client, int64_t count) {
  const std::lock_guard lock(mutex_);
  taken_ -= count;
  const auto found = of_client_.find(client);
  if ((found->second -= count) == 0) of_client_.erase(found);
}

int64_t ClientPlaces::taken() const {
  const std::lock_guard lock(mutex_);
  return taken_;
}

}  // namespace rilievo
