// What JobsService demands of the fields of its requests.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "absl/status/status.h"
#include "rilievo/v1/jobs.pb.h"
#include "server/conversion/call_error.h"
#include "server/conversion/server_options.h"

namespace rilievo {

// Nothing when `id` has 1 to 64 letters, digits, '-' and '_'; else INVALID_ARGUMENT for `field`.
std::optional<CallError> CheckId(const std::string& field, const std::string& id);

std::optional<CallError> CheckUploadHeader(const v1::UploadHeader& header,
                                           const ServerOptions& limits);

// Digest as scan_id is written; INVALID_ARGUMENT when it has not 32 bytes.
std::optional<CallError> ReadEnd(const v1::UploadEnd& end, std::string* sha256);

std::optional<CallError> ReadPage(const v1::ListJobsRequest& request, int* limit, int64_t* before);
std::string PageToken(int64_t before);

// What the store's status means to a client: what it states (see StatusOf()), else STORE_FULL or
// STORE_FAILED. The text of a failure names files; it stays with the operator.
CallError ErrorOfStore(const absl::Status& status);

}  // namespace rilievo
