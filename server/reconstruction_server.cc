#include "server/reconstruction_server.h"

#include <string_view>
#include <utility>
#include <vector>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "grpcpp/channel.h"
#include "grpcpp/ext/proto_server_reflection_plugin.h"
#include "grpcpp/health_check_service_interface.h"
#include "grpcpp/impl/server_builder_option.h"
#include "grpcpp/impl/server_builder_plugin.h"
#include "grpcpp/resource_quota.h"
#include "grpcpp/security/server_credentials.h"
#include "grpcpp/server.h"
#include "grpcpp/server_builder.h"
#include "proto/keep_grpc_running.h"
#include "server/auth/server_credentials.h"
#include "server/jobs/jobs_service.h"
#include "server/observability/server_metrics.h"
#include "server/os/unnamed_file.h"
#include "server/reconstruction_service.h"
#include "server/rpc/call_auditor.h"
#include "server/rpc/grpc_status.h"
#include "server/store/temporary_folder.h"

namespace rilievo {
namespace {

// After the calls were told to stop; stages answer within a second.
constexpr std::chrono::seconds kStopTime{3};
// For short requests to be answered, also by a disk or a database that is busy; what is left then
// is cancelled. Clients close idle connections when they are told; some never do.
constexpr std::chrono::seconds kLingerTime{2};
// That bytes on their way in may take, of all connections together. gRPC puts a message of any
// length together before it compares it with its limit; over this it cancels streams instead, with
// RESOURCE_EXHAUSTED. 64 uploads at full speed stay below.
constexpr size_t kTransportBytes = 24 << 20;
// Beside the streams of --max-calls: calls that are answered at once may be under way.
constexpr int kShortCalls = 1024;

// gRPC's clients take an answer in HTTP/1.1 for a connection that failed, and come back after
// growing pauses.
constexpr std::string_view kTooManyConnections =
    "HTTP/1.1 503 Service Unavailable\r\nRetry-After: 2\r\nConnection: close\r\n"
    "Content-Type: text/plain\r\nContent-Length: 60\r\n\r\n"
    "as many connections as this server takes are open; try again";

// A gzip bomb must not be inflated. Disabling the algorithms makes gRPC refuse the call when its
// headers name one; without the decompression filter nothing inflates a message before that check,
// nor one that slips past it.
void RefuseCompression(grpc::ServerBuilder* builder) {
  builder->AddChannelArgument(GRPC_ARG_ENABLE_PER_MESSAGE_DECOMPRESSION, 0);
  builder->SetCompressionAlgorithmSupportStatus(GRPC_COMPRESS_GZIP, false);
  builder->SetCompressionAlgorithmSupportStatus(GRPC_COMPRESS_DEFLATE, false);
}

// gRPC's reflection adds itself to every server of a program that is linked with it.
class WithoutReflection final : public grpc::ServerBuilderOption {
 public:
  void UpdateArguments(grpc::ChannelArguments* /*arguments*/) override {}
  void UpdatePlugins(std::vector<std::unique_ptr<grpc::ServerBuilderPlugin>>* plugins) override {
    std::erase_if(*plugins,
                  [](const auto& plugin) { return plugin->name() == "proto_server_reflection"; });
  }
};

void GuardConnections(const ServerOptions& options, grpc::ServerBuilder* builder) {
  builder->AddChannelArgument(GRPC_ARG_ENABLE_CHANNELZ, 1);  // ConnectionWatch asks it
  builder->SetResourceQuota(grpc::ResourceQuota("rilievod").Resize(kTransportBytes));
  builder->AddChannelArgument(GRPC_ARG_MAX_CONCURRENT_STREAMS, options.max_connection_streams);
  // A peer that vanished is noticed after both times, with or without a call, as is one that
  // connects and never speaks; clients may ask as often as every 10 s.
  builder->AddChannelArgument(GRPC_ARG_KEEPALIVE_TIME_MS,
                              static_cast<int>(options.keepalive_time.count()));
  builder->AddChannelArgument(GRPC_ARG_KEEPALIVE_TIMEOUT_MS,
                              static_cast<int>(options.keepalive_timeout.count()));
  builder->AddChannelArgument(GRPC_ARG_KEEPALIVE_PERMIT_WITHOUT_CALLS, 1);
  builder->AddChannelArgument(GRPC_ARG_SERVER_HANDSHAKE_TIMEOUT_MS, 20'000);
  builder->AddChannelArgument(GRPC_ARG_HTTP2_MIN_RECV_PING_INTERVAL_WITHOUT_DATA_MS, 10'000);
}

absl::Status CheckScratchFolder(const std::string& folder) {
  if (folder.empty()) return absl::OkStatus();
  const absl::Status made = UnnamedFile(folder).status();
  if (made.ok()) return made;
  return absl::Status(made.code(), absl::StrCat("scratch: ", made.message(),
                                                "; name a folder that can be written"));
}

// `listen` with its port replaced by the one that was bound.
std::string BoundAddress(const std::string& listen, int port) {
  return absl::StrCat(listen.substr(0, listen.rfind(':')), ":", port);
}

}  // namespace

ReconstructionServer::ReconstructionServer() = default;

ReconstructionServer::~ReconstructionServer() {
  if (core_) core_->metrics->Watch({});
  if (server_) Shutdown();
  if (jobs_) jobs_->BeginDrain();
  // Calls whose gRPC side is gone may still be held by work that is just ending; what they use goes
  // after them.
  while (core_ && !core_->live_calls.WaitUntilEmpty(std::chrono::seconds(1))) {
    core_->live_calls.StopAll(StopReason::kShutdown);
  }
  jobs_.reset();
}

absl::StatusOr<std::unique_ptr<ReconstructionServer>> ReconstructionServer::Listen(
    const ServerOptions& options, JobWork work, JobLog log, const OpenStore& open) {
  return Start(options, /*embedded=*/false, std::move(work), std::move(log), open);
}

absl::StatusOr<std::unique_ptr<ReconstructionServer>> ReconstructionServer::Embed(
    const ServerOptions& options, JobWork work, JobLog log, const OpenStore& open) {
  return Start(options, /*embedded=*/true, std::move(work), std::move(log), open);
}

absl::StatusOr<std::unique_ptr<ReconstructionServer>> ReconstructionServer::Start(
    ServerOptions options, bool embedded, JobWork work, JobLog log, const OpenStore& open) {
  RILIEVO_RETURN_IF_ERROR(options.Validate());
  RILIEVO_RETURN_IF_ERROR(CheckScratchFolder(options.scratch));
  KeepGrpcRunning();
  std::unique_ptr<ReconstructionServer> result(new ReconstructionServer);
  if (options.ephemeral && options.store.empty()) {
    RILIEVO_ASSIGN_OR_RETURN(result->temporary_, TemporaryFolder::Make());
    options.store = result->temporary_->path();
  }
  auto door = std::make_unique<Doorkeeper>();
  if (!embedded) {
    RILIEVO_ASSIGN_OR_RETURN(door, Doorkeeper::Open(options));
  }
  result->core_ =
      std::make_unique<ServiceCore>(options, std::move(work), std::move(log), std::move(door));
  result->service_ = std::make_unique<ReconstructionService>(result->core_.get());
  RILIEVO_ASSIGN_OR_RETURN(result->jobs_, JobsService::Open(result->core_.get(), open));
  result->core_->metrics->Watch([raw = result.get()] { return raw->State(); });
  // Both switches are global and count for the servers built after them.
  grpc::EnableDefaultHealthCheckService(!embedded);
  if (!embedded && options.reflection) grpc::reflection::InitProtoReflectionServerBuilderPlugin();

  grpc::ServerBuilder builder;
  if (embedded || !options.reflection) builder.SetOption(std::make_unique<WithoutReflection>());
  builder.RegisterService(result->service_.get());
  builder.RegisterService(result->jobs_.get());
  std::vector<std::unique_ptr<grpc::experimental::ServerInterceptorFactoryInterface>> interceptors;
  interceptors.push_back(StatusExplainer());  // before what counts and logs them
  interceptors.push_back(CallCounter(result->core_->metrics));
  if (!embedded) interceptors.push_back(CallAuditor(result->core_->door.get()));
  builder.experimental().SetInterceptorCreators(std::move(interceptors));
  builder.SetMaxReceiveMessageSize(kMaxMessageBytes);
  RefuseCompression(&builder);
  std::unique_ptr<grpc::experimental::ExternalConnectionAcceptor> connections;
  int socket = 0;  // not 0 when there is one
  if (!embedded) {
    GuardConnections(options, &builder);
    RILIEVO_ASSIGN_OR_RETURN(result->credentials_, MakeServerCredentials(options));
    if (absl::StartsWith(options.listen, "unix")) {
      builder.AddListeningPort(options.listen, result->credentials_, &socket);
    } else {
      RILIEVO_ASSIGN_OR_RETURN(result->listener_, ConnectionListener::Open(options.listen));
      connections = builder.experimental().AddExternalConnectionAcceptor(
          grpc::ServerBuilder::experimental_type::ExternalConnectionType::FROM_FD,
          result->credentials_);
    }
  }
  result->server_ = builder.BuildAndStart();
  if (!embedded && !result->listener_ && socket == 0) {
    return absl::UnavailableError(
        absl::StrCat("cannot listen on \"", options.listen, "\"; can it be written there?"));
  }
  if (!result->server_) return absl::InternalError("gRPC did not start");
  if (result->listener_) {
    result->connections_ =
        std::make_unique<OpenConnections>(options.max_connections, options.max_address_connections);
    result->WatchConnections();
    result->listener_->Start(
        [server = result.get(), to = std::shared_ptr(std::move(connections))](FileDescriptor one) {
          if (!server->TakeConnection(one)) return;
          grpc::experimental::ExternalConnectionAcceptor::NewConnectionParameters connection;
          connection.fd = one.Release();
          to->HandleNewConnection(&connection);
        },
        [metrics = result->core_->metrics] { metrics->CountRefusedConnection("HANDLES"); });
  }
  if (!embedded) {
    result->address_ = result->listener_ ? BoundAddress(options.listen, result->listener_->port())
                                         : options.listen;
    result->health_ = std::make_unique<ServerHealth>(result->server_->GetHealthCheckService(),
                                                     !options.store.empty());
    result->WatchThreads();
    result->core_->machine.Watch([raw = result->health_.get()](bool able) { raw->SetAble(able); });
    result->jobs_->WatchRoom(
        [health = result->health_.get()](bool room) { health->SetRoom(room); });
  }
  return result;
}

void ReconstructionServer::WatchConnections() {
  const ServerOptions& options = core_->options;
  ConnectionJudge::Limits limits;
  limits.connection_streams = options.max_connection_streams;
  limits.open_calls = options.max_calls + kShortCalls;
  if (options.max_server_memory > 0) limits.memory = options.max_server_memory;
  watch_ = std::make_unique<ConnectionWatch>(
      connections_.get(), limits,
      ConnectionWatch::Hooks{
          .held_bytes = [core = core_.get()] { return core->upload_bytes.load(); },
          .closed = [metrics = core_->metrics] { metrics->CountRefusedConnection("MEMORY"); }});
}

void ReconstructionServer::WatchThreads() {
  std::vector<std::pair<std::string, const Heartbeat*>> hearts = {
      {"the thread that keeps time", &core_->live_calls.heart()},
      {"the job pool", &core_->pool.heart()}};
  if (const Heartbeat* disk = jobs_->disk_heart()) {
    hearts.emplace_back("a thread that waits for the disk", disk);
    hearts.emplace_back("a thread that moves scans and surfaces", jobs_->bulk_heart());
  }
  if (const Heartbeat* scratch = service_->disk_heart()) {
    hearts.emplace_back("a thread that puts points into the scratch folder", scratch);
  }
  vital_signs_ = std::make_unique<VitalSigns>(std::move(hearts), core_->options.stuck_time,
                                              [this](bool alive) { health_->SetAlive(alive); });
}

bool ReconstructionServer::TakeConnection(const FileDescriptor& connection) {
  using Verdict = OpenConnections::Verdict;
  const Verdict verdict = connections_->Take(connection);
  if (verdict == Verdict::kTaken) return true;
  core_->metrics->CountRefusedConnection(verdict == Verdict::kTooMany ? "ALL" : "ADDRESS");
  // TLS has no words before its handshake, which would cost more than the refusal saves.
  if (core_->options.tls_certificate.empty()) {
    connection.Send(kTooManyConnections.data(), kTooManyConnections.size()).IgnoreError();
  }
  return false;
}

ServerState ReconstructionServer::State() const {
  const JobPool::State pool = core_->pool.state();
  return {.queued = pool.waiting,
          .running = pool.running,
          .oldest_wait_seconds = pool.oldest_wait.count(),
          .streams = core_->live_calls.size(),
          .foreign_requests = jobs_->foreign_requests(),
          .connections = connections_ ? connections_->size() : 0};
}

std::shared_ptr<ServerMetrics> ReconstructionServer::metrics() const { return core_->metrics; }

std::shared_ptr<grpc::ChannelInterface> ReconstructionServer::InProcessChannel() const {
  return server_->InProcessChannel({});
}

void ReconstructionServer::BeginDrain() {
  // First: who asks before it calls goes elsewhere.
  if (health_) health_->SetDraining();
  core_->draining = true;
  core_->machine.Watch({});
  jobs_->BeginDrain();
}

std::chrono::steady_clock::duration ReconstructionServer::IdleTime() const {
  return jobs_->IdleTime();
}

bool ReconstructionServer::WaitUntilIdle(std::chrono::milliseconds timeout) {
  return core_->live_calls.WaitUntilEmpty(timeout);
}

void ReconstructionServer::Shutdown() {
  BeginDrain();
  core_->live_calls.StopAll(StopReason::kShutdown);
  WaitUntilIdle(kStopTime);
  listener_.reset();
  watch_.reset();
  vital_signs_.reset();
  jobs_->WatchRoom({});
  server_->Shutdown(std::chrono::system_clock::now() + kLingerTime);
  server_.reset();
}

}  // namespace rilievo
