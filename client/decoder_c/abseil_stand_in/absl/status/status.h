// What the decoder and the readers use of absl::Status, where Abseil cannot be linked: Debian ships
// it neither for WebAssembly nor as archives that a shared library could take in.
#pragma once

#include <string>
#include <string_view>
#include <utility>

namespace absl {

using string_view = std::string_view;

enum class StatusCode : int {
  kOk = 0,
  kCancelled = 1,
  kInvalidArgument = 3,
  kNotFound = 5,
  kPermissionDenied = 7,
  kResourceExhausted = 8,
  kFailedPrecondition = 9,
  kOutOfRange = 11,
  kUnimplemented = 12,
  kInternal = 13,
  kDataLoss = 15,
};

class [[nodiscard]] Status {
 public:
  Status() = default;
  Status(StatusCode code, std::string_view message) : code_(code), message_(message) {}
  bool ok() const { return code_ == StatusCode::kOk; }
  StatusCode code() const { return code_; }
  std::string_view message() const { return message_; }
  void IgnoreError() const {}
  // Payloads are for calls over a network.
  template <typename Visitor>
  void ForEachPayload(const Visitor&) const {}
  template <typename Payload>
  void SetPayload(std::string_view, const Payload&) {}

 private:
  StatusCode code_ = StatusCode::kOk;
  std::string message_;
};

inline Status OkStatus() { return Status(); }

#define RILIEVO_STATUS_OF(name)                         \
  inline Status name##Error(std::string_view message) { \
    return Status(StatusCode::k##name, message);        \
  }                                                     \
  inline bool Is##name(const Status& status) { return status.code() == StatusCode::k##name; }
RILIEVO_STATUS_OF(Cancelled)
RILIEVO_STATUS_OF(InvalidArgument)
RILIEVO_STATUS_OF(NotFound)
RILIEVO_STATUS_OF(PermissionDenied)
RILIEVO_STATUS_OF(ResourceExhausted)
RILIEVO_STATUS_OF(FailedPrecondition)
RILIEVO_STATUS_OF(OutOfRange)
RILIEVO_STATUS_OF(Unimplemented)
RILIEVO_STATUS_OF(Internal)
RILIEVO_STATUS_OF(DataLoss)
#undef RILIEVO_STATUS_OF

}  // namespace absl
