#include "server/auth/open_connections.h"

#include <netinet/in.h>
#include <sys/socket.h>

#include <algorithm>
#include <utility>

#include "server/auth/caller.h"

namespace rilievo {
namespace {

std::string Bytes(const void* data, size_t size) { return {static_cast<const char*>(data), size}; }

}  // namespace

std::string AddressOfPeer(const FileDescriptor& socket) {
  sockaddr_storage address{};
  socklen_t size = sizeof(address);
  if (getpeername(socket.number(), reinterpret_cast<sockaddr*>(&address), &size) != 0) return "";
  if (address.ss_family == AF_INET) {
    return Bytes(&reinterpret_cast<const sockaddr_in*>(&address)->sin_addr, sizeof(in_addr));
  }
  if (address.ss_family != AF_INET6) return "";
  return HouseholdOf(reinterpret_cast<const sockaddr_in6*>(&address)->sin6_addr);
}

OpenConnections::Verdict OpenConnections::Take(const FileDescriptor& connection) {
  std::string address = AddressOfPeer(connection);
  const auto now = std::chrono::steady_clock::now();
  const std::lock_guard lock(mutex_);
  // The system gives a number again when what had it is closed.
  if (const auto old = connections_.find(connection.number()); old != connections_.end()) {
    Forget(old);
  }
  const auto full = [&] { return static_cast<int>(connections_.size()) >= most_; };
  const auto address_full = [&] {
    const auto found = of_address_.find(address);
    return found != of_address_.end() && found->second >= most_of_address_;
  };
  if ((full() || address_full()) && now - looked_ >= kLookAgain) ForgetClosed(now);
  if (address_full()) return Verdict::kTooManyOfAddress;
  if (full()) return Verdict::kTooMany;
  ++of_address_[address];
  connections_[connection.number()] = {InodeOf(connection.number()), next_number_++,
                                       std::move(address), PeerKeyOf(connection.number())};
  return Verdict::kTaken;
}

int OpenConnections::size() {
  const std::lock_guard lock(mutex_);
  ForgetClosed(std::chrono::steady_clock::now());
  return static_cast<int>(connections_.size());
}

std::vector<OpenConnections::Sample> OpenConnections::Look() {
  const std::lock_guard lock(mutex_);
  ForgetClosed(std::chrono::steady_clock::now());
  std::vector<Sample> samples;
  samples.reserve(connections_.size());
  for (const auto& [file, one] : connections_) {
    samples.push_back({one.number, one.address, one.peer, TrafficOf(file)});
  }
  return samples;
}

bool OpenConnections::Abort(uint64_t number) {
  const std::lock_guard lock(mutex_);
  const auto found = std::find_if(connections_.begin(), connections_.end(),
                                  [&](const auto& one) { return one.second.number == number; });
  if (found == connections_.end()) return false;
  const bool aborted = AbortConnection(found->first, found->second.socket);
  Forget(found);
  return aborted;
}

void OpenConnections::ForgetClosed(std::chrono::steady_clock::time_point now) {
  looked_ = now;
  for (auto at = connections_.begin(); at != connections_.end();) {
    const auto connection = at++;
    const ino_t socket = InodeOf(connection->first);
    if (socket == 0 || socket != connection->second.socket) Forget(connection);
  }
}

void OpenConnections::Forget(std::map<int, Connection>::iterator connection) {
  const auto found = of_address_.find(connection->second.address);
  if (--found->second == 0) of_address_.erase(found);
  connections_.erase(connection);
}

}  // namespace rilievo
