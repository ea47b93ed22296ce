#include "tests/unit/server/postgres/test_postgres.h"

#include <fcntl.h>
#include <pwd.h>
#include <signal.h>
#include <stdlib.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <sstream>
#include <thread>
#include <vector>

#include "absl/strings/str_cat.h"
#include "server/postgres/postgres_database.h"

namespace rilievo {
namespace {

namespace fs = std::filesystem;

constexpr char kPrograms[] = "/usr/lib/postgresql/15/bin/";

// PostgreSQL does not run as root.
const passwd* Unprivileged() {
  const passwd* user = getpwnam("postgres");
  return user != nullptr ? user : getpwnam("nobody");
}

}  // namespace

std::string TestPostgres::UrlOf(const std::string& database) const {
  return absl::StrCat("postgres:///", database, "?user=rilievo&host=", folder_);
}

int TestPostgres::Launch(const std::string& program, const std::string& arguments) const {
  std::stringstream words(arguments);
  std::vector<std::string> list = {kPrograms + program};
  for (std::string word; words >> word;) list.push_back(word);
  std::vector<char*> argv;
  for (std::string& word : list) argv.push_back(word.data());
  argv.push_back(nullptr);
  const passwd* user = geteuid() == 0 ? Unprivileged() : nullptr;
  const std::string log = folder_ + "/log";
  const pid_t child = fork();
  if (child != 0) return child;
  if (user != nullptr && (setgid(user->pw_gid) != 0 || setuid(user->pw_uid) != 0)) _exit(126);
  prctl(PR_SET_PDEATHSIG, SIGQUIT);
  setsid();
  const int output = open(log.c_str(), O_WRONLY | O_CREAT | O_APPEND, 0600);
  dup2(output, STDOUT_FILENO);
  dup2(output, STDERR_FILENO);
  if (chdir(folder_.c_str()) != 0) _exit(126);
  execv(argv[0], argv.data());
  _exit(127);
}

TestPostgres* TestPostgres::Get(std::string* why_not) {
  static std::string reason;
  static const std::unique_ptr<TestPostgres> server = []() -> std::unique_ptr<TestPostgres> {
    if (!fs::exists(absl::StrCat(kPrograms, "postgres"))) {
      reason = "postgresql-15 is not installed";
      return nullptr;
    }
    // Short: the name of a socket has 107 bytes at most.
    std::string folder = "/tmp/rilievo-pg-XXXXXX";
    if (mkdtemp(folder.data()) == nullptr) return nullptr;
    if (geteuid() == 0 && chown(folder.c_str(), Unprivileged()->pw_uid, -1) != 0) return nullptr;
    std::unique_ptr<TestPostgres> made(new TestPostgres(folder));
    int status = -1;
    waitpid(made->Launch("initdb", absl::StrCat("-D ", folder,
                                                "/data -U rilievo -A trust -E UTF8 "
                                                "--locale=C --no-sync")),
            &status, 0);
    if (status != 0) {
      reason = absl::StrCat("initdb failed with status ", status);
      return nullptr;
    }
    made->Start();
    if (made->server_ < 0) {
      reason = "PostgreSQL did not start";
      return nullptr;
    }
    return made;
  }();
  *why_not = reason;
  return server.get();
}

void TestPostgres::Start() {
  // Each database is a copy of 7 MB, so nothing is written that only a crash of the machine needs.
  const std::string arguments =
      absl::StrCat("-D ", folder_, "/data -k ", folder_,
                   " -c listen_addresses= -c fsync=off -c full_page_writes=off -c autovacuum=off"
                   " -c wal_level=minimal -c max_wal_senders=0");
  server_ = Launch("postgres", arguments);
  const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(30);
  while (std::chrono::steady_clock::now() < end) {
    if (PostgresDatabase(UrlOf("postgres")).Number("SELECT 1").ok()) return;
    // The children of one that was killed hold its files for a moment.
    if (waitpid(server_, nullptr, WNOHANG) == server_) {
      server_ = Launch("postgres", arguments);
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
  }
  server_ = -1;
}

// With its children: one that is at work would end what it is at.
void TestPostgres::Kill() {
  std::ifstream list(absl::StrCat("/proc/", server_, "/task/", server_, "/children"));
  const std::vector<pid_t> children{std::istream_iterator<pid_t>(list), {}};
  kill(server_, SIGKILL);
  for (const pid_t child : children) kill(child, SIGKILL);
  waitpid(server_, nullptr, 0);
  server_ = -1;
}

TestPostgres::~TestPostgres() {
  if (server_ > 0) {
    kill(server_, SIGINT);
    waitpid(server_, nullptr, 0);
  }
  std::error_code error;
  fs::remove_all(folder_, error);
}

std::string TestPostgres::NewDatabase() {
  const std::string name = absl::StrCat("test", ++databases_);
  const absl::Status made = PostgresDatabase(UrlOf("postgres"))
                                .Execute("CREATE DATABASE " + name + " STRATEGY file_copy");
  if (!made.ok()) std::fprintf(stderr, "%s\n", std::string(made.message()).c_str());
  return UrlOf(name);
}

}  // namespace rilievo
