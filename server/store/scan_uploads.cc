#include "server/store/scan_uploads.h"

#include "absl/strings/str_cat.h"
#include "server/conversion/call_error.h"

namespace rilievo {

absl::Status UploadTakenOver() {
  return StatusOf({ErrorCause::kUploadTakenOver, "another stream of this upload has taken over"});
}

absl::Status OffsetBeyondStored(int64_t offset, int64_t stored) {
  return StatusOf(CallError(ErrorCause::kOffsetOutOfRange,
                            absl::StrCat("the upload was to go on at byte ", offset, ", but ",
                                         stored, " are stored; go on there"))
                      .Limit(stored, offset));
}

absl::Status UploadMismatch(int64_t total_bytes, const std::string& sha256, int64_t bytes,
                            const std::string& name) {
  return StatusOf(
      {ErrorCause::kScanMismatch,
       absl::StrCat("the scan was to have ", total_bytes, " bytes with SHA-256 ", sha256, ", but ",
                    bytes, name.empty() ? "" : absl::StrCat(" with ", name),
                    " arrived; send it again from 0")});
}

}  // namespace rilievo
