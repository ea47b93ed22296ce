#include "client/cli/working_server.h"

#include <limits>

#include "client/library/connect.h"
#include "core/base/status_macros.h"

namespace rilievo {

ServerOptions LimitsForOneself() {
  ServerOptions options;
  options.max_points = std::numeric_limits<int32_t>::max();
  options.max_scan_bytes = kMostRecordBytes * options.max_points;
  options.max_surface_faces = std::numeric_limits<int32_t>::max();
  options.max_concurrent_jobs = 1;
  options.memory_budget = std::numeric_limits<int64_t>::max();
  options.max_job_time = std::chrono::hours(24 * 7);
  options.max_idle_time = std::chrono::hours(24 * 7);
  return options;
}

absl::StatusOr<WorkingServer> ConnectOrStart(const ServerArguments& arguments) {
  WorkingServer server;
  if (!arguments.server.empty()) {
    RILIEVO_ASSIGN_OR_RETURN(const auto channels, ConnectTo(arguments));
    server.channel = FirstReachable(channels);
    return server;
  }
  RILIEVO_ASSIGN_OR_RETURN(server.embedded, EmbeddedServer::Start(LimitsForOneself()));
  server.channel = server.embedded->channel();
  return server;
}

}  // namespace rilievo
