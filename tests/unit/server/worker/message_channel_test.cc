#include "server/worker/message_channel.h"

#include <gtest/gtest.h>
#include <sys/socket.h>

#include <string>
#include <thread>

#include "server/worker/worker_protocol.pb.h"

namespace rilievo {
namespace {

struct Ends {
  Ends() {
    int ends[2];
    EXPECT_EQ(socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends), 0);
    a = FileDescriptor(ends[0]);
    b = FileDescriptor(ends[1]);
  }
  FileDescriptor a, b;
};

worker::WorkerMessage Piece(size_t bytes) {
  worker::WorkerMessage message;
  message.set_piece(std::string(bytes, 'p'));
  return message;
}

TEST(MessageChannel, MessagesOfAnySizeArriveInOrder) {
  Ends ends;
  const size_t sizes[] = {0, 1, 100, 1 << 20, 5};
  const std::jthread sender([&] {
    for (const size_t size : sizes) EXPECT_TRUE(SendMessage(ends.a, Piece(size)).ok());
    ends.a.Close();
  });
  worker::WorkerMessage message;
  for (const size_t size : sizes) {
    ASSERT_TRUE(ReceiveMessage(ends.b, &message).ok());
    EXPECT_EQ(message.piece().size(), size);
  }
  EXPECT_EQ(ReceiveMessage(ends.b, &message).code(), absl::StatusCode::kOutOfRange);
}

TEST(MessageChannel, EveryCutOfAMessageIsNoticed) {
  const std::string frame = [] {
    Ends ends;
    EXPECT_TRUE(SendMessage(ends.a, Piece(9)).ok());
    std::string bytes(4 + Piece(9).ByteSizeLong(), '\0');
    EXPECT_TRUE(ends.b.Read(bytes.data(), bytes.size()).ok());
    return bytes;
  }();
  for (size_t cut = 0; cut < frame.size(); ++cut) {
    Ends ends;
    ASSERT_TRUE(ends.a.Write(frame.data(), cut).ok());
    ends.a.Close();
    worker::WorkerMessage message;
    EXPECT_EQ(ReceiveMessage(ends.b, &message).code(), absl::StatusCode::kOutOfRange) << cut;
  }
}

TEST(MessageChannel, RefusesWhatIsTooLongOrBroken) {
  Ends ends;
  EXPECT_EQ(SendMessage(ends.a, Piece(kMaxFrameBytes)).code(),
            absl::StatusCode::kResourceExhausted);
  ASSERT_TRUE(ends.a.Write("\xff\xff\xff\x7f", 4).ok());
  worker::WorkerMessage message;
  EXPECT_EQ(ReceiveMessage(ends.b, &message).code(), absl::StatusCode::kDataLoss);
  ASSERT_TRUE(ends.a.Write("\x02\0\0\0\xff\xff", 6).ok());
  EXPECT_EQ(ReceiveMessage(ends.b, &message).code(), absl::StatusCode::kDataLoss);
}

TEST(MessageChannel, APeerThatIsGoneRaisesNoSignal) {
  Ends ends;
  ends.b.Close();
  EXPECT_EQ(SendMessage(ends.a, Piece(1)).code(), absl::StatusCode::kInternal);
}

}  // namespace
}  // namespace rilievo
