// Whether anything came. gRPC ends a read alike when its client half-closed and when the message
// could not be parsed; parsing clears the message first.
#pragma once

#include "google/protobuf/message.h"
#include "google/protobuf/unknown_field_set.h"

namespace rilievo {

inline constexpr int kUnreadField = 536'870'911;  // the largest number, which no message uses

// Before a read.
inline void MarkUnread(google::protobuf::Message* message) {
  message->GetReflection()->MutableUnknownFields(message)->AddVarint(kUnreadField, 1);
}

// After a read that brought nothing: false when something came that is not such a message.
inline bool IsUnread(const google::protobuf::Message& message) {
  const auto& unknown = message.GetReflection()->GetUnknownFields(message);
  return !unknown.empty() && unknown.field(0).number() == kUnreadField;
}

}  // namespace rilievo
