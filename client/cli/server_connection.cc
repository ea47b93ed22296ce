#include "client/cli/server_connection.h"

#include <CLI/CLI.hpp>
#include <cstdlib>
#include <fstream>
#include <iterator>

#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "client/library/connect.h"
#include "core/base/status_macros.h"

namespace rilievo {
namespace {

// Empty when no file is named.
absl::StatusOr<std::string> Content(const char* option, const std::string& path) {
  if (path.empty()) return std::string();
  std::ifstream file(path, std::ios::binary);
  std::string text{std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
  if (!file || text.empty()) {
    return absl::NotFoundError(absl::StrCat(option, " ", path, ": no such file, or it is empty"));
  }
  return text;
}

}  // namespace

void AddServerOptions(CLI::App* app, ServerArguments* arguments) {
  app->add_option("--token-file", arguments->token_file,
                  "file with the token for the server; default the variable RILIEVO_TOKEN");
  CLI::Option* ca = app->add_option("--tls-ca", arguments->tls_ca,
                                    "encrypt, and trust certificates of the authorities in this "
                                    "PEM file (/etc/ssl/certs/ca-certificates.crt: all known)");
  CLI::Option* cert =
      app->add_option("--tls-cert", arguments->tls_cert, "client certificate, a PEM file");
  CLI::Option* key = app->add_option("--tls-key", arguments->tls_key,
                                     "private key of the client certificate, a PEM file");
  cert->needs(ca)->needs(key);
  key->needs(cert);
  app->add_flag("--allow-plaintext", arguments->allow_plaintext,
                "send the token unencrypted even to another machine")
      ->excludes(ca);
}

void AppendFilesOf(const ServerArguments& arguments, std::vector<std::string>* files) {
  files->insert(files->end(),
                {arguments.token_file, arguments.tls_ca, arguments.tls_cert, arguments.tls_key});
}

absl::StatusOr<std::vector<std::shared_ptr<grpc::ChannelInterface>>> ConnectTo(
    const ServerArguments& arguments) {
  ConnectOptions options;
  RILIEVO_ASSIGN_OR_RETURN(options.token, Content("--token-file", arguments.token_file));
  const char* variable = std::getenv("RILIEVO_TOKEN");
  if (arguments.token_file.empty() && variable != nullptr) options.token = variable;
  absl::StripAsciiWhitespace(&options.token);
  RILIEVO_ASSIGN_OR_RETURN(options.ca, Content("--tls-ca", arguments.tls_ca));
  RILIEVO_ASSIGN_OR_RETURN(options.certificate, Content("--tls-cert", arguments.tls_cert));
  RILIEVO_ASSIGN_OR_RETURN(options.key, Content("--tls-key", arguments.tls_key));
  options.allow_plaintext = arguments.allow_plaintext;
  const auto channels = ConnectToEach(arguments.server, options);
  if (channels.ok()) return channels;
  return absl::InvalidArgumentError(
      absl::StrCat(channels.status().message(), " (--tls-ca FILE, or --allow-plaintext)"));
}

}  // namespace rilievo
