// What a header says of the bytes that follow it.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "core/geometry/point_records.h"
#include "rilievo/v1/reconstruction.pb.h"
#include "server/conversion/call_error.h"
#include "server/conversion/job_request.h"
#include "server/conversion/server_options.h"

namespace rilievo {

// How the points of a header travel; of an unknown format as float64.
PointLayout LayoutOf(const v1::ReconstructHeader& header);

// Bytes of all its points and triangles, and of its base surface; 0 when there are more than any
// scan has.
int64_t ScanBytesOf(const v1::ReconstructHeader& header);

// Over a limit of this server.
struct Excess {
  int64_t limit;
  uint64_t value;
};

// Layout and counts. Fields at fault are among the violations; the one over a limit is returned
// too.
std::optional<Excess> ReadScanSize(const v1::ReconstructHeader& header, const ServerOptions& limits,
                                   JobRequest* request, std::vector<FieldViolation>* violations);

}  // namespace rilievo
