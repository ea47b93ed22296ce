// How connections are made: TLS from files, or plaintext where nobody can listen in.
#pragma once

#include <memory>

#include "absl/status/statusor.h"
#include "server/conversion/server_options.h"

namespace grpc {
class ServerCredentials;
}

namespace rilievo {

// TLS when options.tls_certificate is set: the files are read again within seconds of a change, and
// count for the connections made from then on. With options.tls_client_ca a client's certificate is
// asked for and checked; who shows none is let as far as the Doorkeeper, which says so in words.
// Else plaintext. INVALID_ARGUMENT when files are missing, are no PEM or do not belong together,
// and for plaintext on an address that other machines reach, unless options.allow_plaintext.
absl::StatusOr<std::shared_ptr<grpc::ServerCredentials>> MakeServerCredentials(
    const ServerOptions& options);

}  // namespace rilievo
