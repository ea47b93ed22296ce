#include "server/jobs/request_checks.h"

#include <algorithm>
#include <utility>

#include "absl/strings/ascii.h"
#include "absl/strings/escaping.h"
#include "absl/strings/match.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "server/observability/server_log.h"

namespace rilievo {
namespace {

constexpr size_t kMaxIdLength = 64;
constexpr uint32_t kMaxPage = 1000;
constexpr int kDefaultPage = 100;

CallError Violation(const std::string& field, const std::string& description,
                    ErrorCause reason = ErrorCause::kInvalidField) {
  return BadRequestError({{field, description}}, reason);
}

}  // namespace

std::optional<CallError> CheckId(const std::string& field, const std::string& id) {
  const bool right = !id.empty() && id.size() <= kMaxIdLength &&
                     std::all_of(id.begin(), id.end(), [](unsigned char c) {
                       return absl::ascii_isalnum(c) || c == '-' || c == '_';
                     });
  if (right) return std::nullopt;
  return Violation(field, absl::StrCat(id.size(), " characters; give 1 to ", kMaxIdLength,
                                       " letters, digits, '-' and '_'"));
}

std::optional<CallError> CheckUploadHeader(const v1::UploadHeader& header,
                                           const ServerOptions& limits) {
  if (auto error = CheckId("header.upload_id", header.upload_id())) return error;
  if (header.total_bytes() == 0) {
    return Violation("header.total_bytes", "0; give the bytes of the whole scan");
  }
  if (header.total_bytes() > static_cast<uint64_t>(limits.max_scan_bytes)) {
    return Violation("header.total_bytes",
                     absl::StrCat(header.total_bytes(), " bytes; this server takes at most ",
                                  limits.max_scan_bytes, " in one scan, send fewer points"),
                     ErrorCause::kLimitExceeded)
        .Limit(limits.max_scan_bytes, header.total_bytes());
  }
  if (header.offset() > header.total_bytes()) {
    return Violation("header.offset", absl::StrCat(header.offset(), " is beyond total_bytes, ",
                                                   header.total_bytes()));
  }
  return std::nullopt;
}

std::optional<CallError> ReadEnd(const v1::UploadEnd& end, std::string* sha256) {
  if (end.sha256().size() != 32) {
    return Violation("end.sha256", absl::StrCat(end.sha256().size(), " bytes; a SHA-256 has 32"));
  }
  *sha256 = absl::BytesToHexString(end.sha256());
  return std::nullopt;
}

std::optional<CallError> ReadPage(const v1::ListJobsRequest& request, int* limit, int64_t* before) {
  if (request.page_size() > kMaxPage) {
    return Violation("page_size",
                     absl::StrCat(request.page_size(), " is outside [0, ", kMaxPage, "]"));
  }
  *limit = request.page_size() == 0 ? kDefaultPage : static_cast<int>(request.page_size());
  *before = 0;
  if (!request.page_token().empty() &&
      (!absl::SimpleAtoi(request.page_token(), before) || *before <= 0)) {
    return Violation("page_token", "it is not valid; use next_page_token of the last answer");
  }
  return std::nullopt;
}

std::string PageToken(int64_t before) { return before > 0 ? absl::StrCat(before) : ""; }

CallError ErrorOfStore(const absl::Status& status) {
  auto stated = StatedError(status);
  if (absl::IsResourceExhausted(status)) {
    if (!stated) {
      stated =
          CallError(ErrorCause::kStoreFull, "the server has no room to store it; try again later");
    }
    return stated->RetryAfter(std::chrono::seconds(30));
  }
  if (stated) return *std::move(stated);
  if (absl::IsUnavailable(status)) {
    LogMessage(absl::StrCat("store: ", status.message()));
    return CallError(ErrorCause::kStoreBusy,
                     "the server's store cannot be reached, is in use by another program, or its "
                     "disk fails; "
                     "try again")
        .RetryAfter(std::chrono::seconds(1));
  }
  LogMessage(absl::StrCat("store: ", status.message()));
  return {ErrorCause::kStoreFailed,
          "the server's store failed; its operator finds the cause in the log"};
}

}  // namespace rilievo
