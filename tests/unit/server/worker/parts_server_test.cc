// The parts that a worker process shares, over its socket.
#include "server/worker/parts_server.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/socket.h>

#include <cstdint>
#include <memory>
#include <thread>
#include <utility>
#include <vector>

#include "server/worker/message_channel.h"
#include "server/worker/socket_parts.h"

namespace rilievo {
namespace {

constexpr PartStep kStep = PartStep::kSurfels;

// One part after the other, in memory.
class ListedParts final : public SharedParts {
 public:
  bool leads() const override { return true; }
  absl::StatusOr<Turn> Next(PartStep /*step*/, int count) override {
    parts.resize(static_cast<size_t>(count));
    if (next_ == count) return Turn{std::nullopt, count};
    return Turn{next_, next_++};
  }
  absl::Status Keep(PartStep /*step*/, int part, const PieceSource& next) override {
    for (;;) {
      const auto piece = next();
      if (!piece.ok() || piece->empty()) return piece.status();
      parts[part].insert(parts[part].end(), piece->begin(), piece->end());
    }
  }
  absl::Status Fetch(PartStep /*step*/, int part, const PieceSink& take) override {
    if (parts[part].empty()) return absl::UnavailableError("the store is away");
    return take(parts[part]);
  }

  std::vector<std::vector<uint8_t>> parts;

 private:
  int next_ = 0;
};

class PartsServerTest : public testing::Test {
 protected:
  PartsServerTest() {
    int ends[2];
    EXPECT_EQ(socketpair(AF_UNIX, SOCK_STREAM, 0, ends), 0);
    server_end_ = FileDescriptor(ends[0]);
    worker_end_ = FileDescriptor(ends[1]);
    job_.size.points = 1000;
    job_.parts = {.points = 1024, .scratch = ScratchFolder("none"), .shared = shared_};
    reader_ = std::jthread([this] {
      for (worker::ServerMessage message; ReceiveMessage(worker_end_, &message).ok();) {
        worker_.Take(std::move(message));
      }
    });
  }
  ~PartsServerTest() override { shutdown(server_end_.number(), SHUT_RDWR); }

  // What the server says to each question until one is not answered, or the worker is gone.
  absl::Status Serve() {
    PartsServer server(job_, server_end_);
    worker::WorkerMessage asked;
    while (ReceiveMessage(server_end_, &asked).ok()) {
      EXPECT_TRUE(server.IsAsked(asked));
      const absl::Status answered = server.Answer(asked);
      if (!answered.ok()) return answered;
    }
    return absl::OkStatus();
  }

  static PieceSource Once(const std::vector<uint8_t>& bytes) {
    return [left = std::span<const uint8_t>(bytes)]() mutable
           -> absl::StatusOr<std::span<const uint8_t>> { return std::exchange(left, {}); };
  }

  const std::shared_ptr<ListedParts> shared_ = std::make_shared<ListedParts>();
  JobRequest job_;
  FileDescriptor server_end_, worker_end_;
  SocketParts worker_{&worker_end_, /*leads=*/true};
  std::jthread reader_;
};

TEST_F(PartsServerTest, WhatIsSharedIsTheSameOnBothSides) {
  absl::Status served;
  std::jthread server([&] { served = Serve(); });
  const std::vector<uint8_t> large(3'000'001, 7);
  const auto turn = worker_.Next(kStep, 2);
  ASSERT_TRUE(turn.ok()) << turn.status();
  EXPECT_EQ(turn->part, 0);
  EXPECT_TRUE(worker_.Keep(kStep, 0, Once(large)).ok());
  EXPECT_EQ(shared_->parts[0], large);
  EXPECT_EQ(worker_.Next(kStep, 2)->part, 1);
  EXPECT_TRUE(worker_.Keep(kStep, 1, Once({5})).ok());
  const auto all = worker_.Next(kStep, 2);
  EXPECT_EQ(all->part, std::nullopt);
  EXPECT_EQ(all->done, 2);
  std::vector<uint8_t> fetched;
  EXPECT_TRUE(worker_
                  .Fetch(kStep, 0,
                         [&](std::span<const uint8_t> piece) {
                           fetched.insert(fetched.end(), piece.begin(), piece.end());
                           return absl::OkStatus();
                         })
                  .ok());
  EXPECT_EQ(fetched, large);
  shutdown(worker_end_.number(), SHUT_WR);
  server.join();
  EXPECT_TRUE(served.ok()) << served;
}

// A worker may be compromised by what it reads.
TEST_F(PartsServerTest, AWorkerDoesNoPartThatItWasNotGiven) {
  shared_->parts.resize(2);
  worker::WorkerMessage message;
  message.mutable_part_done()->set_step(1);
  message.mutable_part_done()->set_part(1);
  ASSERT_TRUE(SendMessage(worker_end_, message).ok());
  EXPECT_TRUE(absl::IsInternal(Serve()));
  message.mutable_fetch_part()->set_step(kMostPartSteps);
  ASSERT_TRUE(SendMessage(worker_end_, message).ok());
  EXPECT_TRUE(absl::IsInternal(Serve()));
}

TEST_F(PartsServerTest, AStepIsNotCutIntoMorePartsThanItHas) {
  worker::WorkerMessage message;
  const auto cut = [&](PartStep step, int count) {
    message.mutable_next_part()->set_step(static_cast<int>(step));
    message.mutable_next_part()->set_part(count);
    EXPECT_TRUE(SendMessage(worker_end_, message).ok());
    EXPECT_TRUE(absl::IsInternal(Serve())) << count;
  };
  cut(kStep, 1 << 30);
  cut(PartStep::kLeftOut, 1 << 30);
  cut(PartStep::kCoarse, 2);
  cut(PartStep::kUncoded, 2);
  job_.size.points = int64_t{1} << 40;  // of which blocks of the surface do not depend
  cut(PartStep::kBlocks, 1 << 29);
}

TEST_F(PartsServerTest, WhatTheStoreSaysIsPassedOn) {
  shared_->parts.resize(1);
  worker::WorkerMessage message;
  message.mutable_fetch_part()->set_step(1);
  ASSERT_TRUE(SendMessage(worker_end_, message).ok());
  EXPECT_TRUE(absl::IsUnavailable(Serve()));
}

TEST_F(PartsServerTest, NothingIsAskedOfAJobThatIsNotShared) {
  job_.parts->shared = nullptr;
  worker::WorkerMessage message;
  message.mutable_next_part();
  EXPECT_FALSE(PartsServer(job_, server_end_).IsAsked(message));
}

}  // namespace
}  // namespace rilievo
