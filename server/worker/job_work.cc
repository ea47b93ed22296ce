#include "server/worker/job_work.h"

#include "absl/strings/cord.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"

namespace rilievo {
namespace {

constexpr char kPeakBytes[] = "rilievo.dev/peak_bytes";

}  // namespace

int64_t PeakBytes(const absl::StatusOr<JobResult>& result) {
  if (result.ok()) return result->peak_bytes;
  int64_t bytes = 0;
  const auto payload = result.status().GetPayload(kPeakBytes);
  if (payload && !absl::SimpleAtoi(std::string(*payload), &bytes)) return 0;
  return bytes;
}

absl::Status WithPeakBytes(absl::Status status, int64_t bytes) {
  if (bytes > 0) status.SetPayload(kPeakBytes, absl::Cord(absl::StrCat(bytes)));
  return status;
}

std::string DetailOf(const absl::Status& status) {
  return status.ok() ? "" : status.ToString(absl::StatusToStringMode::kWithNoExtraData);
}

}  // namespace rilievo
