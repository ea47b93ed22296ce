#include "server/rpc/call_auditor.h"

#include <mutex>
#include <string>
#include <string_view>
#include <utility>

#include "absl/strings/escaping.h"
#include "grpcpp/server_context.h"
#include "rilievo/v1/jobs.pb.h"
#include "server/observability/audit_log.h"
#include "server/observability/error_reason.h"

namespace rilievo {
namespace {

// Of a caller's words no more than the line will show.
void Note(const std::string& text, std::string* field) { field->assign(text, 0, kMostAuditBytes); }

// `message`: of the type that the call takes, or null.
void ReadIds(const void* message, AuditRecord* record) {
  if (message == nullptr) return;
  if (record->call == "CreateJob") {
    const auto& request = *static_cast<const v1::CreateJobRequest*>(message);
    Note(request.request_id(), &record->request_id);
    Note(request.scan_id(), &record->scan_id);
  } else if (record->call == "CancelJob") {
    Note(static_cast<const v1::CancelJobRequest*>(message)->job_id(), &record->job_id);
  } else if (record->call == "DeleteJob") {
    Note(static_cast<const v1::DeleteJobRequest*>(message)->job_id(), &record->job_id);
  } else if (record->call == "DeleteScan") {
    Note(static_cast<const v1::DeleteScanRequest*>(message)->scan_id(), &record->scan_id);
  } else if (record->call == "UploadScan") {
    const auto& request = *static_cast<const v1::UploadScanRequest*>(message);
    if (request.has_header()) Note(request.header().upload_id(), &record->upload_id);
    if (request.has_end()) {
      record->scan_id =
          absl::BytesToHexString(request.end().sha256().substr(0, kMostAuditBytes / 2));
    }
  }
}

class AuditOneCall final : public grpc::experimental::Interceptor {
 public:
  AuditOneCall(std::string call, grpc::ServerContextBase* context, const Doorkeeper* door,
               std::shared_ptr<AuditLog> log)
      : context_(context), door_(door), log_(std::move(log)) {
    record_.call = std::move(call);
  }

  void Intercept(grpc::experimental::InterceptorBatchMethods* methods) override {
    using Point = grpc::experimental::InterceptionHookPoints;
    {
      // The last read of a stream may end while its status is sent.
      const std::lock_guard lock(mutex_);
      if (methods->QueryInterceptionHookPoint(Point::POST_RECV_INITIAL_METADATA)) ReadCaller();
      if (methods->QueryInterceptionHookPoint(Point::POST_RECV_MESSAGE)) {
        ReadIds(methods->GetRecvMessage(), &record_);
      }
      if (methods->QueryInterceptionHookPoint(Point::PRE_SEND_MESSAGE)) {
        ReadAnswer(methods->GetSendMessage());
      }
      if (methods->QueryInterceptionHookPoint(Point::PRE_SEND_STATUS)) {
        Write(methods->GetSendStatus());
      }
    }
    methods->Proceed();
  }

 private:
  // Now, not at the end: by then the operator may have taken the token back.
  void ReadCaller() {
    record_.peer = context_->peer();
    Caller caller;
    const auto* context = dynamic_cast<const grpc::CallbackServerContext*>(context_);
    if (context != nullptr && !door_->Admit(*context, &caller)) record_.owner = caller.owner;
  }

  void ReadAnswer(const void* message) {
    if (message == nullptr || record_.call != "CreateJob") return;
    record_.job_id = static_cast<const v1::CreateJobResponse*>(message)->job().job_id();
  }

  void Write(const grpc::Status& status) {
    record_.outcome = static_cast<absl::StatusCode>(status.error_code());
    record_.reason = ErrorReasonOf(status);
    log_->Write(record_);
  }

  grpc::ServerContextBase* const context_;
  const Doorkeeper* const door_;
  const std::shared_ptr<AuditLog> log_;
  std::mutex mutex_;
  AuditRecord record_;
};

class AuditCalls final : public grpc::experimental::ServerInterceptorFactoryInterface {
 public:
  explicit AuditCalls(const Doorkeeper* door) : door_(door) {}

  grpc::experimental::Interceptor* CreateServerInterceptor(
      grpc::experimental::ServerRpcInfo* info) override {
    std::string_view method = info->method() == nullptr ? "" : info->method();
    if (!method.starts_with("/rilievo.v1.")) return nullptr;
    const std::string call(method.substr(method.rfind('/') + 1));
    return new AuditOneCall(call, info->server_context(), door_, log_);
  }

 private:
  const Doorkeeper* const door_;
  const std::shared_ptr<AuditLog> log_ = std::make_shared<AuditLog>();
};

}  // namespace

std::unique_ptr<grpc::experimental::ServerInterceptorFactoryInterface> CallAuditor(
    const Doorkeeper* door) {
  return std::make_unique<AuditCalls>(door);
}

}  // namespace rilievo
