// Whom a server lets in.
#pragma once

#include <memory>
#include <optional>

#include "server/auth/caller.h"
#include "server/auth/token_file.h"
#include "server/conversion/call_error.h"
#include "server/conversion/server_options.h"

namespace grpc {
class CallbackServerContext;
}

namespace rilievo {

// Thread-safe, never waits.
class Doorkeeper {
 public:
  // Asks for nothing.
  Doorkeeper() = default;

  // As options.tokens and options.tls_client_ca say.
  static absl::StatusOr<std::unique_ptr<Doorkeeper>> Open(const ServerOptions& options);

  // Sets the caller, or gives the error to refuse it with: UNAUTHENTICATED with NO_TOKEN,
  // WRONG_TOKEN or NO_CERTIFICATE. The owner is the name of the token; without tokens the common
  // name of the certificate.
  std::optional<CallError> Admit(const grpc::CallbackServerContext& context, Caller* caller) const;

 private:
  std::optional<CallError> CheckToken(const grpc::CallbackServerContext& context,
                                      std::string* owner) const;

  std::unique_ptr<const TokenFile> tokens_;
  bool needs_certificate_ = false;
};

}  // namespace rilievo
