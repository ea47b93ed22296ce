// Who changed what, and who was refused, as lines of the server's log.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

#include "absl/status/status.h"
#include "server/observability/event_line.h"
#include "server/observability/line_rate.h"

namespace rilievo {

// One call of a service of the protocol that has ended.
struct AuditRecord {
  std::string call = {};   // "CreateJob"
  std::string peer = {};   // gRPC's word for the connection: "ipv4:10.0.0.1:4711"
  std::string owner = {};  // as proven by a token or a certificate; may be empty
  absl::StatusCode outcome = absl::StatusCode::kOk;
  std::string reason = {};  // ErrorInfo.reason; empty when OK
  // As the caller gave them, or as it was told them; may be empty, and anything.
  std::string job_id = {}, scan_id = {}, request_id = {}, upload_id = {};
};

// CreateJob, CancelJob, DeleteJob, DeleteScan and UploadScan.
bool IsMutating(std::string_view call);

// Whether the call leaves a line: it is a mutating one, or was refused with UNAUTHENTICATED,
// PERMISSION_DENIED or RESOURCE_EXHAUSTED.
bool IsAudited(std::string_view call, absl::StatusCode outcome);

// Names and values of the line: call, outcome, then of reason, peer, owner, job_id, scan_id,
// request_id and upload_id what is not empty, each cut after kMostAuditBytes bytes; left_out unless
// it is 0.
EventFields AuditFields(const AuditRecord& record, uint64_t left_out);
inline constexpr size_t kMostAuditBytes = 64;  // no id is longer

// Thread-safe, never waits.
class AuditLog {
 public:
  // Event "audit" of LogEvent(), when IsAudited(). Calls that succeed all leave one, as long as the
  // log is read. Of those that fail so many of owners do, and fewer of callers who have proven no
  // name: these fill no disk and hide nobody else. left_out counts those of the same kind that left
  // none.
  void Write(const AuditRecord& record);
  static constexpr int kOwnersPerSecond = 50, kStrangersPerSecond = 5;

 private:
  LineRate owners_{kOwnersPerSecond}, strangers_{kStrangersPerSecond};
};

}  // namespace rilievo
