#include "server/rpc/grpc_status.h"

#include <algorithm>
#include <string>
#include <utility>

#include "grpc/grpc.h"
#include "rilievo/v1/jobs.pb.h"
#include "rilievo/v1/reconstruction.pb.h"

namespace rilievo {
namespace {

// "/package.Service/Method" of the protocol. gRPC's own services are known to the program too,
// whether they are served or not.
bool IsServed(std::string method) {
  if (method.empty()) return false;
  std::replace(method.begin() + 1, method.end(), '/', '.');
  const auto* file = v1::ReconstructRequest::descriptor()->file();
  const auto* found = file->pool()->FindMethodByName(method.substr(1));
  return found != nullptr && found->file()->package() == file->package();
}

class ExplainOneStatus final : public grpc::experimental::Interceptor {
 public:
  explicit ExplainOneStatus(std::string method) : method_(std::move(method)) {}

  void Intercept(grpc::experimental::InterceptorBatchMethods* methods) override {
    if (methods->QueryInterceptionHookPoint(
            grpc::experimental::InterceptionHookPoints::PRE_SEND_STATUS)) {
      methods->ModifySendStatus(ExplainedStatus(method_, methods->GetSendStatus()));
    }
    methods->Proceed();
  }

 private:
  const std::string method_;
};

class ExplainStatuses final : public grpc::experimental::ServerInterceptorFactoryInterface {
 public:
  grpc::experimental::Interceptor* CreateServerInterceptor(
      grpc::experimental::ServerRpcInfo* call) override {
    return new ExplainOneStatus(call->method() == nullptr ? "" : call->method());
  }
};

}  // namespace

grpc::Status GrpcStatus(const CallError& error) {
  const google::rpc::Status details = RpcStatus(error);
  return grpc::Status(static_cast<grpc::StatusCode>(error.code()), details.message(),
                      details.SerializeAsString());
}

void BreakOff(grpc::CallbackServerContext* context, const CallError& error) {
  // As TryCancel() does, which would say CANCELLED.
  grpc_call_cancel_with_status(context->c_call(), static_cast<grpc_status_code>(error.code()),
                               error.message.c_str(), nullptr);
}

CallError MalformedMessageError() {
  return {ErrorCause::kMalformedMessage,
          "the message is not the protobuf that this method takes; send one made from the protocol "
          "of this version"};
}

grpc::Status ExplainedStatus(const std::string& method, const grpc::Status& status) {
  if (status.error_code() != grpc::StatusCode::UNIMPLEMENTED || !status.error_message().empty()) {
    return status;
  }
  if (IsServed(method)) {
    return GrpcStatus(MalformedMessageError());
  }
  return GrpcStatus({ErrorCause::kUnknownMethod,
                     "this server has no such method; see GetCapabilities for its version"});
}

std::unique_ptr<grpc::experimental::ServerInterceptorFactoryInterface> StatusExplainer() {
  return std::make_unique<ExplainStatuses>();
}

}  // namespace rilievo
