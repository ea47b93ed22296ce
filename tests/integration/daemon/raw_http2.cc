#include "tests/integration/daemon/raw_http2.h"

#include <netinet/tcp.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/time.h>

#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"
#include "tests/unit/server/os/loopback.h"

namespace rilievo::http2 {
namespace {

constexpr size_t kFrameHeader = 9;
constexpr timeval kSendTimeout{5, 0};

FileDescriptor Connected(int port) {
  FileDescriptor end = ConnectTo(port);
  const int yes = 1;
  setsockopt(end.number(), IPPROTO_TCP, TCP_NODELAY, &yes, sizeof(yes));
  setsockopt(end.number(), SOL_SOCKET, SO_SNDTIMEO, &kSendTimeout, sizeof(kSendTimeout));
  return end;
}

std::string BigEndian(uint32_t value, int bytes) {
  std::string result;
  for (int i = bytes - 1; i >= 0; --i) result += static_cast<char>(value >> (8 * i));
  return result;
}

uint32_t FromBigEndian(const char* bytes, int count) {
  uint32_t value = 0;
  for (int i = 0; i < count; ++i) value = value << 8 | static_cast<uint8_t>(bytes[i]);
  return value;
}

std::string Text(const std::string& text) { return absl::StrCat(Integer(text.size(), 7), text); }

}  // namespace

std::string Bytes(const Frame& frame) {
  return BigEndian(static_cast<uint32_t>(frame.payload.size()), 3) + static_cast<char>(frame.type) +
         static_cast<char>(frame.flags) + BigEndian(frame.stream, 4) + frame.payload;
}

std::string Integer(uint64_t value, int bits, uint8_t first) {
  const uint64_t most = (1U << bits) - 1;
  if (value < most) return {static_cast<char>(first | value)};
  std::string result(1, static_cast<char>(first | most));
  for (value -= most; value >= 128; value /= 128) result += static_cast<char>(value % 128 + 128);
  return result + static_cast<char>(value);
}

std::string Header(const std::string& name, const std::string& value) {
  constexpr absl::string_view kWithoutIndex("\0", 1);
  return absl::StrCat(kWithoutIndex, Text(name), Text(value));
}

std::string CallHeaders(const std::string& path, const std::string& te) {
  return Header(":method", "POST") + Header(":scheme", "http") + Header(":path", path) +
         Header(":authority", "localhost") + Header("te", te) +
         Header("content-type", "application/grpc");
}

std::string OpenAndReset(uint32_t stream, const std::string& headers) {
  constexpr uint32_t kCancel = 8;
  return Bytes({Type::kHeaders, kEndHeaders, stream, headers}) +
         Bytes({Type::kReset, 0, stream, BigEndian(kCancel, 4)});
}

RawConnection::RawConnection(int port) : socket_(Connected(port)), closed_(!socket_.valid()) {
  Send("PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n" + Bytes({Type::kSettings, 0, 0, ""}));
}

void RawConnection::Acknowledge() {
  Receive(std::chrono::milliseconds(200));
  Send(Bytes({Type::kSettings, kAcknowledge, 0, ""}));
}

bool RawConnection::Send(const std::string& bytes) {
  for (size_t at = 0; at < bytes.size() && !closed_;) {
    const ssize_t sent = send(socket_.number(), bytes.data() + at, bytes.size() - at, MSG_NOSIGNAL);
    if (sent <= 0) closed_ = true;
    at += sent > 0 ? static_cast<size_t>(sent) : 0;
  }
  return !closed_;
}

std::vector<Frame> RawConnection::Receive(std::chrono::milliseconds silence) {
  char buffer[65'536];
  pollfd ready{socket_.number(), POLLIN, 0};
  while (poll(&ready, 1, static_cast<int>(silence.count())) > 0) {
    const ssize_t size = recv(socket_.number(), buffer, sizeof(buffer), 0);
    if (size <= 0) {
      closed_ = true;
      break;
    }
    unparsed_.append(buffer, static_cast<size_t>(size));
  }
  std::vector<Frame> frames;
  size_t at = 0;
  while (unparsed_.size() >= at + kFrameHeader) {
    const char* head = unparsed_.data() + at;
    const size_t length = FromBigEndian(head, 3);
    if (unparsed_.size() < at + kFrameHeader + length) break;
    frames.push_back({static_cast<Type>(head[3]), static_cast<uint8_t>(head[4]),
                      FromBigEndian(head + 5, 4), unparsed_.substr(at + kFrameHeader, length)});
    at += kFrameHeader + length;
  }
  unparsed_.erase(0, at);
  return frames;
}

}  // namespace rilievo::http2
