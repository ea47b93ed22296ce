// The core's report in the words of the protocol.
#pragma once

#include "core/pipeline/reconstruct.h"
#include "rilievo/v1/report.pb.h"

namespace rilievo {

v1::Stage ProtoStage(Stage stage);

// `measured`: whether report.error means anything.
v1::ReconstructReport ProtoReport(const ReconstructReport& report, bool measured);

}  // namespace rilievo
