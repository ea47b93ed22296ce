#include "tests/integration/service/service_fixture.h"

#include <utility>

namespace rilievo {
namespace {

template <typename Detail>
std::optional<Detail> FindDetail(const grpc::Status& status) {
  google::rpc::Status details;
  EXPECT_TRUE(details.ParseFromString(status.error_details()));
  for (const auto& any : details.details()) {
    Detail detail;
    if (any.UnpackTo(&detail)) return detail;
  }
  return std::nullopt;
}

}  // namespace

ReconstructFunction FakeWork::Function() {
  return [this](const PointCloud& scan, const ReconstructOptions&, const RunContext& context) {
    return Run(scan, context);
  };
}

absl::StatusOr<Reconstruction> FakeWork::Run(const PointCloud& scan, const RunContext& context) {
  last_points_ = scan.points.cols();
  context.Report(Stage::kCheck, 0);
  context.Report(Stage::kCheck, 1);
  context.Report(Stage::kEncode, 0.5);
  {
    const std::lock_guard lock(mutex_);
    ++begun_;
    last_triangles_ = scan.triangles;
    changed_.notify_all();
  }
  if (before_wait) before_wait(context);
  if (wait) {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, context.stop, [this] { return released_; });
    if (context.stop.stop_requested()) {
      ++stopped_;
      changed_.notify_all();
      return context.CheckStop();
    }
  }
  if (answer) return *answer;
  Reconstruction result;
  result.encoded = Encoded();
  result.report.points_in = scan.points.cols();
  result.report.topology = "spherical";
  return result;
}

EncodedSurface FakeWork::Encoded() const {
  EncodedSurface encoded;
  uint32_t state = 7;
  for (const size_t size : chunk_sizes) {
    std::vector<uint8_t> chunk(size);
    for (uint8_t& byte : chunk) byte = static_cast<uint8_t>((state = state * 1664525 + 1) >> 24);
    encoded.chunks.push_back(std::move(chunk));
  }
  return encoded;
}

Eigen::Matrix3Xi FakeWork::last_triangles() {
  const std::lock_guard lock(mutex_);
  return last_triangles_;
}

void FakeWork::Release() {
  const std::lock_guard lock(mutex_);
  released_ = true;
  changed_.notify_all();
}

bool FakeWork::WaitForBegun(int count, std::chrono::milliseconds timeout) {
  std::unique_lock lock(mutex_);
  return changed_.wait_for(lock, timeout, [&] { return begun_ >= count; });
}

bool FakeWork::WaitForStopped(int count, std::chrono::milliseconds timeout) {
  std::unique_lock lock(mutex_);
  return changed_.wait_for(lock, timeout, [&] { return stopped_ >= count; });
}

void ServiceTest::StartServer(ServerOptions options) {
  options.listen = "127.0.0.1:0";
  auto server = ReconstructionServer::Listen(options, InThisProcess(work_.Function()),
                                             [this](const JobRecord& record) {
                                               const std::lock_guard lock(log_mutex_);
                                               log_.push_back(record);
                                               logged_.notify_all();
                                             });
  ASSERT_TRUE(server.ok()) << server.status();
  server_ = *std::move(server);
}

std::shared_ptr<grpc::Channel> ServiceTest::NewChannel() const {
  grpc::ChannelArguments arguments;
  arguments.SetInt(GRPC_ARG_ENABLE_HTTP_PROXY, 0);
  arguments.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);  // a connection of its own
  return grpc::CreateCustomChannel(server_->address(), grpc::InsecureChannelCredentials(),
                                   arguments);
}

bool ServiceTest::WaitForLogged(size_t count, std::chrono::milliseconds timeout) {
  std::unique_lock lock(log_mutex_);
  return logged_.wait_for(lock, timeout, [&] { return log_.size() >= count; });
}

std::unique_ptr<v1::ReconstructionService::Stub> ServiceTest::NewStub() const {
  return v1::ReconstructionService::NewStub(NewChannel());
}

v1::ReconstructRequest HeaderRequest(uint64_t point_count) {
  v1::ReconstructRequest request;
  request.mutable_header()->set_point_count(point_count);
  request.mutable_header()->set_coordinate_format(v1::COORDINATE_FORMAT_FLOAT32_LE);
  return request;
}

v1::ReconstructRequest PointsRequest(int64_t points) {
  v1::ReconstructRequest request;
  request.mutable_points()->set_data(std::string(static_cast<size_t>(12 * points), '\0'));
  return request;
}

v1::ReconstructRequest TrianglesRequest(int64_t triangles) {
  v1::ReconstructRequest request;
  for (int64_t i = 0; i < triangles; ++i) {
    request.mutable_triangles()->mutable_data()->append("\0\0\0\0\1\0\0\0\2\0\0\0", 12);
  }
  return request;
}

void SendWholeScan(RawStream* stream, int64_t points) {
  stream->Write(HeaderRequest(static_cast<uint64_t>(points)));
  stream->Write(PointsRequest(points));
  stream->WritesDone();
}

Outcome ReadToEnd(RawStream* stream) {
  Outcome outcome;
  v1::ReconstructResponse response;
  while (stream->Read(&response)) outcome.responses.push_back(response);
  outcome.status = stream->Finish();
  return outcome;
}

std::vector<std::string> ViolatedFields(const grpc::Status& status) {
  std::vector<std::string> fields;
  if (const auto bad = FindDetail<google::rpc::BadRequest>(status)) {
    for (const auto& violation : bad->field_violations()) fields.push_back(violation.field());
  }
  return fields;
}

std::string Reason(const grpc::Status& status) {
  const auto info = FindDetail<google::rpc::ErrorInfo>(status);
  return info ? info->reason() : "";
}

std::optional<google::rpc::RetryInfo> RetryInfoOf(const grpc::Status& status) {
  return FindDetail<google::rpc::RetryInfo>(status);
}

double SecondsSince(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

}  // namespace rilievo
