// The proof of what a surface made by parts states of itself, against a scan on disk.
#pragma once

#include <cstdint>
#include <span>
#include <string>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/paging/paged_scan.h"
#include "core/pipeline/certificate.h"
#include "core/pipeline/reconstruct.h"

namespace rilievo {

// The first kHashBytes bytes of the SHA-256 of the points that are in the pages: x, y, z as
// little-endian doubles. The same for every order of the points in the file. The errors of
// PagedScan::Read().
absl::StatusOr<std::string> HashOfPages(const PagedScan& scan, const RunContext& context);

// VerifyCertificate() of a file that ReconstructPaged() has made, in parts of the sizes that it
// states, and in memory as there: the points are thinned and analyzed as the stated options ask
// for, then errors are measured both ways between all of them and the decoded surface, a part of it
// at a time. `dss`: the whole file. The errors of DecodeDss() and of scratch files;
// INVALID_ARGUMENT for a surface that was not made by parts, and for options of an unknown kind.
absl::StatusOr<Verification> VerifyPaged(std::span<const uint8_t> dss, const PagedScan& scan,
                                         const RunContext& context);

}  // namespace rilievo
