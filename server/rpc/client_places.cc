#include "server/rpc/client_places.h"

namespace rilievo {

bool ClientPlaces::Take(const std::string& client) {
  const std::lock_guard lock(mutex_);
  const auto found = of_client_.find(client);
  if (!MayTakePlace(places_, taken_, found == of_client_.end() ? 0 : found->second)) return false;
  ++taken_;
  ++of_client_[client];
  return true;
}

void ClientPlaces::Give(const std::string& client) {
  const std::lock_guard lock(mutex_);
  --taken_;
  const auto found = of_client_.find(client);
  if (--found->second == 0) of_client_.erase(found);
}

}  // namespace rilievo
