#include "client/library/status_conversion.h"

#include "absl/strings/cord.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "google/rpc/error_details.pb.h"
#include "google/rpc/status.pb.h"
#include "grpcpp/support/status.h"

namespace rilievo {
namespace {

constexpr char kDetailsUrl[] = "type.googleapis.com/google.rpc.Status";

// The first detail of a type, if there is one.
template <typename Detail>
std::optional<Detail> FindDetail(const absl::Status& status) {
  const auto payload = status.GetPayload(kDetailsUrl);
  google::rpc::Status details;
  if (!payload || !details.ParseFromString(std::string(*payload))) return std::nullopt;
  for (const auto& any : details.details()) {
    Detail detail;
    if (any.UnpackTo(&detail)) return detail;
  }
  return std::nullopt;
}

}  // namespace

absl::Status StatusFromGrpc(const grpc::Status& status) {
  if (status.ok()) return absl::OkStatus();
  const auto code = static_cast<absl::StatusCode>(status.error_code());
  absl::Status plain(code, status.error_message());
  if (status.error_details().empty()) return plain;
  plain.SetPayload(kDetailsUrl, absl::Cord(status.error_details()));
  std::string message = status.error_message();
  if (const auto bad = FindDetail<google::rpc::BadRequest>(plain)) {
    for (const auto& violation : bad->field_violations()) {
      const std::string line = absl::StrCat(violation.field(), ": ", violation.description());
      if (!absl::StrContains(message, line)) absl::StrAppend(&message, "; ", line);
    }
  }
  absl::Status result(code, message);
  result.SetPayload(kDetailsUrl, absl::Cord(status.error_details()));
  return result;
}

std::optional<std::chrono::milliseconds> RetryDelay(const absl::Status& status) {
  const auto retry = FindDetail<google::rpc::RetryInfo>(status);
  if (!retry) return std::nullopt;
  return std::chrono::milliseconds(retry->retry_delay().seconds() * 1000 +
                                   retry->retry_delay().nanos() / 1'000'000);
}

std::string ErrorReason(const absl::Status& status) {
  const auto info = FindDetail<google::rpc::ErrorInfo>(status);
  // What stands between, such as a proxy, has words of its own.
  const bool ours = info && (info->domain() == "rilievo.dev" || info->domain() == "rilievo");
  return ours ? info->reason() : "";
}

}  // namespace rilievo
