#include "server/conversion/server_options.h"

#include <gtest/gtest.h>

#include <functional>

namespace rilievo {
namespace {

TEST(ServerOptions, DefaultsAreValidAndOnLoopback) {
  const ServerOptions options;
  EXPECT_TRUE(options.Validate().ok());
  EXPECT_EQ(options.listen.rfind("127.0.0.1:", 0), 0u);
  EXPECT_GE(options.ThreadLimit(), 1);
}

TEST(ServerOptions, NamesTheFieldOutOfRange) {
  const std::vector<std::pair<std::string, std::function<void(ServerOptions*)>>> cases = {
      {"listen", [](auto* o) { o->listen.clear(); }},
      {"max_points", [](auto* o) { o->max_points = 19; }},
      {"max_scan_bytes", [](auto* o) { o->max_scan_bytes = 0; }},
      {"max_surface_faces", [](auto* o) { o->max_surface_faces = -1; }},
      {"max_concurrent_jobs", [](auto* o) { o->max_concurrent_jobs = 0; }},
      {"max_concurrent_jobs", [](auto* o) { o->max_concurrent_jobs = 1025; }},
      {"max_queued_jobs", [](auto* o) { o->max_queued_jobs = -1; }},
      {"threads", [](auto* o) { o->threads = 1025; }},
      {"max_job_memory", [](auto* o) { o->max_job_memory = -1; }},
      {"memory_budget", [](auto* o) { o->memory_budget = -1; }},
      {"max_job_time", [](auto* o) { o->max_job_time = {}; }},
      {"max_idle_time", [](auto* o) { o->max_idle_time = {}; }},
      {"keep_time", [](auto* o) { o->keep_time = {}; }},
      {"keep_bytes", [](auto* o) { o->keep_bytes = 0; }},
      {"max_waiting_jobs", [](auto* o) { o->max_waiting_jobs = 0; }},
      {"max_calls", [](auto* o) { o->max_calls = 0; }},
      {"max_uploads", [](auto* o) { o->max_uploads = 0; }},
      {"max_connections", [](auto* o) { o->max_connections = 0; }},
      {"max_address_connections", [](auto* o) { o->max_address_connections = -1; }},
      {"drain_time", [](auto* o) { o->drain_time = std::chrono::milliseconds(-1); }},
  };
  for (const auto& [field, change] : cases) {
    ServerOptions options;
    change(&options);
    const absl::Status status = options.Validate();
    EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument) << field;
    EXPECT_EQ(std::string(status.message()).rfind(field, 0), 0u) << status;
  }
}

}  // namespace
}  // namespace rilievo
