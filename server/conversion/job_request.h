// What a client asked for, checked and in the core's own types.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <variant>

#include "core/paging/scratch_folder.h"
#include "core/paging/shared_parts.h"
#include "core/pipeline/reconstruct.h"
#include "core/pipeline/update_surface.h"
#include "rilievo/v1/reconstruction.pb.h"
#include "server/conversion/call_error.h"
#include "server/conversion/scan_bytes.h"
#include "server/conversion/server_options.h"

namespace rilievo {

// How a job is made that does not fit into memory.
struct PartsRequest {
  int64_t points = 0;  // of a part; see PartSizes::Of()
  ScratchFolder scratch;
  std::shared_ptr<SharedParts> shared = nullptr;  // with other workers; null: with nobody
};

struct JobRequest {
  v1::ReconstructHeader header;  // as the client sent it
  PayloadSize size;
  Eigen::Matrix3Xd stations;  // the places that points name by number; scan frame
  ReconstructOptions options;
  int64_t base_vertices = 0;  // of a surface to bring up to date, as announced
  UpdateOptions update;
  int threads = 1;  // >= 1
  uint64_t seed = 0;
  std::optional<PartsRequest> parts;  // unset: in memory
};

// Points that the stages work on: those of a scan, or as many as are sampled on a mesh.
int64_t WorkedPoints(const JobRequest& request);

// Faces of the control mesh: as many as asked for, or as the control stage chooses when it is left
// to it (DefaultControlFaces() of all points; cleaning may leave fewer).
int64_t ExpectedControlFaces(const JobRequest& request);

// Checks every field against the ranges stated in the proto and the server's limits; nothing is
// allocated by a claimed count. The error lists all fields at fault.
std::variant<JobRequest, CallError> ParseHeader(const v1::ReconstructHeader& header,
                                                const ServerOptions& limits);

}  // namespace rilievo
