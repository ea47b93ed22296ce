#include "tests/integration/line.h"

#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <vector>

#include "tests/unit/server/os/loopback.h"

namespace rilievo {
namespace {

constexpr int kLookAroundMilliseconds = 20;

}  // namespace

Line::Line(int server_port)
    : server_port_(server_port), listener_(socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
  sockaddr_in address = LoopbackAddress(0);
  socklen_t size = sizeof(address);
  bind(listener_.number(), reinterpret_cast<sockaddr*>(&address), size);
  listen(listener_.number(), 1);
  getsockname(listener_.number(), reinterpret_cast<sockaddr*>(&address), &size);
  port_ = ntohs(address.sin_port);
  thread_ = std::jthread([this] { Run(); });
}

Line::~Line() { Cut(); }

void Line::Cut() {
  cut_ = true;
  const std::lock_guard lock(mutex_);
  for (const FileDescriptor* end : {&client_, &server_}) {
    if (end->valid()) shutdown(end->number(), SHUT_RDWR);
  }
}

void Line::Run() {
  for (pollfd wait{listener_.number(), POLLIN, 0}; poll(&wait, 1, kLookAroundMilliseconds) == 0;) {
    if (cut_) return;
  }
  {
    const std::lock_guard lock(mutex_);
    client_ = FileDescriptor(accept4(listener_.number(), nullptr, nullptr, SOCK_CLOEXEC));
    server_ = ConnectTo(server_port_);
  }
  listener_.Close();
  std::jthread back([this] { Pass(server_.number(), client_.number()); });
  Pass(client_.number(), server_.number());
}

void Line::Pass(int from, int to) const {
  std::vector<char> buffer(65'536);
  while (!cut_) {
    pollfd wait{from, POLLIN, 0};
    if (frozen_ || poll(&wait, 1, kLookAroundMilliseconds) == 0) {
      if (frozen_) poll(nullptr, 0, kLookAroundMilliseconds);
      continue;
    }
    const ssize_t size = read(from, buffer.data(), buffer.size());
    if (size <= 0) break;
    for (ssize_t at = 0; at < size && !frozen_;) {
      const ssize_t sent =
          send(to, buffer.data() + at, static_cast<size_t>(size - at), MSG_NOSIGNAL);
      if (sent <= 0) return;
      at += sent;
    }
  }
  // The other end learns that this one has closed.
  shutdown(to, SHUT_RDWR);
}

}  // namespace rilievo
