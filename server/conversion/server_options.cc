#include "server/conversion/server_options.h"

#include <algorithm>
#include <limits>
#include <thread>

#include "absl/strings/str_cat.h"
#include "server/os/memory_limit.h"

namespace rilievo {
namespace {

absl::Status Outside(const char* field, int64_t value, const char* range) {
  return absl::InvalidArgumentError(absl::StrCat(field, " is ", value, "; it must lie in ", range));
}

}  // namespace

absl::Status ServerOptions::Validate() const {
  if (listen.empty()) return absl::InvalidArgumentError("listen is empty; give HOST:PORT");
  if (max_points < 20) return Outside("max_points", max_points, "[20, inf)");
  if (max_scan_bytes <= 0) return Outside("max_scan_bytes", max_scan_bytes, "[1, inf)");
  if (max_surface_faces <= 0) return Outside("max_surface_faces", max_surface_faces, "[1, inf)");
  if (max_concurrent_jobs < 1 || max_concurrent_jobs > 1024) {
    return Outside("max_concurrent_jobs", max_concurrent_jobs, "[1, 1024]");
  }
  if (max_queued_jobs < 0 || max_queued_jobs > 65536) {
    return Outside("max_queued_jobs", max_queued_jobs, "[0, 65536]");
  }
  if (threads < 0 || threads > 1024) return Outside("threads", threads, "[0, 1024]");
  if (max_job_memory < 0) return Outside("max_job_memory", max_job_memory, "[0, inf)");
  if (memory_budget < 0) return Outside("memory_budget", memory_budget, "[0, inf)");
  if (part_points < 2048 || part_points > int64_t{1} << 28) {
    return Outside("part_points", part_points, "[2048, 268435456]");
  }
  if (max_job_time.count() <= 0)
    return Outside("max_job_time", max_job_time.count(), "[1, inf) ms");
  if (max_idle_time.count() <= 0) {
    return Outside("max_idle_time", max_idle_time.count(), "[1, inf) ms");
  }
  if (drain_time.count() < 0) return Outside("drain_time", drain_time.count(), "[0, inf) ms");
  if (keep_time.count() <= 0) return Outside("keep_time", keep_time.count(), "[1, inf) ms");
  if (keep_bytes <= 0) return Outside("keep_bytes", keep_bytes, "[1, inf)");
  if (owner_bytes < 0) return Outside("owner_bytes", owner_bytes, "[0, inf)");
  if (max_waiting_jobs < 1 || max_waiting_jobs > 1'000'000) {
    return Outside("max_waiting_jobs", max_waiting_jobs, "[1, 1000000]");
  }
  if (max_calls < 1 || max_calls > 1'000'000) {
    return Outside("max_calls", max_calls, "[1, 1000000]");
  }
  if (max_uploads < 1 || max_uploads > 1'000'000) {
    return Outside("max_uploads", max_uploads, "[1, 1000000]");
  }
  if (max_server_memory < 0) return Outside("max_server_memory", max_server_memory, "[0, inf)");
  if (max_connections < 1 || max_connections > 1'000'000) {
    return Outside("max_connections", max_connections, "[1, 1000000]");
  }
  if (max_address_connections < 1 || max_address_connections > 1'000'000) {
    return Outside("max_address_connections", max_address_connections, "[1, 1000000]");
  }
  if (max_connection_streams < 1 || max_connection_streams > 100'000) {
    return Outside("max_connection_streams", max_connection_streams, "[1, 100000]");
  }
  if (keepalive_time.count() < 1 || keepalive_time.count() > 86'400'000) {
    return Outside("keepalive_time", keepalive_time.count(), "[1, 86400000] ms");
  }
  if (keepalive_timeout.count() < 1 || keepalive_timeout.count() > 86'400'000) {
    return Outside("keepalive_timeout", keepalive_timeout.count(), "[1, 86400000] ms");
  }
  return absl::OkStatus();
}

int64_t ServerOptions::MaxTriangles() const {
  return 2 * std::min<int64_t>(max_points, std::numeric_limits<int32_t>::max() / 2);
}

int ServerOptions::ThreadLimit() const {
  if (threads > 0) return threads;
  return std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
}

int64_t ServerOptions::OwnerBytes() const {
  if (owner_bytes > 0) return owner_bytes;
  const bool named = !tokens.empty() || !tls_client_ca.empty();
  return named ? keep_bytes / 2 : keep_bytes;
}

int64_t ServerOptions::MemoryBudget() const {
  return memory_budget > 0 ? memory_budget : MemoryForThisProcess() / 10 * 8;
}

int64_t ServerOptions::MemoryOfJob() const {
  if (scratch.empty() || max_job_memory == 0) return MemoryBudget();
  return std::min(MemoryBudget(), max_job_memory);
}

}  // namespace rilievo
