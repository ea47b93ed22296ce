#include "server/os/connection_listener.h"

#include <netdb.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <sys/resource.h>
#include <sys/socket.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <stop_token>
#include <utility>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"

namespace rilievo {
namespace {

constexpr int kBacklog = 4096;  // the kernel takes as many of them as it allows
constexpr int kPauseMilliseconds = 100;

struct AddressesDeleter {
  void operator()(addrinfo* addresses) const { freeaddrinfo(addresses); }
};

absl::Status Unavailable(const std::string& address, std::string_view why) {
  return absl::UnavailableError(absl::StrCat("cannot listen on \"", address,
                                             "\": ", absl::string_view(why.data(), why.size()),
                                             "; is the address right and the port free?"));
}

// "host:port" or "[host]:port".
absl::StatusOr<std::pair<std::string, std::string>> HostAndPort(const std::string& address) {
  const size_t colon = address.rfind(':');
  if (colon == std::string::npos || colon == 0 || colon + 1 == address.size()) {
    return absl::InvalidArgumentError(
        absl::StrCat("listen is \"", address, "\"; give HOST:PORT, for example 127.0.0.1:50051"));
  }
  int port = -1;
  if (!absl::SimpleAtoi(address.substr(colon + 1), &port) || port < 0 || port > 65535) {
    return absl::InvalidArgumentError(
        absl::StrCat("listen is \"", address, "\"; its port must lie in [0, 65535]"));
  }
  std::string host = address.substr(0, colon);
  if (host.front() == '[' && host.back() == ']') host = host.substr(1, host.size() - 2);
  return std::pair(std::move(host), address.substr(colon + 1));
}

int PortOf(const FileDescriptor& socket) {
  sockaddr_storage address{};
  socklen_t size = sizeof(address);
  if (getsockname(socket.number(), reinterpret_cast<sockaddr*>(&address), &size) != 0) return 0;
  return ntohs(address.ss_family == AF_INET6
                   ? reinterpret_cast<const sockaddr_in6*>(&address)->sin6_port
                   : reinterpret_cast<const sockaddr_in*>(&address)->sin_port);
}

void SetPort(int port, sockaddr* address) {
  const auto value = htons(static_cast<uint16_t>(port));
  if (address->sa_family == AF_INET6) {
    reinterpret_cast<sockaddr_in6*>(address)->sin6_port = value;
  } else {
    reinterpret_cast<sockaddr_in*>(address)->sin_port = value;
  }
}

// The kernel gives out the lowest free number: one this high means that so many are in use.
bool LeavesTooFew(const FileDescriptor& connection) {
  rlimit limit{};
  if (getrlimit(RLIMIT_NOFILE, &limit) != 0 || limit.rlim_cur == RLIM_INFINITY) return false;
  const auto handles = static_cast<int64_t>(limit.rlim_cur);
  return connection.number() >= handles - std::min<int64_t>(kReservedHandles, handles / 4);
}

}  // namespace

absl::StatusOr<std::unique_ptr<ConnectionListener>> ConnectionListener::Open(
    const std::string& address) {
  RILIEVO_ASSIGN_OR_RETURN(const auto parts, HostAndPort(address));
  std::unique_ptr<ConnectionListener> listener(new ConnectionListener);
  listener->wake_ = FileDescriptor(eventfd(0, EFD_CLOEXEC));
  const absl::Status bound = listener->Bind(parts.first, parts.second);
  if (!bound.ok()) return Unavailable(address, std::string(bound.message()));
  return listener;
}

absl::Status ConnectionListener::Bind(const std::string& host, const std::string& port) {
  addrinfo hints{};
  hints.ai_socktype = SOCK_STREAM;
  hints.ai_flags = AI_PASSIVE | AI_NUMERICSERV;
  addrinfo* found = nullptr;
  if (const int error = getaddrinfo(host.c_str(), port.c_str(), &hints, &found); error != 0) {
    return absl::UnavailableError(gai_strerror(error));
  }
  const std::unique_ptr<addrinfo, AddressesDeleter> addresses(found);
  absl::Status failure = absl::UnavailableError("the host has no address");
  for (addrinfo* at = addresses.get(); at != nullptr; at = at->ai_next) {
    // "localhost" has two addresses: they get the same port.
    if (port_ != 0) SetPort(port_, at->ai_addr);
    FileDescriptor one(::socket(at->ai_family, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
    const int yes = 1;
    if (one.valid()) setsockopt(one.number(), SOL_SOCKET, SO_REUSEADDR, &yes, sizeof(yes));
    if (!one.valid() || bind(one.number(), at->ai_addr, at->ai_addrlen) != 0 ||
        listen(one.number(), kBacklog) != 0) {
      failure = absl::UnavailableError(std::strerror(errno));
      // A machine without IPv6 still has the other one; a port that is taken is taken.
      if (errno == EADDRINUSE) return failure;
      continue;
    }
    port_ = PortOf(one);
    sockets_.push_back(std::move(one));
  }
  return sockets_.empty() ? failure : absl::OkStatus();
}

void ConnectionListener::Start(Take take, std::function<void()> no_handle) {
  thread_ = std::jthread([this, take = std::move(take), no_handle = std::move(no_handle)](
                             const std::stop_token& stop) { Run(stop, take, no_handle); });
}

ConnectionListener::~ConnectionListener() {
  thread_.request_stop();
  const uint64_t one = 1;
  wake_.Write(&one, sizeof(one)).IgnoreError();
}

void ConnectionListener::Run(const std::stop_token& stop, const Take& take,
                             const std::function<void()>& no_handle) const {
  std::vector<pollfd> polled;
  for (const FileDescriptor& one : sockets_) polled.push_back({one.number(), POLLIN, 0});
  polled.push_back({wake_.number(), POLLIN, 0});
  while (!stop.stop_requested()) {
    poll(polled.data(), polled.size(), -1);
    for (size_t i = 0; i < sockets_.size() && !stop.stop_requested(); ++i) {
      if ((polled[i].revents & POLLIN) == 0) continue;
      FileDescriptor connection(
          accept4(polled[i].fd, nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK));
      if (connection.valid()) {
        if (LeavesTooFew(connection)) {
          no_handle();
          continue;  // closed: its client comes back later
        }
        const int yes = 1;
        setsockopt(connection.number(), IPPROTO_TCP, TCP_NODELAY, &yes, sizeof(yes));
        take(std::move(connection));
      } else if (errno == EMFILE || errno == ENFILE || errno == ENOBUFS || errno == ENOMEM) {
        // The peer waits until there is a handle for it. The wake ends the pause.
        poll(&polled.back(), 1, kPauseMilliseconds);
      }
    }
  }
}

}  // namespace rilievo
