#include "server/auth/server_credentials.h"

#include <openssl/err.h>
#include <openssl/pem.h>
#include <openssl/x509.h>

#include <cstdio>
#include <memory>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "grpcpp/security/server_credentials.h"
#include "grpcpp/security/tls_certificate_provider.h"
#include "grpcpp/security/tls_credentials_options.h"
#include "proto/local_address.h"
#include "server/auth/certificate_copies.h"

namespace rilievo {
namespace {

constexpr unsigned kRefreshSeconds = 1;

template <typename Object, typename Read>
absl::StatusOr<std::unique_ptr<Object, void (*)(Object*)>> ReadPem(const char* option,
                                                                   const std::string& path,
                                                                   Read read,
                                                                   void (*free)(Object*)) {
  const std::unique_ptr<std::FILE, int (*)(std::FILE*)> file(std::fopen(path.c_str(), "rb"),
                                                             std::fclose);
  if (!file) {
    return absl::InvalidArgumentError(absl::StrCat(option, " ", path, " cannot be read"));
  }
  // No question for a passphrase at the terminal.
  const auto no_passphrase = [](char*, int, int, void*) { return 0; };
  Object* object = read(file.get(), nullptr, no_passphrase, nullptr);
  ERR_clear_error();
  if (object == nullptr) {
    return absl::InvalidArgumentError(
        absl::StrCat(option, " ", path, " holds no such PEM text, or it is encrypted"));
  }
  return std::unique_ptr<Object, void (*)(Object*)>(object, free);
}

absl::Status CheckFiles(const ServerOptions& options) {
  if (options.tls_key.empty()) {
    return absl::InvalidArgumentError("--tls-cert needs --tls-key, the key of the certificate");
  }
  RILIEVO_ASSIGN_OR_RETURN(
      const auto certificate,
      ReadPem<X509>("--tls-cert", options.tls_certificate, PEM_read_X509, X509_free));
  RILIEVO_ASSIGN_OR_RETURN(const auto key, ReadPem<EVP_PKEY>("--tls-key", options.tls_key,
                                                             PEM_read_PrivateKey, EVP_PKEY_free));
  const bool match = X509_check_private_key(certificate.get(), key.get()) == 1;
  ERR_clear_error();
  if (!match) {
    return absl::InvalidArgumentError(absl::StrCat(
        "--tls-key ", options.tls_key, " is not the key of --tls-cert ", options.tls_certificate));
  }
  if (options.tls_client_ca.empty()) return absl::OkStatus();
  return ReadPem<X509>("--tls-client-ca", options.tls_client_ca, PEM_read_X509, X509_free).status();
}

// Credentials, and the files they go on reading.
struct Kept {
  std::unique_ptr<CertificateCopies> copies;
  std::shared_ptr<grpc::ServerCredentials> credentials;
};

}  // namespace

absl::StatusOr<std::shared_ptr<grpc::ServerCredentials>> MakeServerCredentials(
    const ServerOptions& options) {
  if (options.tls_certificate.empty()) {
    if (!options.tls_key.empty() || !options.tls_client_ca.empty()) {
      return absl::InvalidArgumentError(
          "--tls-key and --tls-client-ca need --tls-cert, the certificate of this server");
    }
    if (!options.allow_plaintext && !IsLocalAddress(options.listen)) {
      return absl::InvalidArgumentError(
          absl::StrCat("other machines reach ", options.listen,
                       ", and what they send could be read on the way: give --tls-cert and "
                       "--tls-key, listen on 127.0.0.1, or say --allow-plaintext"));
    }
    return grpc::InsecureServerCredentials();
  }
  RILIEVO_RETURN_IF_ERROR(CheckFiles(options));
  const auto check = [options](const std::vector<std::string>& paths) {
    ServerOptions copied = options;
    copied.tls_key = paths[0];
    copied.tls_certificate = paths[1];
    copied.tls_client_ca = paths[2];
    return CheckFiles(copied);
  };
  auto kept = std::make_shared<Kept>();
  RILIEVO_ASSIGN_OR_RETURN(
      kept->copies, CertificateCopies::Watch(
                        {options.tls_key, options.tls_certificate, options.tls_client_ca}, check));
  const std::vector<std::string> paths = kept->copies->paths();
  grpc::experimental::TlsServerCredentialsOptions tls(
      std::make_shared<grpc::experimental::FileWatcherCertificateProvider>(
          paths[0], paths[1], paths[2], kRefreshSeconds));
  tls.watch_identity_key_cert_pairs();
  if (!options.tls_client_ca.empty()) {
    tls.watch_root_certs();
    tls.set_cert_request_type(GRPC_SSL_REQUEST_CLIENT_CERTIFICATE_AND_VERIFY);
  }
  kept->credentials = grpc::experimental::TlsServerCredentials(tls);
  return std::shared_ptr<grpc::ServerCredentials>(kept, kept->credentials.get());
}

}  // namespace rilievo
