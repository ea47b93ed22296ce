#include "server/rpc/grpc_status.h"

#include <algorithm>
#include <string>

#include "google/rpc/error_details.pb.h"

namespace rilievo {
namespace {

constexpr size_t kMaxTextBytes = 500;
constexpr size_t kMaxViolations = 8;

// At most kMaxTextBytes, cut between UTF-8 characters.
std::string Shortened(const std::string& text) {
  if (text.size() <= kMaxTextBytes) return text;
  size_t end = kMaxTextBytes;
  while (end > 0 && (static_cast<unsigned char>(text[end]) & 0xC0) == 0x80) --end;
  return text.substr(0, end) + "...";
}

}  // namespace

google::rpc::Status RpcStatus(const CallError& error) {
  google::rpc::Status details;
  details.set_code(static_cast<int>(error.code));
  details.set_message(Shortened(error.message));
  if (!error.violations.empty()) {
    google::rpc::BadRequest bad;
    for (size_t i = 0; i < std::min(error.violations.size(), kMaxViolations); ++i) {
      auto* violation = bad.add_field_violations();
      violation->set_field(Shortened(error.violations[i].field));
      violation->set_description(Shortened(error.violations[i].description));
    }
    details.add_details()->PackFrom(bad);
  }
  if (error.retry_delay) {
    google::rpc::RetryInfo retry;
    retry.mutable_retry_delay()->set_seconds(error.retry_delay->count() / 1000);
    retry.mutable_retry_delay()->set_nanos(
        static_cast<int32_t>(error.retry_delay->count() % 1000 * 1'000'000));
    details.add_details()->PackFrom(retry);
  }
  if (!error.reason.empty()) {
    google::rpc::ErrorInfo info;
    info.set_reason(error.reason);
    info.set_domain("rilievo");
    details.add_details()->PackFrom(info);
  }
  return details;
}

grpc::Status GrpcStatus(const CallError& error) {
  const google::rpc::Status details = RpcStatus(error);
  return grpc::Status(static_cast<grpc::StatusCode>(error.code), details.message(),
                      details.SerializeAsString());
}

}  // namespace rilievo
