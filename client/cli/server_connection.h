// How the command line names a server and what it shows it.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "absl/status/statusor.h"

namespace CLI {
class App;
}
namespace grpc {
class ChannelInterface;
}

namespace rilievo {

struct ServerArguments {
  std::string server;  // HOST:PORT, or several with commas between; empty: none was named
  std::string token_file, tls_ca, tls_cert, tls_key;
  bool allow_plaintext = false;
};

// All options but --server.
void AddServerOptions(CLI::App* app, ServerArguments* arguments);

// Appends the files that they name.
void AppendFilesOf(const ServerArguments& arguments, std::vector<std::string>* files);

// To each server that was named. The token is that of the file, else of RILIEVO_TOKEN. NOT_FOUND
// for files that cannot be read.
absl::StatusOr<std::vector<std::shared_ptr<grpc::ChannelInterface>>> ConnectTo(
    const ServerArguments& arguments);

}  // namespace rilievo
