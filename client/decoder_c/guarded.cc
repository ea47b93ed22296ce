#include "client/decoder_c/guarded.h"

#include "absl/strings/str_cat.h"

namespace rilievo::decoder_c {
namespace {

thread_local std::string last_error;
// Where even the sentence finds no memory.
thread_local const char* last_error_text = "";

RilievoCode CodeOf(absl::StatusCode code) {
  switch (code) {
    case absl::StatusCode::kInvalidArgument:
    case absl::StatusCode::kOutOfRange:
      return RILIEVO_INVALID_ARGUMENT;
    case absl::StatusCode::kFailedPrecondition:
      return RILIEVO_FAILED_PRECONDITION;
    case absl::StatusCode::kResourceExhausted:
      return RILIEVO_RESOURCE_EXHAUSTED;
    case absl::StatusCode::kUnimplemented:
      return RILIEVO_UNIMPLEMENTED;
    case absl::StatusCode::kDataLoss:
      return RILIEVO_DATA_LOSS;
    default:
      return RILIEVO_INTERNAL;
  }
}

}  // namespace

RilievoCode Fail(const absl::Status& status) {
  last_error = std::string(status.message());
  last_error_text = last_error.c_str();
  return CodeOf(status.code());
}

RilievoCode Fail(RilievoCode code, const char* sentence) noexcept {
  try {
    last_error = sentence;
    last_error_text = last_error.c_str();
  } catch (...) {
    last_error_text = "no memory left";
  }
  return code;
}

int Threads(int asked) {
#ifdef RILIEVO_NO_THREADS
  (void)asked;
  return 1;
#else
  return asked;
#endif
}

absl::Status NotNull(const void* pointer, const char* name) {
  if (pointer != nullptr) return absl::OkStatus();
  return absl::InvalidArgumentError(absl::StrCat(name, " is NULL"));
}

}  // namespace rilievo::decoder_c

int rilievo_decoder_abi_version(void) { return 10; }
const char* rilievo_decoder_version(void) { return RILIEVO_VERSION; }
const char* rilievo_last_error(void) { return rilievo::decoder_c::last_error_text; }
