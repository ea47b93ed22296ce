#include "tests/stress/stress_server.h"

#include <signal.h>
#include <stdlib.h>

#include <cstdio>
#include <filesystem>
#include <fstream>
#include <set>
#include <utility>

#include "absl/strings/str_format.h"
#include "grpcpp/create_channel.h"
#include "grpcpp/security/credentials.h"

namespace rilievo::stress {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

std::string NewFolder() {
  std::string pattern = (std::filesystem::temp_directory_path() / "rilievo-stress-XXXXXX").string();
  return mkdtemp(pattern.data()) == nullptr ? "" : pattern;
}

}  // namespace

std::shared_ptr<grpc::Channel> OwnConnection(const std::string& address,
                                             grpc::ChannelArguments arguments) {
  arguments.SetInt(GRPC_ARG_ENABLE_HTTP_PROXY, 0);
  arguments.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
  arguments.SetInt(GRPC_ARG_INITIAL_RECONNECT_BACKOFF_MS, 100);
  arguments.SetInt(GRPC_ARG_MIN_RECONNECT_BACKOFF_MS, 1000);
  arguments.SetInt(GRPC_ARG_MAX_RECONNECT_BACKOFF_MS, 500);
  return grpc::CreateCustomChannel(address, grpc::InsecureChannelCredentials(), arguments);
}

StressServer::StressServer(std::string folder)
    : folder_(std::move(folder)), own_folder_(folder_.empty()) {
  if (own_folder_) folder_ = NewFolder();
}

StressServer::~StressServer() {
  process_.reset();
  std::error_code error;
  if (own_folder_) std::filesystem::remove_all(folder_, error);
}

void StressServer::Start(std::vector<std::string> arguments,
                         const std::vector<std::string>& environment) {
  process_.reset();
  arguments.insert(arguments.end(), {"--store", folder_ + "/store"});
  if (!address_.empty()) arguments.insert(arguments.end(), {"--listen", address_});
  process_ = std::make_unique<DaemonProcess>(arguments, environment);
  if (process_->address().empty()) {
    for (const auto& line : process_->Log()) std::fprintf(stderr, "%s\n", line.c_str());
    std::fprintf(stderr, "rilievo_stress: rilievod did not start\n");
    std::exit(2);
  }
  address_ = process_->address();
}

void StressServer::Kill() {
  process_->Signal(SIGKILL);
  process_->WaitForExit(seconds(10));
}

int StressServer::port() const { return std::stoi(address_.substr(address_.rfind(':') + 1)); }

JobsClient StressServer::Jobs() const { return Jobs(ConnectPlaintext(address_)); }

JobsClient StressServer::Jobs(const std::shared_ptr<grpc::ChannelInterface>& channel) const {
  return JobsClient(
      channel,
      {.attempts = 100, .first_pause = milliseconds(20), .longest_pause = milliseconds(500)});
}

JobsClient StressServer::HastyJobs() const {
  return JobsClient(OwnConnection(address_), {.attempts = 1});
}

void StressServer::ForgetPeak() const {
  std::ofstream(absl::StrFormat("/proc/%d/clear_refs", process_->pid())) << "5";
}

std::vector<std::string> StressServer::Files() const {
  std::error_code error;
  std::vector<std::string> files;
  for (const auto& file : std::filesystem::directory_iterator(
           absl::StrFormat("/proc/%d/fd", process_->pid()), error)) {
    files.push_back(std::filesystem::read_symlink(file, error).string());
  }
  return files;
}

int StressServer::OpenFiles() const { return static_cast<int>(Files().size()); }

int StressServer::Connections() const {
  constexpr unsigned kListen = 10;
  // While connections come and go the table may name one twice; and a client of another server may
  // have the same port on its side.
  std::set<std::string> sockets;
  std::ifstream table("/proc/net/tcp");
  for (std::string line; std::getline(table, line);) {
    unsigned local_port = 0, state = 0, inode = 0;
    // "  0: 0100007F:C383 0100007F:9C40 01 ...": local address and port, remote ones, state,
    // queues, timer, retransmissions, user, timeout, inode.
    if (std::sscanf(line.c_str(), "%*d: %*8x:%x %*8x:%*x %x %*x:%*x %*x:%*x %*x %*u %*u %u",
                    &local_port, &state, &inode) == 3 &&
        static_cast<int>(local_port) == port() && state != kListen) {
      sockets.insert(absl::StrFormat("socket:[%u]", inode));
    }
  }
  int connections = 0;
  for (const std::string& file : Files()) connections += sockets.contains(file);
  return connections;
}

bool StressServer::EndsWithin(milliseconds time) {
  process_->Signal(SIGTERM);
  return process_->WaitForExit(time) == 0;
}

}  // namespace rilievo::stress
