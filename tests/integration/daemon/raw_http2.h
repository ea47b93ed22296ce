// HTTP/2 frames by hand: what no well-behaved client sends.
#pragma once

#include <chrono>
#include <cstdint>
#include <string>
#include <vector>

#include "server/os/file_descriptor.h"

namespace rilievo::http2 {

enum class Type : uint8_t {
  kData = 0,
  kHeaders = 1,
  kReset = 3,
  kSettings = 4,
  kPing = 6,
  kGoAway = 7,
  kContinuation = 9,
};

inline constexpr uint8_t kEndStream = 1, kAcknowledge = 1, kEndHeaders = 4;

struct Frame {
  Type type{};
  uint8_t flags = 0;
  uint32_t stream = 0;
  std::string payload;
};

std::string Bytes(const Frame& frame);

// An integer of HPACK with a prefix of `bits`, the other bits of the first byte as in `first`.
std::string Integer(uint64_t value, int bits, uint8_t first = 0);

// A header of HPACK, by its name, kept in no table.
std::string Header(const std::string& name, const std::string& value);

// Of a gRPC call in plaintext. `te`: the value of that header.
std::string CallHeaders(const std::string& path, const std::string& te = "trailers");

// HEADERS of a call whose message never comes, and at once RST_STREAM.
std::string OpenAndReset(uint32_t stream, const std::string& headers);

// One connection to 127.0.0.1, after the preface and empty SETTINGS of the client.
class RawConnection {
 public:
  explicit RawConnection(int port);

  // Takes the server's SETTINGS and acknowledges them.
  void Acknowledge();

  // False when the server has closed the connection, or reads nothing for 5 s.
  bool Send(const std::string& bytes);

  // What comes until nothing does for `silence`, or the connection is closed.
  std::vector<Frame> Receive(std::chrono::milliseconds silence);

  bool closed() const { return closed_; }

 private:
  FileDescriptor socket_;
  std::string unparsed_;
  bool closed_ = false;
};

}  // namespace rilievo::http2
