// The client of rilievo.v1.JobsService: reconstructions that outlive the connection.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "client/library/reconstruction_client.h"
#include "client/library/retry.h"
#include "core/geometry/point_cloud.h"
#include "rilievo/v1/jobs.grpc.pb.h"
#include "rilievo/v1/jobs.pb.h"

namespace rilievo {

// A scan as it travels and is stored.
struct PackedScan {
  v1::ReconstructHeader header;  // without options
  std::string bytes;
  std::string scan_id;  // SHA-256 of the bytes, hexadecimal
};

// With its sights, of a mesh with its triangles; coordinates as float32 when that loses nothing,
// else as float64.
PackedScan PackScan(const PointCloud& scan);

// Its points, then the file of the surface that a job with this header brings up to date.
PackedScan PackUpdate(const PointCloud& scan, const UpdatedSurface& base);

// Every function repeats its call after a pause while the server is away or asks for it, and goes
// on where a broken stream ended: none does its work twice. Of several servers over one store it
// goes on at the next one. `call.timeout` is of all attempts together. Status codes are those of
// jobs.proto. Many threads may call at the same time.
class JobsClient {
 public:
  explicit JobsClient(const std::shared_ptr<grpc::ChannelInterface>& channel,
                      RetryOptions retry = {});
  // To several servers over one store (ConnectToEach()); at least one.
  explicit JobsClient(const std::vector<std::shared_ptr<grpc::ChannelInterface>>& channels,
                      RetryOptions retry = {});

  // Uploads what the server does not have, and creates the job. The same `request_id` (1 to 64
  // letters, digits, '-' and '_') gives the same job, however often and from wherever it is called.
  // `sent`: bytes that the server has stored or is about to.
  absl::StatusOr<v1::Job> Submit(const PackedScan& scan, const v1::ReconstructOptions& options,
                                 const std::string& request_id,
                                 const std::function<void(int64_t)>& sent = {},
                                 const CallOptions& call = {}) const;

  // Until the server has the whole scan.
  absl::Status Upload(const PackedScan& scan, const std::function<void(int64_t)>& sent = {},
                      const CallOptions& call = {}) const;

  absl::StatusOr<v1::Job> Create(const v1::CreateJobRequest& request,
                                 const CallOptions& call = {}) const;
  absl::StatusOr<v1::Job> Get(const std::string& job_id, const CallOptions& call = {}) const;

  // All jobs, newest first, at most `limit`.
  absl::StatusOr<std::vector<v1::Job>> List(size_t limit, const CallOptions& call = {}) const;

  // Calls `event` on this thread until the job is finished, and returns it.
  absl::StatusOr<v1::Job> Watch(const std::string& job_id,
                                const std::function<void(const v1::JobEvent&)>& event = {},
                                const CallOptions& call = {}) const;

  // The whole .dss file of a job that succeeded; `piece` as it arrives. `known`: the beginning of
  // the file, which is not fetched; DATA_LOSS when it is not that.
  absl::StatusOr<std::vector<uint8_t>> Fetch(
      const std::string& job_id, const std::function<void(const v1::SurfacePiece&)>& piece = {},
      const CallOptions& call = {}, std::vector<uint8_t> known = {}) const;

  absl::StatusOr<v1::Job> Cancel(const std::string& job_id, const CallOptions& call = {}) const;

  // OK also when a repeated call found the job gone.
  absl::Status Delete(const std::string& job_id, const CallOptions& call = {}) const;

  // Of a scan that was uploaded; OK also when a repeated call found it gone.
  absl::Status DeleteScan(const std::string& scan_id, const CallOptions& call = {}) const;

 private:
  struct Attempts;

  absl::Status UploadOnce(const PackedScan& scan, uint64_t offset,
                          const std::function<void(int64_t)>& sent, Attempts* attempts) const;

  // While another stream of the same upload makes progress.
  absl::Status WaitForOther(const PackedScan& scan, Attempts* attempts) const;

  // After a call to `server` failed: those that follow go to the next one.
  void MoveOn(size_t server) const;

  std::vector<std::unique_ptr<v1::JobsService::StubInterface>> stubs_;
  std::unique_ptr<std::atomic<size_t>> server_;  // that calls go to
  RetryOptions retry_;
};

}  // namespace rilievo
