// The client of rilievo.v1.ReconstructionService.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "client/library/connect.h"
#include "client/library/point_packing.h"
#include "core/geometry/point_cloud.h"
#include "rilievo/v1/options.pb.h"
#include "rilievo/v1/reconstruction.grpc.pb.h"
#include "rilievo/v1/reconstruction.pb.h"
#include "rilievo/v1/report.pb.h"

namespace rilievo {

// Called on the thread that called Reconstruct, while points may still be on their way.
struct ReconstructCallbacks {
  std::function<void(const v1::Progress&)> progress;
  // Points handed to the transport so far; called on the writing thread.
  std::function<void(int64_t points_sent)> sent;
  std::function<void(const v1::SurfaceHeader&)> surface;
  // Bytes of the .dss in order; the prefix up to the end of a chunk can be decoded at once.
  std::function<void(const v1::SurfacePiece&)> piece;
};

struct CallOptions {
  std::optional<std::chrono::milliseconds> timeout;  // of the whole call; unset: none
  std::stop_token stop;                              // cancels the call
};

struct ReconstructResult {
  std::vector<uint8_t> dss;          // the whole .dss file
  std::vector<int64_t> chunk_bytes;  // of each chunk of it: control mesh, then one a level
  v1::ReconstructReport report;
};

class ReconstructionClient {
 public:
  using Stream = grpc::ClientReaderWriterInterface<v1::ReconstructRequest, v1::ReconstructResponse>;

  explicit ReconstructionClient(const std::shared_ptr<grpc::ChannelInterface>& channel);

  // Sends the points with their sights (coordinates as float32 when that loses nothing, else as
  // float64), then the triangles of a mesh, and blocks until the surface is here. Status codes are
  // those of the proto's comment; the message holds each field violation as "field: description",
  // and RetryDelay() reads the retry time. DATA_LOSS also when the answer is not whole. Many
  // threads may call at the same time.
  absl::StatusOr<ReconstructResult> Reconstruct(const PointCloud& scan,
                                                const v1::ReconstructOptions& options,
                                                const ReconstructCallbacks& callbacks = {},
                                                const CallOptions& call = {}) const;
  // The same; the scan's memory goes as soon as its points have been sent.
  absl::StatusOr<ReconstructResult> Reconstruct(PointCloud&& scan,
                                                const v1::ReconstructOptions& options,
                                                const ReconstructCallbacks& callbacks = {},
                                                const CallOptions& call = {}) const;

  // Sends the points, then the surface, whose file comes back brought up to date; only what is new
  // of it travels, and callbacks.piece gets that alone. Else as Reconstruct().
  absl::StatusOr<ReconstructResult> Update(const PointCloud& scan, const UpdatedSurface& base,
                                           const ReconstructCallbacks& callbacks = {},
                                           const CallOptions& call = {}) const;

  absl::StatusOr<v1::GetCapabilitiesResponse> GetCapabilities(const CallOptions& call = {}) const;

 private:
  // `known`: of the surface, which the server does not send.
  absl::StatusOr<ReconstructResult> Call(const std::function<void(Stream*)>& send,
                                         std::vector<uint8_t> known,
                                         const ReconstructCallbacks& callbacks,
                                         const CallOptions& call) const;

  std::unique_ptr<v1::ReconstructionService::StubInterface> stub_;
};

}  // namespace rilievo
