// Why a call fails, in a word: the reason of ErrorInfo. docs/api.md says of each what to do.
#pragma once

#include <span>

#include "absl/status/status.h"

namespace rilievo {

// ErrorInfo.domain of all of them.
inline constexpr char kErrorDomain[] = "rilievo.dev";

enum class ErrorCause {
  kInvalidField,        // missing, out of range, or no such choice
  kMessageOrder,        // a message of a stream came where another kind was due
  kMalformedMessage,    // not the protobuf that the method takes
  kLimitExceeded,       // over a limit of GetCapabilities
  kUnusableScan,        // no surface can be made of these points
  kUnsuitableTopology,  // not with the topology or control mesh asked for
  kUnsuitableBase,      // a surface that the points cannot bring up to date
  kNoStore,
  kJobNotSucceeded,
  kNoToken,
  kWrongToken,
  kNoCertificate,
  kJobNotFound,
  kScanNotFound,
  kRequestIdUsed,
  kOffsetOutOfRange,
  kScanIncomplete,  // the stream ended before the scan did
  kScanMismatch,    // size or SHA-256 are not those announced
  kScanDamaged,     // what is stored is not what was uploaded
  kSurfaceDamaged,
  kJobDamaged,
  kUploadTakenOver,
  kJobsLimit,
  kCallsLimit,
  kWorkerKilled,
  kMemoryLimit,  // by estimate, before the work
  kJobTooLarge,  // found out while it was worked on
  kStoreFull,
  kJobTimeLimit,
  kIdleLimit,
  kUploadTimeLimit,
  kClientCancelled,
  kShuttingDown,
  kStoreBusy,  // another program holds it
  kTryAgain,
  kWorkerUnavailable,  // of the machine, not of the job
  kUnknownMethod,
  kServerDefect,
  kStoreFailed,
};

// A reason has one status code.
struct ErrorCauseEntry {
  ErrorCause reason;
  const char* name;  // stable, UPPER_SNAKE_CASE
  absl::StatusCode code;
};

// All of them, in the order of the enumeration.
std::span<const ErrorCauseEntry> ErrorCauses();

inline const char* NameOf(ErrorCause reason) {
  return ErrorCauses()[static_cast<size_t>(reason)].name;
}
inline absl::StatusCode CodeOf(ErrorCause reason) {
  return ErrorCauses()[static_cast<size_t>(reason)].code;
}

}  // namespace rilievo
