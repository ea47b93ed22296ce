// What a client asked for, checked and in the core's own types.
#pragma once

#include <cstdint>
#include <variant>

#include "core/pipeline/reconstruct.h"
#include "rilievo/v1/reconstruction.pb.h"
#include "server/conversion/call_error.h"
#include "server/conversion/server_options.h"

namespace rilievo {

enum class CoordinateType { kFloat32, kFloat64 };

// 12 or 24.
int64_t BytesOfPoint(CoordinateType type);

struct JobRequest {
  v1::ReconstructHeader header;  // as the client sent it
  int64_t point_count = 0;
  CoordinateType coordinates = CoordinateType::kFloat32;
  ReconstructOptions options;
  int threads = 1;  // >= 1
  uint64_t seed = 0;
};

// Faces of the control mesh: as many as asked for, or as the control stage chooses when it is left
// to it (see DefaultControlFaces(), which knows the points that remain after cleaning).
int64_t ExpectedControlFaces(const JobRequest& request);

// Checks every field against the ranges stated in the proto and the server's limits; nothing is
// allocated by a claimed count. The error lists all fields at fault.
std::variant<JobRequest, CallError> ParseHeader(const v1::ReconstructHeader& header,
                                                const ServerOptions& limits);

}  // namespace rilievo
