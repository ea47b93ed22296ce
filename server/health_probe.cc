#include "server/health_probe.h"

#include <memory>

#include "absl/strings/str_cat.h"
#include "grpc/health/v1/health.grpc.pb.h"
#include "grpcpp/client_context.h"
#include "grpcpp/create_channel.h"
#include "grpcpp/security/credentials.h"
#include "grpcpp/security/tls_certificate_verifier.h"
#include "grpcpp/security/tls_credentials_options.h"
#include "grpcpp/support/channel_arguments.h"

namespace rilievo {

namespace {

using grpc::health::v1::HealthCheckResponse;

std::shared_ptr<grpc::ChannelCredentials> TlsToAnybody() {
  grpc::experimental::TlsChannelCredentialsOptions options;
  options.set_verify_server_certs(false);
  options.set_check_call_host(false);
  options.set_certificate_verifier(std::make_shared<grpc::experimental::NoOpCertificateVerifier>());
  return grpc::experimental::TlsCredentials(options);
}

grpc::Status Ask(const std::string& address, const std::string& service,
                 const std::shared_ptr<grpc::ChannelCredentials>& credentials,
                 std::chrono::milliseconds timeout, HealthCheckResponse* response) {
  grpc::ChannelArguments arguments;
  arguments.SetInt(GRPC_ARG_ENABLE_HTTP_PROXY, 0);
  const auto stub =
      grpc::health::v1::Health::NewStub(grpc::CreateCustomChannel(address, credentials, arguments));
  grpc::ClientContext context;
  context.set_deadline(std::chrono::system_clock::now() + timeout);
  grpc::health::v1::HealthCheckRequest request;
  request.set_service(service);
  return stub->Check(&context, request, response);
}

}  // namespace

absl::Status ProbeHealth(const std::string& address, std::chrono::milliseconds timeout,
                         const std::string& service) {
  HealthCheckResponse response;
  grpc::Status status = Ask(address, service, TlsToAnybody(), timeout / 2, &response);
  if (!status.ok()) {
    status = Ask(address, service, grpc::InsecureChannelCredentials(), timeout / 2, &response);
  }
  if (!status.ok()) {
    return absl::Status(static_cast<absl::StatusCode>(status.error_code()), status.error_message());
  }
  if (response.status() != HealthCheckResponse::SERVING) {
    return absl::UnavailableError(absl::StrCat(
        "the server says ", HealthCheckResponse::ServingStatus_Name(response.status())));
  }
  return absl::OkStatus();
}

}  // namespace rilievo
