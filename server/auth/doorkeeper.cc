#include "server/auth/doorkeeper.h"

#include <string>
#include <utility>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"
#include "core/base/status_macros.h"
#include "grpcpp/server_context.h"
#include "server/observability/server_log.h"
#include "server/observability/trace_parent.h"

namespace rilievo {
namespace {

constexpr char kCommonName[] = "x509_common_name";  // GRPC_X509_CN_PROPERTY_NAME

void Complain(const absl::Status& status) {
  LogMessage(absl::StrCat(status.message(), "; the tokens stay as they were"));
}

// Of the certificate that the connection was made with; empty when there was none.
std::string CommonName(const grpc::CallbackServerContext& context) {
  const auto proof = context.auth_context();
  if (!proof || !proof->IsPeerAuthenticated()) return "";
  for (const grpc::string_ref& name : proof->FindPropertyValues(kCommonName)) {
    return {name.data(), name.size()};
  }
  return "";
}

}  // namespace

absl::StatusOr<std::unique_ptr<Doorkeeper>> Doorkeeper::Open(const ServerOptions& options) {
  auto keeper = std::make_unique<Doorkeeper>();
  keeper->needs_certificate_ = !options.tls_client_ca.empty();
  if (!options.tokens.empty()) {
    RILIEVO_ASSIGN_OR_RETURN(keeper->tokens_, TokenFile::Open(options.tokens, Complain));
  }
  return keeper;
}

std::optional<CallError> Doorkeeper::Admit(const grpc::CallbackServerContext& context,
                                           Caller* caller) const {
  const auto trace = context.client_metadata().find("traceparent");
  if (trace != context.client_metadata().end()) {
    if (auto parent = ParseTraceParent({trace->second.data(), trace->second.size()})) {
      caller->trace_id = std::move(parent->trace_id);
      caller->parent_id = std::move(parent->parent_id);
    }
  }
  if (needs_certificate_) {
    caller->owner = CommonName(context);
    if (caller->owner.empty()) {
      return CallError(ErrorCause::kNoCertificate,
                       "this server asks for a client's certificate whose subject has a "
                       "common name (rilievo: --tls-cert and --tls-key)");
    }
  }
  if (tokens_) {
    if (auto error = CheckToken(context, &caller->owner)) return error;
  }
  caller->client = caller->owner.empty() ? MachineOfPeer(context.peer()) : caller->owner;
  return std::nullopt;
}

std::optional<CallError> Doorkeeper::CheckToken(const grpc::CallbackServerContext& context,
                                                std::string* owner) const {
  constexpr absl::string_view kScheme = "bearer ";
  const auto [begin, end] = context.client_metadata().equal_range("authorization");
  if (begin == end) {
    return CallError(ErrorCause::kNoToken,
                     "this server asks for a token: send \"authorization: Bearer TOKEN\" "
                     "(rilievo: --token-file or RILIEVO_TOKEN)");
  }
  absl::string_view value(begin->second.data(), begin->second.size());
  std::optional<std::string> name;
  if (std::next(begin) == end && absl::StartsWithIgnoreCase(value, kScheme)) {
    name = tokens_->OwnerOf(value.substr(kScheme.size()));
  }
  if (!name) {
    return CallError(ErrorCause::kWrongToken,
                     "this server does not know the token; ask its operator for another one");
  }
  *owner = *std::move(name);
  return std::nullopt;
}

}  // namespace rilievo
