#include "tests/stress/front.h"

#include <fcntl.h>
#include <signal.h>
#include <spawn.h>
#include <stdlib.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <regex>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_replace.h"
#include "tests/stress/stress_server.h"
#include "tests/unit/server/os/loopback.h"

extern char** environ;

namespace rilievo::stress {
namespace {

// As a package, or as ./dev unpacks it.
constexpr const char* kPrograms[] = {"/usr/sbin/nginx",
                                     RILIEVO_BINARY_FOLDER "/front/usr/sbin/nginx"};
constexpr char kShipped[] = RILIEVO_SOURCE_FOLDER "/deploy/front/nginx.conf";

// One that nobody listens to; another process might take it before we do.
int FreePort() {
  const FileDescriptor end(socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0));
  sockaddr_in address = LoopbackAddress(0);
  socklen_t size = sizeof(address);
  bind(end.number(), reinterpret_cast<sockaddr*>(&address), size);
  getsockname(end.number(), reinterpret_cast<sockaddr*>(&address), &size);
  return ntohs(address.sin_port);
}

std::string Configuration(const std::string& folder, int port, int server_port) {
  std::ifstream file(kShipped);
  const std::string shipped((std::istreambuf_iterator<char>(file)), {});
  return std::regex_replace(
      absl::StrReplaceAll(
          shipped, {{"listen 50443 ssl", absl::StrCat("listen 127.0.0.1:", port)},
                    {"grpc://127.0.0.1:50051", absl::StrCat("grpc://127.0.0.1:", server_port)},
                    {"/tmp/rilievo-front", folder + "/front"}}),
      std::regex("\n *ssl_[^\n]*"), "");
}

}  // namespace

Front::Front(int server_port) { missing_ = Start(server_port); }

std::string Front::Start(int server_port) {
  const auto* program = std::find_if(std::begin(kPrograms), std::end(kPrograms),
                                     [](const char* one) { return access(one, X_OK) == 0; });
  if (program == std::end(kPrograms)) return "nginx is not installed";
  std::string pattern = (std::filesystem::temp_directory_path() / "rilievo-front-XXXXXX").string();
  if (mkdtemp(pattern.data()) == nullptr) return "no temporary folder";
  folder_ = pattern;
  // nginx may give its folders to another user, who must get there.
  std::filesystem::permissions(folder_, std::filesystem::perms(0755));
  port_ = FreePort();
  const std::string configuration = folder_ + "/nginx.conf", log = folder_ + "/log";
  std::ofstream(configuration) << Configuration(folder_, port_, server_port);
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_addopen(&actions, STDERR_FILENO, log.c_str(),
                                   O_WRONLY | O_CREAT | O_APPEND, 0600);
  const char* arguments[] = {*program, "-e", "stderr", "-c", configuration.c_str(), nullptr};
  const int failed =
      posix_spawn(&process_, *program, &actions, nullptr, const_cast<char**>(arguments), environ);
  posix_spawn_file_actions_destroy(&actions);
  if (failed != 0) return "nginx did not start";
  const bool up = WaitFor(std::chrono::seconds(10), [this] { return ConnectTo(port_).valid(); });
  if (up) return "";
  std::ifstream said(log);
  return "nginx did not start: " + std::string((std::istreambuf_iterator<char>(said)), {});
}

Front::~Front() {
  if (process_ > 0) {
    kill(process_, SIGTERM);
    waitpid(process_, nullptr, 0);
  }
  std::error_code error;
  if (!folder_.empty()) std::filesystem::remove_all(folder_, error);
}

}  // namespace rilievo::stress
