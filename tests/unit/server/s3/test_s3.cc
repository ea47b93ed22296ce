#include "tests/unit/server/s3/test_s3.h"

#include <signal.h>
#include <stdlib.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <filesystem>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/strip.h"

namespace rilievo {
namespace {

constexpr char kPython[] = "/usr/bin/python3";  // Debian's, which has Debian's Swift

}  // namespace

bool TestS3::Launch() {
  int said[2];
  if (pipe(said) != 0) return false;
  server_ = fork();
  if (server_ == 0) {
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    dup2(said[1], STDOUT_FILENO);
    close(said[0]);
    close(said[1]);
    execl(kPython, kPython, "-B", RILIEVO_SWIFT_S3, folder_.c_str(), "127.0.0.1", "0", "rilievo",
          nullptr);
    _exit(127);
  }
  close(said[1]);
  std::string line;
  for (char c = 0; c != '\n' && read(said[0], &c, 1) == 1;) line += c;
  close(said[0]);
  if (!absl::StartsWith(line, "ready ")) return false;
  port_ = std::string(absl::StripAsciiWhitespace(line.substr(sizeof("ready ") - 1)));
  return true;
}

void TestS3::UseCredentials() {
  setenv("AWS_ACCESS_KEY_ID", "test:tester", 1);
  setenv("AWS_SECRET_ACCESS_KEY", "testing", 1);
  unsetenv("AWS_SESSION_TOKEN");
}

TestS3* TestS3::Get(std::string* why_not) {
  static const std::unique_ptr<TestS3> server = []() -> std::unique_ptr<TestS3> {
    std::string folder = "/tmp/rilievo-s3-XXXXXX";
    if (mkdtemp(folder.data()) == nullptr) return nullptr;
    std::unique_ptr<TestS3> made(new TestS3(folder));
    if (!made->Launch()) return nullptr;
    UseCredentials();
    return made;
  }();
  *why_not = server ? "" : "no S3 to test with: python3-swift is not installed, or does not start";
  return server.get();
}

TestS3::~TestS3() {
  if (server_ > 0) {
    kill(server_, SIGKILL);
    waitpid(server_, nullptr, 0);
  }
  std::error_code error;
  std::filesystem::remove_all(folder_, error);
}

std::string TestS3::NewUrl() {
  return absl::StrCat("s3://rilievo/test", ++prefixes_, "?endpoint=http://127.0.0.1:", port_);
}

}  // namespace rilievo
