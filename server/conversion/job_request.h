// What a client asked for, checked and in the core's own types.
#pragma once

#include <cstdint>
#include <variant>

#include "core/geometry/point_records.h"
#include "core/pipeline/reconstruct.h"
#include "rilievo/v1/reconstruction.pb.h"
#include "server/conversion/call_error.h"
#include "server/conversion/server_options.h"

namespace rilievo {

struct JobRequest {
  v1::ReconstructHeader header;  // as the client sent it
  int64_t point_count = 0;
  int64_t triangle_count = 0;  // 0: a scan, else a mesh whose vertices are the points
  PointLayout layout;
  Eigen::Matrix3Xd stations;  // the places that points name by number; scan frame
  ReconstructOptions options;
  int threads = 1;  // >= 1
  uint64_t seed = 0;
};

// Points that the stages work on: those of a scan, or as many as are sampled on a mesh.
int64_t WorkedPoints(const JobRequest& request);

// Faces of the control mesh: as many as asked for, or as the control stage chooses when it is left
// to it (see DefaultControlFaces(), which knows the points that remain after cleaning).
int64_t ExpectedControlFaces(const JobRequest& request);

// Checks every field against the ranges stated in the proto and the server's limits; nothing is
// allocated by a claimed count. The error lists all fields at fault.
std::variant<JobRequest, CallError> ParseHeader(const v1::ReconstructHeader& header,
                                                const ServerOptions& limits);

}  // namespace rilievo
