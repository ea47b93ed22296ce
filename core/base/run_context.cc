#include "core/base/run_context.h"

#include <algorithm>
#include <thread>

namespace rilievo {

const char* StageName(Stage stage) {
  switch (stage) {
    case Stage::kCheck:
      return "check";
    case Stage::kNeighbors:
      return "neighbors";
    case Stage::kNormals:
      return "normals";
    case Stage::kControlMesh:
      return "control-mesh";
    case Stage::kDomainFit:
      return "domain-fit";
    case Stage::kDisplacement:
      return "displacement";
    case Stage::kMeasure:
      return "measure";
    case Stage::kEncode:
      return "encode";
  }
  return "unknown";
}

absl::Status RunContext::CheckStop() const {
  if (stop.stop_requested()) return absl::CancelledError("the caller asked to stop");
  return absl::OkStatus();
}

void RunContext::Report(Stage stage, double fraction) const {
  if (progress) progress(Progress{stage, std::clamp(fraction, 0.0, 1.0)});
}

int RunContext::ThreadCount() const {
  if (threads > 0) return threads;
  return std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
}

}  // namespace rilievo
