#include "server/os/tcp_connection.h"

#include <fcntl.h>
#include <linux/tcp.h>
#include <netinet/in.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <sys/stat.h>

#include <cstddef>

#include "server/os/file_descriptor.h"

namespace rilievo {
namespace {

constexpr size_t kMappedBytes = 12, kSixBytes = 16;

std::string Unmapped(const std::string& address) {
  static const std::string prefix = std::string(10, '\0') + "\xff\xff";
  const bool mapped = address.size() == kSixBytes && address.compare(0, kMappedBytes, prefix) == 0;
  return mapped ? address.substr(kMappedBytes) : address;
}

std::string Bytes(const void* data, size_t size) { return {static_cast<const char*>(data), size}; }

}  // namespace

std::string PeerKey(const std::string& address_bytes, int port) {
  return Unmapped(address_bytes) + static_cast<char>(port >> 8) + static_cast<char>(port);
}

std::string PeerKeyOf(int socket) {
  sockaddr_storage address{};
  socklen_t size = sizeof(address);
  if (getpeername(socket, reinterpret_cast<sockaddr*>(&address), &size) != 0) return "";
  if (address.ss_family == AF_INET) {
    const auto* four = reinterpret_cast<const sockaddr_in*>(&address);
    return PeerKey(Bytes(&four->sin_addr, sizeof(in_addr)), ntohs(four->sin_port));
  }
  if (address.ss_family != AF_INET6) return "";
  const auto* six = reinterpret_cast<const sockaddr_in6*>(&address);
  return PeerKey(Bytes(&six->sin6_addr, sizeof(in6_addr)), ntohs(six->sin6_port));
}

ino_t InodeOf(int file) {
  struct stat status {};
  return fstat(file, &status) == 0 && S_ISSOCK(status.st_mode) ? status.st_ino : 0;
}

TcpTraffic TrafficOf(int socket) {
  tcp_info info{};
  socklen_t size = sizeof(info);
  int waiting = 0;
  // Kernels before 4.19 tell less.
  if (getsockopt(socket, IPPROTO_TCP, TCP_INFO, &info, &size) != 0 ||
      size < offsetof(tcp_info, tcpi_bytes_sent) + sizeof(info.tcpi_bytes_sent) ||
      ioctl(socket, FIONREAD, &waiting) != 0) {
    return {};
  }
  return {.read = static_cast<int64_t>(info.tcpi_bytes_received) - waiting,
          .sent = static_cast<int64_t>(info.tcpi_bytes_sent)};
}

bool AbortConnection(int file, ino_t inode) {
  // A handle of our own: the owner may close its one, and the number may become another file's.
  const FileDescriptor own(fcntl(file, F_DUPFD_CLOEXEC, 0));
  if (!own.valid() || InodeOf(own.number()) != inode) return false;
  // connect() to no address dissolves a TCP connection with a reset, and empties its queues.
  // shutdown() would leave megabytes for the owner to read.
  sockaddr nowhere{};
  nowhere.sa_family = AF_UNSPEC;
  return connect(own.number(), &nowhere, sizeof(nowhere)) == 0 ||
         shutdown(own.number(), SHUT_RDWR) == 0;
}

}  // namespace rilievo
