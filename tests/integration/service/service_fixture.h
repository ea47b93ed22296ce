// A server on a real socket whose work is a fake that the test controls.
#pragma once

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "google/rpc/error_details.pb.h"
#include "google/rpc/status.pb.h"
#include "grpcpp/grpcpp.h"
#include "rilievo/v1/reconstruction.grpc.pb.h"
#include "server/reconstruction_server.h"
#include "server/worker/job_work.h"

namespace rilievo {

// Work that waits until it is released or stopped, then answers with a surface of known bytes.
class FakeWork {
 public:
  ReconstructFunction Function();

  void Release();  // everything that waits, and all that comes later
  // Whether `count` jobs have begun in time.
  bool WaitForBegun(int count, std::chrono::milliseconds timeout = std::chrono::seconds(10));
  bool WaitForStopped(int count, std::chrono::milliseconds timeout = std::chrono::seconds(10));

  int begun() const { return begun_; }
  int stopped() const { return stopped_; }
  int64_t last_point_count() const { return last_points_; }
  Eigen::Matrix3Xi last_triangles();

  // Set before the first job.
  std::vector<size_t> chunk_sizes = {1000, 300'000, 0, 77};
  std::function<void(const RunContext&)> before_wait;  // on the job's thread
  std::optional<absl::Status> answer;                  // instead of a surface
  bool wait = false;                                   // else ends at once

  // The .dss bytes of every answer.
  EncodedSurface Encoded() const;

 private:
  absl::StatusOr<Reconstruction> Run(const PointCloud& scan, const RunContext& context);

  std::mutex mutex_;
  std::condition_variable_any changed_;
  bool released_ = false;
  std::atomic<int> begun_{0}, stopped_{0};
  std::atomic<int64_t> last_points_{0};
  Eigen::Matrix3Xi last_triangles_;
};

// The server's side of one test.
class ServiceTest : public testing::Test {
 protected:
  // Fills in the address; options.listen is not used.
  void StartServer(ServerOptions options = {});

  std::unique_ptr<v1::ReconstructionService::Stub> NewStub() const;
  std::shared_ptr<grpc::Channel> NewChannel() const;

  // Whether `count` calls have ended in time.
  bool WaitForLogged(size_t count, std::chrono::milliseconds timeout);

  FakeWork work_;
  std::vector<JobRecord> log_;
  std::mutex log_mutex_;
  std::condition_variable logged_;
  std::unique_ptr<ReconstructionServer> server_;
};

using RawStream = grpc::ClientReaderWriter<v1::ReconstructRequest, v1::ReconstructResponse>;

v1::ReconstructRequest HeaderRequest(uint64_t point_count);  // float32
v1::ReconstructRequest PointsRequest(int64_t points);        // zeros
v1::ReconstructRequest TrianglesRequest(int64_t triangles);  // of the vertices 0, 1 and 2

// Header, all points, half-close.
void SendWholeScan(RawStream* stream, int64_t points);

// Reads to the end; the status and what came before it.
struct Outcome {
  grpc::Status status;
  std::vector<v1::ReconstructResponse> responses;
};
Outcome ReadToEnd(RawStream* stream);

// Details of an error.
std::vector<std::string> ViolatedFields(const grpc::Status& status);
std::string Reason(const grpc::Status& status);
std::optional<google::rpc::RetryInfo> RetryInfoOf(const grpc::Status& status);

// Seconds since `start`.
double SecondsSince(std::chrono::steady_clock::time_point start);

}  // namespace rilievo
