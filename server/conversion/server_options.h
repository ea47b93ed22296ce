// What an operator can set.
#pragma once

#include <chrono>
#include <cstdint>
#include <string>

#include "absl/status/status.h"
#include "core/pipeline/reconstruct.h"

namespace rilievo {

// One message on the wire, at most: the header with a control mesh of kMaxControlFaces fits.
inline constexpr int kMaxMessageBytes = 4 << 20;
inline constexpr int64_t kMaxChunkBytes = 1 << 20;
inline constexpr int kMaxControlFaces = 100000;

// A job's memory grows with its points and with the faces of its surface (EstimateMemory). The
// defaults keep one job within some 3.5 GB.
struct ServerOptions {
  // "host:port"; port 0: any free one; or "unix:PATH".
  std::string listen = "127.0.0.1:50051";
  int64_t max_points = 5'000'000;          // of one scan, >= 20
  int64_t max_scan_bytes = 205'000'000;    // of one scan or mesh on the wire. > 0
  int64_t max_surface_faces = 16'000'000;  // control faces times 4^max_level, > 0
  int max_concurrent_jobs = 2;             // worked on at a time, [1, 1024]
  int max_queued_jobs = 8;                 // admitted beside them, uploading or waiting, [0, 65536]
  int threads = 0;                         // a job gets at most; 0: all hardware threads. [0, 1024]
  // That one job's worker process may map beyond the program itself, bytes; 0: no limit. >= 0
  int64_t max_job_memory = 6'000'000'000;
  // That the running jobs may need together, by estimate, bytes; 0: 80 % of the machine's or the
  // container's. >= 0
  int64_t memory_budget = 0;
  // A folder for the files of scans that need more memory than a job may take: they are made by
  // parts. Empty: they are refused.
  std::string scratch;
  int64_t part_points = PartSizes{}.part_points;    // of such a part. [2048, 2^28]
  std::chrono::milliseconds max_job_time{600'000};  // of work, > 0
  std::chrono::milliseconds max_idle_time{60'000};  // between two messages that are due, > 0
  std::chrono::milliseconds drain_time{30'000};     // running jobs get at shutdown, >= 0
  // Where jobs are kept: a folder, or a postgres:// URL where many servers and workers share one
  // store; empty: nowhere, and nothing of a client outlives its call.
  std::string store;
  std::string blobs;        // of a shared store: pg:, file:FOLDER or s3:...; empty: pg:
  bool serve_only = false;  // of a shared store: kept jobs are left to others
  std::chrono::milliseconds keep_time{7 * 24 * 3'600'000LL};  // finished jobs, unused scans, > 0
  int64_t keep_bytes = 20'000'000'000;                        // of all that the store holds, > 0
  // Of them of one owner; 0: half of keep_bytes where callers have names, else all of it. >= 0
  int64_t owner_bytes = 0;
  int max_waiting_jobs = 1000;  // kept jobs that are not finished, [1, 1000000]
  // File of the tokens that callers must have, see server/auth/access_tokens.h; empty: none.
  std::string tokens;
  // PEM files: the server's certificate and its key, empty for plaintext; and the authorities whose
  // certificates callers must have, empty when they need none.
  std::string tls_certificate, tls_key, tls_client_ca;
  bool allow_plaintext = false;  // though other machines reach `listen`
  bool ephemeral =
      false;  // without `store`: keep jobs in a temporary folder that ends with the server
  int max_calls = 1024;  // streams under way, all clients together, [1, 1000000]
  int max_uploads = 64;  // of them UploadScan, [1, 1000000]
  // Resident memory of the server itself, without workers and the points of one-call jobs; above it
  // the connections that cost most are closed. Bytes; 0: the default. >= 0
  int64_t max_server_memory = 512'000'000;
  int max_connections = 1024;         // open at a time, [1, 1000000]
  int max_address_connections = 256;  // of them of one address, [1, 1000000]
  int max_connection_streams = 128;   // calls under way on one connection, [1, 100000]
  // A connection that is silent for so long is asked whether its peer lives, and closed without an
  // answer. Both > 0.
  std::chrono::milliseconds keepalive_time{20'000};
  std::chrono::milliseconds keepalive_timeout{10'000};
  // Health is NOT_SERVING once threads of the server have had work and not moved for so long, > 0.
  std::chrono::milliseconds stuck_time{30'000};
  bool reflection = true;

  // INVALID_ARGUMENT that names the field.
  absl::Status Validate() const;

  // Of one mesh; a closed one has about two for each vertex.
  int64_t MaxTriangles() const;

  // `threads`, or what the machine has.
  int ThreadLimit() const;

  // `owner_bytes`, or what follows from the others.
  int64_t OwnerBytes() const;

  // `memory_budget`, or what follows from the machine.
  int64_t MemoryBudget() const;

  // That one job may need, by estimate: all of the budget; where larger ones are made by parts, no
  // more than its process may map.
  int64_t MemoryOfJob() const;
};

}  // namespace rilievo
