// The core's report in the words of the protocol.
#pragma once

#include "core/pipeline/reconstruct.h"
#include "core/pipeline/update_surface.h"
#include "rilievo/v1/report.pb.h"

namespace rilievo {

v1::Stage ProtoStage(Stage stage);

// Of an update: points_in, non_finite and encoded_bytes, and `update`.
v1::ReconstructReport ProtoReport(const UpdateReport& report, int64_t bytes);

// `measured`: whether report.error means anything.
v1::ReconstructReport ProtoReport(const ReconstructReport& report, bool measured);

}  // namespace rilievo
