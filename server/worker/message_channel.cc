#include "server/worker/message_channel.h"

#include <bit>
#include <cstring>
#include <string>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"

namespace rilievo {

static_assert(std::endian::native == std::endian::little, "lengths travel little-endian");

absl::Status SendMessage(const FileDescriptor& socket,
                         const google::protobuf::MessageLite& message) {
  const size_t size = message.ByteSizeLong();
  if (size > kMaxFrameBytes) {
    return absl::ResourceExhaustedError(
        absl::StrCat("a message of ", size, " bytes; at most ", kMaxFrameBytes, " travel"));
  }
  const auto length = static_cast<uint32_t>(size);
  std::string frame(sizeof(length) + size, '\0');
  std::memcpy(frame.data(), &length, sizeof(length));
  if (!message.SerializeToArray(frame.data() + sizeof(length), static_cast<int>(size))) {
    return absl::InternalError("a message cannot be written");
  }
  return socket.Send(frame.data(), frame.size());
}

absl::Status ReceiveMessage(const FileDescriptor& socket, google::protobuf::MessageLite* message) {
  uint32_t length = 0;
  RILIEVO_RETURN_IF_ERROR(socket.Read(&length, sizeof(length)));
  if (length > kMaxFrameBytes) {
    return absl::DataLossError(absl::StrCat("a message of ", length, " bytes was announced"));
  }
  std::string frame(length, '\0');
  RILIEVO_RETURN_IF_ERROR(socket.Read(frame.data(), frame.size()));
  if (!message->ParseFromString(frame)) return absl::DataLossError("a broken message came");
  return absl::OkStatus();
}

}  // namespace rilievo
