#include "server/os/connection_listener.h"

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/socket.h>

#include <atomic>
#include <condition_variable>
#include <mutex>

#include "tests/unit/server/os/loopback.h"

namespace rilievo {
namespace {

using std::chrono::seconds;

// What a listener has handed on.
class Connections {
 public:
  void Take(FileDescriptor connection) {
    const std::lock_guard lock(mutex_);
    taken_.push_back(std::move(connection));
    changed_.notify_all();
  }
  bool WaitFor(size_t count, seconds time = seconds(5)) {
    std::unique_lock lock(mutex_);
    return changed_.wait_for(lock, time, [&] { return taken_.size() >= count; });
  }
  void Clear() {
    const std::lock_guard lock(mutex_);
    taken_.clear();
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<FileDescriptor> taken_;
};

TEST(ConnectionListener, HandsOnWhatConnects) {
  Connections connections;
  auto listener = ConnectionListener::Open("127.0.0.1:0");
  ASSERT_TRUE(listener.ok()) << listener.status();
  const FileDescriptor early = ConnectTo((*listener)->port());
  ASSERT_TRUE(early.valid()) << "before anybody takes it";
  (*listener)->Start([&](FileDescriptor one) { connections.Take(std::move(one)); });
  const FileDescriptor late = ConnectTo((*listener)->port());
  EXPECT_TRUE(connections.WaitFor(2));
  const int port = (*listener)->port();
  listener->reset();
  EXPECT_FALSE(ConnectTo(port).valid()) << "it is gone";
}

TEST(ConnectionListener, ServesEveryAddressOfAName) {
  Connections connections;
  auto listener = ConnectionListener::Open("localhost:0");
  ASSERT_TRUE(listener.ok()) << listener.status();
  (*listener)->Start([&](FileDescriptor one) { connections.Take(std::move(one)); });
  EXPECT_TRUE(ConnectTo((*listener)->port()).valid());
  EXPECT_TRUE(connections.WaitFor(1));
}

TEST(ConnectionListener, SaysWhatIsWrong) {
  const auto first = ConnectionListener::Open("127.0.0.1:0");
  ASSERT_TRUE(first.ok());
  const std::string taken = "127.0.0.1:" + std::to_string((*first)->port());
  EXPECT_TRUE(absl::IsUnavailable(ConnectionListener::Open(taken).status()));
  EXPECT_TRUE(absl::IsUnavailable(ConnectionListener::Open("no.such.host.invalid:1").status()));
  for (const char* no_port : {"127.0.0.1:http", "127.0.0.1:70000", "127.0.0.1:-1"}) {
    EXPECT_TRUE(absl::IsInvalidArgument(ConnectionListener::Open(no_port).status())) << no_port;
  }
  for (const char* wrong : {"", "50051", "127.0.0.1:", ":1"}) {
    EXPECT_TRUE(absl::IsInvalidArgument(ConnectionListener::Open(wrong).status())) << wrong;
  }
}

TEST(ConnectionListener, GoesOnWhenThereAreFileHandlesAgain) {
  Connections connections;
  auto listener = ConnectionListener::Open("127.0.0.1:0");
  ASSERT_TRUE(listener.ok());
  (*listener)->Start([&](FileDescriptor one) { connections.Take(std::move(one)); });
  rlimit before{};
  getrlimit(RLIMIT_NOFILE, &before);
  // A socket of the client's first, then no handle is left for the other end.
  FileDescriptor waiting(socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0));
  rlimit none = before;
  none.rlim_cur = static_cast<rlim_t>(waiting.number() + 1);
  ASSERT_EQ(setrlimit(RLIMIT_NOFILE, &none), 0);
  const sockaddr_in address = LoopbackAddress((*listener)->port());
  EXPECT_EQ(connect(waiting.number(), reinterpret_cast<const sockaddr*>(&address), sizeof(address)),
            0);
  EXPECT_FALSE(connections.WaitFor(1, seconds(1)));
  ASSERT_EQ(setrlimit(RLIMIT_NOFILE, &before), 0);
  EXPECT_TRUE(connections.WaitFor(1)) << "it was kept waiting";
}

TEST(ConnectionListener, KeepsHandlesBackForOthers) {
  Connections connections;
  std::atomic<int> closed = 0;
  auto listener = ConnectionListener::Open("127.0.0.1:0");
  ASSERT_TRUE(listener.ok());
  (*listener)->Start([&](FileDescriptor one) { connections.Take(std::move(one)); },
                     [&] { ++closed; });
  rlimit before{};
  getrlimit(RLIMIT_NOFILE, &before);
  rlimit few = before;
  few.rlim_cur = 80;
  ASSERT_EQ(setrlimit(RLIMIT_NOFILE, &few), 0);
  std::vector<FileDescriptor> crowd;
  for (int i = 0; i < 34; ++i) crowd.push_back(ConnectTo((*listener)->port()));
  // Both ends are in this process; the limit leaves a quarter of the 80.
  EXPECT_FALSE(connections.WaitFor(31, seconds(1)));
  EXPECT_TRUE(FileDescriptor(dup(0)).valid()) << "there is one for others";
  EXPECT_GT(closed, 0);
  crowd.clear();
  connections.Clear();
  const FileDescriptor next = ConnectTo((*listener)->port());
  EXPECT_TRUE(connections.WaitFor(1));
  ASSERT_EQ(setrlimit(RLIMIT_NOFILE, &before), 0);
}

}  // namespace
}  // namespace rilievo
