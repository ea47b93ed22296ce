// What stands around the service: capabilities, health, reflection, compression, ports.
#include "server/reconstruction_server.h"

#include <fcntl.h>

#include <fstream>
#include <future>
#include <thread>

#include "google/protobuf/dynamic_message.h"
#include "grpc/health/v1/health.grpc.pb.h"
#include "grpcpp/generic/generic_stub.h"
#include "server/health_probe.h"
#include "server/reconstruction_service.h"
#include "tests/integration/service/service_fixture.h"

namespace rilievo {
namespace {

using grpc::StatusCode;
using std::chrono::milliseconds;
using testing::Contains;
using testing::Not;

// The most resident memory that this process has had.
int64_t PeakBytes() {
  std::ifstream status("/proc/self/status");
  for (std::string line; std::getline(status, line);) {
    if (line.rfind("VmHWM:", 0) == 0) return std::stoll(line.substr(6)) * 1024;
  }
  return 0;
}

class ReconstructionServerTest : public ServiceTest {
 protected:
  // The names that the reflection service lists.
  std::vector<std::string> ReflectedServices(grpc::Status* status);
};

TEST_F(ReconstructionServerTest, CapabilitiesAreTheLimits) {
  ServerOptions options;
  options.max_points = 12345;
  options.max_scan_bytes = 67890;
  options.max_surface_faces = 1111;
  options.max_concurrent_jobs = 3;
  options.max_queued_jobs = 5;
  options.threads = 7;
  options.max_job_time = milliseconds(1500);
  options.max_idle_time = milliseconds(2500);
  StartServer(options);
  grpc::ClientContext context;
  v1::GetCapabilitiesResponse response;
  ASSERT_TRUE(NewStub()->GetCapabilities(&context, {}, &response).ok());
  EXPECT_EQ(response.server_version(), RILIEVO_VERSION);
  EXPECT_EQ(response.limits().max_points(), 12345u);
  EXPECT_EQ(response.limits().max_triangles(), 24690u);
  EXPECT_EQ(response.limits().max_scan_bytes(), 67890u);
  EXPECT_EQ(response.limits().max_message_bytes(), 4u << 20);
  EXPECT_EQ(response.limits().max_chunk_bytes(), 1u << 20);
  EXPECT_EQ(response.limits().max_control_faces(), 100000u);
  EXPECT_EQ(response.limits().max_surface_faces(), 1111u);
  EXPECT_EQ(response.limits().max_concurrent_jobs(), 3u);
  EXPECT_EQ(response.limits().max_queued_jobs(), 5u);
  EXPECT_EQ(response.limits().max_threads(), 7u);
  EXPECT_EQ(response.limits().max_job_seconds(), 1.5);
  EXPECT_EQ(response.limits().max_idle_seconds(), 2.5);
  EXPECT_EQ(response.coordinate_formats_size(), 2);
  EXPECT_EQ(response.topologies_size(), 5);
}

TEST_F(ReconstructionServerTest, HealthServesUntilTheDrain) {
  StartServer();
  const auto stub = grpc::health::v1::Health::NewStub(NewChannel());
  const auto check = [&](const std::string& service) {
    grpc::ClientContext context;
    grpc::health::v1::HealthCheckRequest request;
    request.set_service(service);
    grpc::health::v1::HealthCheckResponse response;
    const grpc::Status status = stub->Check(&context, request, &response);
    return status.ok()
               ? grpc::health::v1::HealthCheckResponse::ServingStatus_Name(response.status())
               : status.error_message();
  };
  EXPECT_EQ(check(""), "SERVING");
  EXPECT_EQ(check("rilievo.v1.ReconstructionService"), "SERVING");
  EXPECT_TRUE(ProbeHealth(server_->address(), milliseconds(5000)).ok());
  server_->BeginDrain();
  EXPECT_EQ(check(""), "NOT_SERVING");
  EXPECT_EQ(check("rilievo.v1.ReconstructionService"), "NOT_SERVING");
  EXPECT_EQ(check("alive"), "SERVING") << "who drains is not started again";
  EXPECT_EQ(ProbeHealth(server_->address(), milliseconds(5000)).code(),
            absl::StatusCode::kUnavailable);
}

TEST_F(ReconstructionServerTest, TheProbeSeesThatNobodyListens) {
  StartServer();
  const std::string address = server_->address();
  server_.reset();
  EXPECT_EQ(ProbeHealth(address, milliseconds(2000)).code(), absl::StatusCode::kUnavailable);
}

std::vector<std::string> ReconstructionServerTest::ReflectedServices(grpc::Status* status) {
  // The messages come from the reflection library itself: Debian has no generated code for them.
  const auto* pool = google::protobuf::DescriptorPool::generated_pool();
  const auto* request_type =
      pool->FindMessageTypeByName("grpc.reflection.v1alpha.ServerReflectionRequest");
  const auto* response_type =
      pool->FindMessageTypeByName("grpc.reflection.v1alpha.ServerReflectionResponse");
  EXPECT_NE(request_type, nullptr);
  EXPECT_NE(response_type, nullptr);
  google::protobuf::DynamicMessageFactory factory;
  const std::unique_ptr<google::protobuf::Message> request(
      factory.GetPrototype(request_type)->New());
  const std::unique_ptr<google::protobuf::Message> response(
      factory.GetPrototype(response_type)->New());
  request->GetReflection()->SetString(request.get(), request_type->FindFieldByName("list_services"),
                                      "*");

  grpc::TemplatedGenericStub<google::protobuf::Message, google::protobuf::Message> stub(
      NewChannel());
  grpc::ClientContext context;
  grpc::CompletionQueue queue;
  const auto next = [&queue] {
    void* tag;
    bool ok = false;
    return queue.Next(&tag, &ok) && ok;
  };
  const auto stream = stub.PrepareCall(
      &context, "/grpc.reflection.v1alpha.ServerReflection/ServerReflectionInfo", &queue);
  stream->StartCall(nullptr);
  EXPECT_TRUE(next());
  stream->Write(*request, nullptr);
  next();
  stream->Read(response.get(), nullptr);
  std::vector<std::string> names;
  if (next()) {
    const auto* list = response_type->FindFieldByName("list_services_response");
    const auto& services = response->GetReflection()->GetMessage(*response, list);
    const auto* field = services.GetDescriptor()->FindFieldByName("service");
    for (int i = 0; i < services.GetReflection()->FieldSize(services, field); ++i) {
      const auto& service = services.GetReflection()->GetRepeatedMessage(services, field, i);
      names.push_back(service.GetReflection()->GetString(
          service, service.GetDescriptor()->FindFieldByName("name")));
    }
    stream->WritesDone(nullptr);
    next();
  }
  stream->Finish(status, nullptr);
  next();
  return names;
}

TEST_F(ReconstructionServerTest, ReflectionListsTheServices) {
  StartServer();
  grpc::Status status;
  const auto names = ReflectedServices(&status);
  EXPECT_TRUE(status.ok()) << status.error_message();
  EXPECT_THAT(names, Contains("rilievo.v1.ReconstructionService"));
  EXPECT_THAT(names, Contains("grpc.health.v1.Health"));
}

TEST_F(ReconstructionServerTest, CompressedMessagesAreRefusedInBothCalls) {
  StartServer();
  const auto stub = NewStub();
  for (const auto algorithm : {GRPC_COMPRESS_GZIP, GRPC_COMPRESS_DEFLATE}) {
    grpc::ClientContext context;
    context.set_compression_algorithm(algorithm);
    const auto stream = stub->Reconstruct(&context);
    SendWholeScan(stream.get(), 50'000);
    const Outcome outcome = ReadToEnd(stream.get());
    EXPECT_EQ(outcome.status.error_code(), StatusCode::UNIMPLEMENTED)
        << outcome.status.error_message();

    grpc::ClientContext unary_context;
    unary_context.set_compression_algorithm(algorithm);
    v1::GetCapabilitiesResponse response;
    EXPECT_EQ(stub->GetCapabilities(&unary_context, {}, &response).error_code(),
              StatusCode::UNIMPLEMENTED);
  }
  EXPECT_EQ(work_.begun(), 0);
}

// gRPC would put it together before it looks at its length.
TEST_F(ReconstructionServerTest, AMessageOfAGigabyteIsRefusedBeforeItIsThere) {
  StartServer();
  const grpc::Slice block(std::string(1 << 20, '\0'));
  const std::vector<grpc::Slice> blocks(1024, block);
  const grpc::ByteBuffer message(blocks.data(), blocks.size());
  const int64_t before = PeakBytes();
  grpc::GenericStub stub(NewChannel());
  grpc::ClientContext context;
  grpc::ByteBuffer answer;
  std::promise<grpc::Status> ended;
  stub.UnaryCall(&context, "/rilievo.v1.ReconstructionService/GetCapabilities", grpc::StubOptions(),
                 &message, &answer, [&](const grpc::Status& status) { ended.set_value(status); });
  EXPECT_EQ(ended.get_future().get().error_code(), StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_LT(PeakBytes() - before, 100'000'000) << "both ends are in this process";
  v1::GetCapabilitiesResponse response;
  grpc::ClientContext next;
  EXPECT_TRUE(NewStub()->GetCapabilities(&next, {}, &response).ok());
}

TEST_F(ReconstructionServerTest, TwoServersNeverShareAPort) {
  StartServer();
  ServerOptions options;
  options.listen = server_->address();
  const auto second = ReconstructionServer::Listen(options, InThisProcess(work_.Function()), {});
  EXPECT_EQ(second.status().code(), absl::StatusCode::kUnavailable);
}

TEST_F(ReconstructionServerTest, WrongOptionsAreTold) {
  ServerOptions options;
  options.max_concurrent_jobs = 0;
  EXPECT_EQ(
      ReconstructionServer::Listen(options, InThisProcess(work_.Function()), {}).status().code(),
      absl::StatusCode::kInvalidArgument);
  options = {};
  options.listen = "no address";
  EXPECT_EQ(
      ReconstructionServer::Listen(options, InThisProcess(work_.Function()), {}).status().code(),
      absl::StatusCode::kInvalidArgument);
  options.listen = "no.such.host.invalid:50051";
  options.allow_plaintext = true;
  EXPECT_EQ(
      ReconstructionServer::Listen(options, InThisProcess(work_.Function()), {}).status().code(),
      absl::StatusCode::kUnavailable);
}

}  // namespace
}  // namespace rilievo
