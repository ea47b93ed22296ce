#include "server/observability/audit_log.h"

#include <algorithm>
#include <array>
#include <optional>
#include <utility>

#include "server/observability/server_log.h"

namespace rilievo {

bool IsMutating(std::string_view call) {
  constexpr std::array<std::string_view, 5> kCalls = {"CreateJob", "CancelJob", "DeleteJob",
                                                      "DeleteScan", "UploadScan"};
  return std::find(kCalls.begin(), kCalls.end(), call) != kCalls.end();
}

bool IsAudited(std::string_view call, absl::StatusCode outcome) {
  return outcome == absl::StatusCode::kUnauthenticated ||
         outcome == absl::StatusCode::kPermissionDenied ||
         outcome == absl::StatusCode::kResourceExhausted || IsMutating(call);
}

EventFields AuditFields(const AuditRecord& record, uint64_t left_out) {
  EventFields fields = {{"call", record.call},
                        {"outcome", absl::StatusCodeToString(record.outcome)}};
  for (const auto& [name, value] :
       {std::pair("reason", &record.reason), std::pair("peer", &record.peer),
        std::pair("owner", &record.owner), std::pair("job_id", &record.job_id),
        std::pair("scan_id", &record.scan_id), std::pair("request_id", &record.request_id),
        std::pair("upload_id", &record.upload_id)}) {
    if (!value->empty()) fields.emplace_back(name, value->substr(0, kMostAuditBytes));
  }
  if (left_out > 0) fields.emplace_back("left_out", std::to_string(left_out));
  return fields;
}

void AuditLog::Write(const AuditRecord& record) {
  if (!IsAudited(record.call, record.outcome)) return;
  std::optional<uint64_t> left_out = 0;
  if (record.outcome != absl::StatusCode::kOk) {
    LineRate& rate = record.owner.empty() ? strangers_ : owners_;
    left_out = rate.Pass(LineRate::Clock::now());
  }
  if (left_out) LogEvent("audit", AuditFields(record, *left_out));
}

}  // namespace rilievo
