#include "server/conversion/call_error.h"

#include <algorithm>
#include <utility>

#include "absl/strings/cord.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/strip.h"
#include "google/rpc/error_details.pb.h"

namespace rilievo {
namespace {

constexpr char kErrorInfoUrl[] = "type.googleapis.com/google.rpc.ErrorInfo";
constexpr size_t kMaxTextBytes = 500;
constexpr size_t kMaxViolations = 8;

// At most kMaxTextBytes, cut between UTF-8 characters.
std::string Shortened(const std::string& text) {
  if (text.size() <= kMaxTextBytes) return text;
  size_t end = kMaxTextBytes;
  while (end > 0 && (static_cast<unsigned char>(text[end]) & 0xC0) == 0x80) --end;
  return text.substr(0, end) + "...";
}

google::rpc::BadRequest BadRequestOf(const std::vector<FieldViolation>& violations) {
  google::rpc::BadRequest bad;
  for (size_t i = 0; i < std::min(violations.size(), kMaxViolations); ++i) {
    auto* violation = bad.add_field_violations();
    violation->set_field(Shortened(violations[i].field));
    violation->set_description(Shortened(violations[i].description));
  }
  return bad;
}

google::rpc::RetryInfo RetryInfoOf(std::chrono::milliseconds delay) {
  google::rpc::RetryInfo retry;
  retry.mutable_retry_delay()->set_seconds(delay.count() / 1000);
  retry.mutable_retry_delay()->set_nanos(static_cast<int32_t>(delay.count() % 1000 * 1'000'000));
  return retry;
}

google::rpc::ErrorInfo ErrorInfoOf(const CallError& error) {
  google::rpc::ErrorInfo info;
  info.set_reason(NameOf(error.reason));
  info.set_domain(kErrorDomain);
  info.mutable_metadata()->insert(error.metadata.begin(), error.metadata.end());
  return info;
}

}  // namespace

google::rpc::Status RpcStatus(const CallError& error) {
  google::rpc::Status details;
  details.set_code(static_cast<int>(error.code()));
  details.set_message(Shortened(error.message));
  details.add_details()->PackFrom(ErrorInfoOf(error));
  if (!error.violations.empty()) details.add_details()->PackFrom(BadRequestOf(error.violations));
  if (error.retry_delay) details.add_details()->PackFrom(RetryInfoOf(*error.retry_delay));
  return details;
}

CallError BadRequestError(std::vector<FieldViolation> violations, ErrorCause reason) {
  std::string message;
  for (const FieldViolation& violation : violations) {
    absl::StrAppend(&message, message.empty() ? "" : "; ", violation.field, ": ",
                    violation.description);
  }
  CallError error(reason, std::move(message));
  error.violations = std::move(violations);
  return error;
}

absl::Status StatusOf(const CallError& error) {
  absl::Status status(error.code(), error.message);
  status.SetPayload(kErrorInfoUrl, absl::Cord(ErrorInfoOf(error).SerializeAsString()));
  return status;
}

std::optional<CallError> StatedError(const absl::Status& status) {
  const auto payload = status.GetPayload(kErrorInfoUrl);
  google::rpc::ErrorInfo info;
  if (!payload || !info.ParseFromString(std::string(*payload))) return std::nullopt;
  const auto reasons = ErrorCauses();
  const auto found = std::find_if(reasons.begin(), reasons.end(),
                                  [&](const auto& entry) { return info.reason() == entry.name; });
  if (found == reasons.end()) return std::nullopt;
  CallError error(found->reason, std::string(status.message()));
  error.metadata.insert(info.metadata().begin(), info.metadata().end());
  return error;
}

CallError ErrorOfJob(const absl::Status& status, const std::string& field,
                     const std::string& subject) {
  if (auto stated = StatedError(status)) return *std::move(stated);
  std::string message(status.message());
  switch (status.code()) {
    case absl::StatusCode::kInvalidArgument:
    case absl::StatusCode::kOutOfRange: {
      // A stage may name the field itself: once is enough.
      std::string description(absl::StripPrefix(message, absl::StrCat(field, ": ")));
      CallError error(ErrorCause::kUnusableScan, absl::StrCat(field, ": ", description));
      error.violations = {{field, std::move(description)}};
      return error;
    }
    case absl::StatusCode::kFailedPrecondition:
      return {field == "base" ? ErrorCause::kUnsuitableBase : ErrorCause::kUnsuitableTopology,
              std::move(message)};
    case absl::StatusCode::kResourceExhausted:
      return {ErrorCause::kJobTooLarge, std::move(message)};
    case absl::StatusCode::kDeadlineExceeded:
      return {ErrorCause::kJobTimeLimit, std::move(message)};
    case absl::StatusCode::kAborted:
      return CallError(ErrorCause::kWorkerKilled, std::move(message))
          .RetryAfter(std::chrono::seconds(1));
    case absl::StatusCode::kUnavailable:
      return CallError(
                 ErrorCause::kWorkerUnavailable,
                 "this server cannot work on jobs at present, of which its operator finds the "
                 "cause in the log; try again later")
          .RetryAfter(std::chrono::seconds(5));
    case absl::StatusCode::kDataLoss:
      return {ErrorCause::kScanDamaged, "the stored scan is damaged or gone; upload it again"};
    default:
      return {ErrorCause::kServerDefect,
              absl::StrCat("the server failed", subject.empty() ? "" : " at ", subject,
                           "; its operator finds the cause in the log")};
  }
}

}  // namespace rilievo
