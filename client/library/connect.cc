#include "client/library/connect.h"

#include <algorithm>
#include <chrono>
#include <random>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "core/base/status_macros.h"
#include "grpcpp/channel.h"
#include "grpcpp/create_channel.h"
#include "grpcpp/security/credentials.h"
#include "grpcpp/support/channel_arguments.h"
#include "grpcpp/support/client_interceptor.h"
#include "proto/keep_grpc_running.h"
#include "proto/local_address.h"

namespace rilievo {
namespace {

// gRPC's own credentials of a call do not go over plaintext, not even on this machine.
class TokenSender final : public grpc::experimental::Interceptor {
 public:
  explicit TokenSender(std::string value) : value_(std::move(value)) {}

  void Intercept(grpc::experimental::InterceptorBatchMethods* methods) override {
    using Point = grpc::experimental::InterceptionHookPoints;
    if (methods->QueryInterceptionHookPoint(Point::PRE_SEND_INITIAL_METADATA)) {
      methods->GetSendInitialMetadata()->emplace("authorization", value_);
    }
    methods->Proceed();
  }

 private:
  const std::string value_;
};

class TokenSenders final : public grpc::experimental::ClientInterceptorFactoryInterface {
 public:
  explicit TokenSenders(const std::string& token) : value_(absl::StrCat("Bearer ", token)) {}

  grpc::experimental::Interceptor* CreateClientInterceptor(
      grpc::experimental::ClientRpcInfo* /*call*/) override {
    return new TokenSender(value_);
  }

 private:
  const std::string value_;
};

grpc::ChannelArguments Arguments() {
  grpc::ChannelArguments arguments;
  arguments.SetInt(GRPC_ARG_ENABLE_HTTP_PROXY, 0);
  // A peer that vanished without a word is noticed after half a minute.
  arguments.SetInt(GRPC_ARG_KEEPALIVE_TIME_MS, 20'000);
  arguments.SetInt(GRPC_ARG_KEEPALIVE_TIMEOUT_MS, 10'000);
  // A server that was started again is found soon; gRPC's own pauses grow to two minutes.
  arguments.SetInt(GRPC_ARG_INITIAL_RECONNECT_BACKOFF_MS, 200);
  arguments.SetInt(GRPC_ARG_MAX_RECONNECT_BACKOFF_MS, 2'000);
  return arguments;
}

absl::Status Check(const std::string& address, const ConnectOptions& options) {
  if (options.certificate.empty() != options.key.empty()) {
    return absl::InvalidArgumentError("a certificate and its key go together; give both");
  }
  if (!options.certificate.empty() && options.ca.empty()) {
    return absl::InvalidArgumentError(
        "a certificate is shown over TLS alone; give the authorities of the server's too");
  }
  for (const char c : options.token) {
    if (c > ' ' && c <= '~') continue;
    return absl::InvalidArgumentError("the token holds a space, a line end or the like");
  }
  if (!options.token.empty() && options.ca.empty() && !options.allow_plaintext &&
      !IsLocalAddress(address)) {
    return absl::InvalidArgumentError(
        absl::StrCat("the token would travel unencrypted to ", address,
                     "; give the authorities of the server's certificate, or allow plaintext"));
  }
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<std::shared_ptr<grpc::ChannelInterface>> Connect(const std::string& address,
                                                                const ConnectOptions& options) {
  if (const absl::Status status = Check(address, options); !status.ok()) return status;
  PrepareToConnect();
  std::shared_ptr<grpc::ChannelCredentials> credentials = grpc::InsecureChannelCredentials();
  if (!options.ca.empty()) {
    credentials = grpc::SslCredentials({.pem_root_certs = options.ca,
                                        .pem_private_key = options.key,
                                        .pem_cert_chain = options.certificate});
  }
  std::vector<std::unique_ptr<grpc::experimental::ClientInterceptorFactoryInterface>> senders;
  if (!options.token.empty()) senders.push_back(std::make_unique<TokenSenders>(options.token));
  return grpc::experimental::CreateCustomChannelWithInterceptors(address, credentials, Arguments(),
                                                                 std::move(senders));
}

absl::StatusOr<std::vector<std::shared_ptr<grpc::ChannelInterface>>> ConnectToEach(
    const std::string& addresses, const ConnectOptions& options) {
  std::vector<std::shared_ptr<grpc::ChannelInterface>> channels;
  for (const std::string& address : std::vector<std::string>(absl::StrSplit(addresses, ','))) {
    if (address.empty()) {
      return absl::InvalidArgumentError(
          absl::StrCat(addresses, ": one of the addresses is empty; give HOST:PORT,HOST:PORT,..."));
    }
    RILIEVO_ASSIGN_OR_RETURN(channels.emplace_back(), Connect(address, options));
  }
  std::shuffle(channels.begin(), channels.end(), std::minstd_rand(std::random_device{}()));
  return channels;
}

std::shared_ptr<grpc::ChannelInterface> FirstReachable(
    const std::vector<std::shared_ptr<grpc::ChannelInterface>>& channels) {
  if (channels.size() == 1) return channels[0];
  for (const auto& channel : channels) {
    const auto until = std::chrono::system_clock::now() + std::chrono::seconds(2);
    if (channel->WaitForConnected(until)) return channel;
  }
  return channels[0];
}

std::shared_ptr<grpc::ChannelInterface> ConnectPlaintext(const std::string& address) {
  PrepareToConnect();
  return grpc::CreateCustomChannel(address, grpc::InsecureChannelCredentials(), Arguments());
}

}  // namespace rilievo
