#include "tests/stress/line.h"

#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <vector>

namespace rilievo::stress {
namespace {

constexpr int kLookAroundMilliseconds = 20;

sockaddr_in Loopback(int port) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  address.sin_port = htons(static_cast<uint16_t>(port));
  return address;
}

}  // namespace

FileDescriptor ConnectTo(int port) {
  FileDescriptor end(socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0));
  const sockaddr_in address = Loopback(port);
  if (connect(end.number(), reinterpret_cast<const sockaddr*>(&address), sizeof(address)) != 0) {
    end.Close();
  }
  return end;
}

Line::Line(int server_port)
    : server_port_(server_port), listener_(socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
  sockaddr_in address = Loopback(0);
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

}  // namespace rilievo::stress
