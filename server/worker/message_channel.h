// Messages over a socket: a length of four bytes, little-endian, then the message.
#pragma once

#include <cstddef>
#include <cstdint>

#include "absl/status/status.h"
#include "google/protobuf/message_lite.h"
#include "server/os/file_descriptor.h"

namespace rilievo {

// A header with the largest control mesh and the longest piece fit.
inline constexpr uint32_t kMaxFrameBytes = 8 << 20;
// Of what travels in pieces.
inline constexpr size_t kPieceBytes = 1 << 20;

// RESOURCE_EXHAUSTED when the message is longer than kMaxFrameBytes; INTERNAL when the peer is
// gone.
absl::Status SendMessage(const FileDescriptor& socket,
                         const google::protobuf::MessageLite& message);

// OUT_OF_RANGE when the peer closed the socket, DATA_LOSS when what came is not such a message.
absl::Status ReceiveMessage(const FileDescriptor& socket, google::protobuf::MessageLite* message);

}  // namespace rilievo
