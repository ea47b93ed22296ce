#include "server/os/tcp_connection.h"

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>

#include <utility>

#include "server/os/file_descriptor.h"
#include "tests/unit/server/os/loopback.h"

namespace rilievo {
namespace {

// The two ends of a connection over loopback.
std::pair<FileDescriptor, FileDescriptor> Connection(int* client_port) {
  const FileDescriptor listener(socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0));
  sockaddr_in address = LoopbackAddress(0);
  socklen_t size = sizeof(address);
  EXPECT_EQ(bind(listener.number(), reinterpret_cast<sockaddr*>(&address), size), 0);
  EXPECT_EQ(listen(listener.number(), 1), 0);
  getsockname(listener.number(), reinterpret_cast<sockaddr*>(&address), &size);
  FileDescriptor client(socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0));
  EXPECT_EQ(connect(client.number(), reinterpret_cast<sockaddr*>(&address), size), 0);
  getsockname(client.number(), reinterpret_cast<sockaddr*>(&address), &size);
  *client_port = ntohs(address.sin_port);
  return {std::move(client), FileDescriptor(accept(listener.number(), nullptr, nullptr))};
}

TEST(TcpConnection, CountsWhatItsOwnerHasRead) {
  int port = 0;
  const auto [client, server] = Connection(&port);
  const std::string thousand(1000, 'x');
  ASSERT_TRUE(client.Send(thousand.data(), thousand.size()).ok());
  pollfd ready{server.number(), POLLIN, 0};
  ASSERT_EQ(poll(&ready, 1, 10'000), 1);
  EXPECT_EQ(TrafficOf(server.number()).read, 0) << "it has arrived, and waits";
  std::string some(400, ' ');
  ASSERT_TRUE(server.Read(some.data(), some.size()).ok());
  EXPECT_EQ(TrafficOf(server.number()).read, 400);
  EXPECT_EQ(TrafficOf(server.number()).sent, 0);
  ASSERT_TRUE(server.Send(some.data(), 7).ok());
  EXPECT_EQ(TrafficOf(server.number()).sent, 7);
}

TEST(TcpConnection, NamesItsPeer) {
  int port = 0;
  const auto [client, server] = Connection(&port);
  in_addr loopback{htonl(INADDR_LOOPBACK)};
  const std::string bytes(reinterpret_cast<const char*>(&loopback), sizeof(loopback));
  EXPECT_EQ(PeerKeyOf(server.number()), PeerKey(bytes, port));
  EXPECT_EQ(PeerKey(std::string(10, '\0') + "\xff\xff" + bytes, port), PeerKey(bytes, port))
      << "an address of IPv4 in one of IPv6";
  EXPECT_NE(PeerKey(bytes, port), PeerKey(bytes, port + 256));
}

TEST(TcpConnection, AbortDropsWhatWasNotRead) {
  int port = 0;
  const auto [client, server] = Connection(&port);
  const std::string thousand(1000, 'x');
  ASSERT_TRUE(client.Send(thousand.data(), thousand.size()).ok());
  pollfd ready{server.number(), POLLIN, 0};
  ASSERT_EQ(poll(&ready, 1, 10'000), 1);
  const ino_t inode = InodeOf(server.number());
  EXPECT_FALSE(AbortConnection(server.number(), inode + 1)) << "another socket of that number";
  EXPECT_TRUE(AbortConnection(server.number(), inode));
  char c;
  EXPECT_FALSE(server.Read(&c, 1).ok());
  EXPECT_FALSE(client.Read(&c, 1).ok());
  EXPECT_EQ(InodeOf(server.number()), inode) << "the handle is its owner's to close";
}

}  // namespace
}  // namespace rilievo
