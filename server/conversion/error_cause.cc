#include "server/conversion/error_cause.h"

#include <cstddef>

namespace rilievo {
namespace {

using Code = absl::StatusCode;

constexpr ErrorCauseEntry kReasons[] = {
    {ErrorCause::kInvalidField, "INVALID_FIELD", Code::kInvalidArgument},
    {ErrorCause::kMessageOrder, "MESSAGE_ORDER", Code::kInvalidArgument},
    {ErrorCause::kMalformedMessage, "MALFORMED_MESSAGE", Code::kInvalidArgument},
    {ErrorCause::kLimitExceeded, "LIMIT_EXCEEDED", Code::kInvalidArgument},
    {ErrorCause::kUnusableScan, "UNUSABLE_SCAN", Code::kInvalidArgument},
    {ErrorCause::kUnsuitableTopology, "UNSUITABLE_TOPOLOGY", Code::kFailedPrecondition},
    {ErrorCause::kUnsuitableBase, "UNSUITABLE_BASE", Code::kFailedPrecondition},
    {ErrorCause::kNoStore, "NO_STORE", Code::kFailedPrecondition},
    {ErrorCause::kJobNotSucceeded, "JOB_NOT_SUCCEEDED", Code::kFailedPrecondition},
    {ErrorCause::kNoToken, "NO_TOKEN", Code::kUnauthenticated},
    {ErrorCause::kWrongToken, "WRONG_TOKEN", Code::kUnauthenticated},
    {ErrorCause::kNoCertificate, "NO_CERTIFICATE", Code::kUnauthenticated},
    {ErrorCause::kJobNotFound, "JOB_NOT_FOUND", Code::kNotFound},
    {ErrorCause::kScanNotFound, "SCAN_NOT_FOUND", Code::kNotFound},
    {ErrorCause::kRequestIdUsed, "REQUEST_ID_USED", Code::kAlreadyExists},
    {ErrorCause::kOffsetOutOfRange, "OFFSET_OUT_OF_RANGE", Code::kOutOfRange},
    {ErrorCause::kScanIncomplete, "SCAN_INCOMPLETE", Code::kDataLoss},
    {ErrorCause::kScanMismatch, "SCAN_MISMATCH", Code::kDataLoss},
    {ErrorCause::kScanDamaged, "SCAN_DAMAGED", Code::kDataLoss},
    {ErrorCause::kSurfaceDamaged, "SURFACE_DAMAGED", Code::kDataLoss},
    {ErrorCause::kJobDamaged, "JOB_DAMAGED", Code::kDataLoss},
    {ErrorCause::kUploadTakenOver, "UPLOAD_TAKEN_OVER", Code::kAborted},
    {ErrorCause::kJobsLimit, "JOBS_LIMIT", Code::kResourceExhausted},
    {ErrorCause::kCallsLimit, "CALLS_LIMIT", Code::kResourceExhausted},
    {ErrorCause::kWorkerKilled, "WORKER_KILLED", Code::kResourceExhausted},
    {ErrorCause::kMemoryLimit, "MEMORY_LIMIT", Code::kResourceExhausted},
    {ErrorCause::kJobTooLarge, "JOB_TOO_LARGE", Code::kResourceExhausted},
    {ErrorCause::kStoreFull, "STORE_FULL", Code::kResourceExhausted},
    {ErrorCause::kJobTimeLimit, "JOB_TIME_LIMIT", Code::kDeadlineExceeded},
    {ErrorCause::kIdleLimit, "IDLE_LIMIT", Code::kDeadlineExceeded},
    {ErrorCause::kUploadTimeLimit, "UPLOAD_TIME_LIMIT", Code::kDeadlineExceeded},
    {ErrorCause::kClientCancelled, "CLIENT_CANCELLED", Code::kCancelled},
    {ErrorCause::kShuttingDown, "SHUTTING_DOWN", Code::kUnavailable},
    {ErrorCause::kStoreBusy, "STORE_BUSY", Code::kUnavailable},
    {ErrorCause::kTryAgain, "TRY_AGAIN", Code::kUnavailable},
    {ErrorCause::kWorkerUnavailable, "WORKER_UNAVAILABLE", Code::kUnavailable},
    {ErrorCause::kUnknownMethod, "UNKNOWN_METHOD", Code::kUnimplemented},
    {ErrorCause::kServerDefect, "SERVER_DEFECT", Code::kInternal},
    {ErrorCause::kStoreFailed, "STORE_FAILED", Code::kInternal},
};

constexpr bool InOrder() {
  for (size_t i = 0; i < std::size(kReasons); ++i) {
    if (kReasons[i].reason != static_cast<ErrorCause>(i)) return false;
  }
  return true;
}
static_assert(InOrder(), "a reason is found by its number");

}  // namespace

std::span<const ErrorCauseEntry> ErrorCauses() { return kReasons; }

}  // namespace rilievo
