#include "server/auth/open_connections.h"

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <thread>
#include <vector>

namespace rilievo {
namespace {

using Verdict = OpenConnections::Verdict;

// A socket of this process that listens on loopback, and connections to it.
class Loopback {
 public:
  explicit Loopback(int family = AF_INET) : listener_(socket(family, SOCK_STREAM, 0)) {
    address_.sin6_family = AF_INET6;
    address_.sin6_addr = in6addr_loopback;
    if (family == AF_INET) {
      auto* four = reinterpret_cast<sockaddr_in*>(&address_);
      *four = {};
      four->sin_family = AF_INET;
      four->sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    }
    size_ = family == AF_INET ? sizeof(sockaddr_in) : sizeof(sockaddr_in6);
    bound_ = bind(listener_.number(), Address(), size_) == 0 && listen(listener_.number(), 64) == 0;
    socklen_t size = size_;
    getsockname(listener_.number(), Address(), &size);
  }

  bool bound() const { return bound_; }

  // The server's end of a new connection, from an address of 127.0.0.0/8.
  FileDescriptor Accept(const char* from = nullptr) {
    clients_.emplace_back(
        socket(reinterpret_cast<sockaddr*>(&address_)->sa_family, SOCK_STREAM, 0));
    if (from != nullptr) {
      sockaddr_in own{};
      own.sin_family = AF_INET;
      inet_pton(AF_INET, from, &own.sin_addr);
      EXPECT_EQ(bind(clients_.back().number(), reinterpret_cast<sockaddr*>(&own), sizeof(own)), 0);
    }
    EXPECT_EQ(connect(clients_.back().number(), Address(), size_), 0);
    return FileDescriptor(accept(listener_.number(), nullptr, nullptr));
  }

 private:
  sockaddr* Address() { return reinterpret_cast<sockaddr*>(&address_); }

  FileDescriptor listener_;
  sockaddr_in6 address_{};
  socklen_t size_;
  bool bound_ = false;
  std::vector<FileDescriptor> clients_;
};

TEST(OpenConnections, TakesAsManyAsItMay) {
  Loopback loopback;
  OpenConnections open(3, 10);
  std::vector<FileDescriptor> taken;
  for (int i = 0; i < 3; ++i) {
    taken.push_back(loopback.Accept());
    EXPECT_EQ(open.Take(taken.back()), Verdict::kTaken);
  }
  EXPECT_EQ(open.Take(loopback.Accept()), Verdict::kTooMany);
  EXPECT_EQ(open.size(), 3);
}

TEST(OpenConnections, OneAddressLeavesRoomForOthers) {
  Loopback loopback;
  OpenConnections open(10, 2);
  std::vector<FileDescriptor> taken;
  for (const char* from : {"127.0.0.1", "127.0.0.1", "127.0.0.2"}) {
    taken.push_back(loopback.Accept(from));
    EXPECT_EQ(open.Take(taken.back()), Verdict::kTaken) << from;
  }
  EXPECT_EQ(open.Take(loopback.Accept("127.0.0.1")), Verdict::kTooManyOfAddress);
  taken.push_back(loopback.Accept("127.0.0.2"));
  EXPECT_EQ(open.Take(taken.back()), Verdict::kTaken);
}

TEST(OpenConnections, AClosedOneGivesItsPlaceBack) {
  Loopback loopback;
  OpenConnections open(2, 2);
  FileDescriptor first = loopback.Accept(), second = loopback.Accept();
  EXPECT_EQ(open.Take(first), Verdict::kTaken);
  EXPECT_EQ(open.Take(second), Verdict::kTaken);
  first.Close();
  EXPECT_EQ(open.size(), 1);
  // Its number goes to another file: that is not a connection, and then another one.
  FileDescriptor file(dup(0));
  EXPECT_EQ(open.size(), 1);
  file.Close();
  FileDescriptor third = loopback.Accept();
  EXPECT_EQ(open.Take(third), Verdict::kTaken);
  EXPECT_EQ(open.size(), 2);
}

TEST(OpenConnections, AFloodIsLookedIntoNowAndThen) {
  Loopback loopback;
  OpenConnections open(1, 1);
  FileDescriptor first = loopback.Accept();
  EXPECT_EQ(open.Take(first), Verdict::kTaken);
  const FileDescriptor second = loopback.Accept(), third = loopback.Accept();
  EXPECT_EQ(open.Take(second), Verdict::kTooManyOfAddress);
  first.Close();
  EXPECT_EQ(open.Take(third), Verdict::kTooManyOfAddress) << "it has just looked";
  std::this_thread::sleep_for(OpenConnections::kLookAgain + std::chrono::milliseconds(10));
  EXPECT_EQ(open.Take(third), Verdict::kTaken);
}

TEST(AddressOfPeer, TellsAddressesApartAndNotPorts) {
  Loopback four;
  EXPECT_EQ(AddressOfPeer(four.Accept()).size(), 4u);
  EXPECT_EQ(AddressOfPeer(four.Accept("127.0.0.9")), AddressOfPeer(four.Accept("127.0.0.9")));
  EXPECT_NE(AddressOfPeer(four.Accept("127.0.0.9")), AddressOfPeer(four.Accept("127.0.0.8")));
  EXPECT_EQ(AddressOfPeer(FileDescriptor(dup(0))), "");
  Loopback six(AF_INET6);
  if (!six.bound()) GTEST_SKIP() << "this machine has no IPv6";
  EXPECT_EQ(AddressOfPeer(six.Accept()).size(), 8u);
}

}  // namespace
}  // namespace rilievo
