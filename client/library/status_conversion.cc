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
  google::rpc::Status details;
  details.ParseFromString(status.error_details());  // nothing of it: no details
  details.set_code(status.error_code());
  details.set_message(status.error_message());
  return StatusFromRpc(details);
}

absl::Status StatusFromRpc(const google::rpc::Status& status) {
  if (status.code() == 0) return absl::OkStatus();
  const auto code = static_cast<absl::StatusCode>(status.code());
  absl::Status plain(code, status.message());
  if (status.details().empty()) return plain;
  const absl::Cord details(status.SerializeAsString());
  plain.SetPayload(kDetailsUrl, details);
  std::string message = status.message();
  for (const ViolatedField& violated : ViolatedFields(plain)) {
    const std::string line = absl::StrCat(violated.field, ": ", violated.description);
    if (!absl::StrContains(message, line)) absl::StrAppend(&message, "; ", line);
  }
  absl::Status result(code, message);
  result.SetPayload(kDetailsUrl, details);
  return result;
}

std::vector<ViolatedField> ViolatedFields(const absl::Status& status) {
  std::vector<ViolatedField> violated;
  const auto bad = FindDetail<google::rpc::BadRequest>(status);
  if (!bad) return violated;
  for (const auto& violation : bad->field_violations()) {
    violated.push_back({violation.field(), violation.description()});
  }
  return violated;
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
