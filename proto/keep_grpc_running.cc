#include "proto/keep_grpc_running.h"

#include "absl/base/internal/sysinfo.h"
#include "grpc/grpc.h"

namespace rilievo {

void KeepGrpcRunning() {
  static const bool once = [] {
    grpc_init();
    return true;
  }();
  static_cast<void>(once);
}

void PrepareToConnect() {
  KeepGrpcRunning();
  static const double once = absl::base_internal::NominalCPUFrequency();
  static_cast<void>(once);
}

}  // namespace rilievo
