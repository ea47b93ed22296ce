// The program as people start it: a process, files, exit codes.
#pragma once

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <vector>

namespace rilievo {

namespace fs = std::filesystem;

using Json = nlohmann::json;

inline std::string Content(const fs::path& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
}

inline size_t WidestLine(const std::string& text) {
  std::istringstream lines(text);
  size_t widest = 0;
  for (std::string line; std::getline(lines, line);) widest = std::max(widest, line.size());
  return widest;
}

struct Ended {
  int code;
  std::string out, err;
};

class ProgramFixture : public ::testing::Test {
 protected:
  ProgramFixture() {
    std::string name = (fs::temp_directory_path() / "rilievo-cli-XXXXXX").string();
    folder_ = mkdtemp(name.data());
  }
  ~ProgramFixture() override { fs::remove_all(folder_); }

  std::string At(const std::string& name) const { return (folder_ / name).string(); }

  pid_t Start(const std::vector<std::string>& arguments) const {
    const pid_t child = fork();
    if (child != 0) return child;
    std::vector<char*> argv = {const_cast<char*>("rilievo")};
    for (const std::string& argument : arguments)
      argv.push_back(const_cast<char*>(argument.c_str()));
    argv.push_back(nullptr);
    if (!stdin_.empty()) dup2(open(stdin_.c_str(), O_RDONLY), STDIN_FILENO);
    const int out = open(At("stdout").c_str(), O_CREAT | O_TRUNC | O_WRONLY, 0600);
    const int err = open(At("stderr").c_str(), O_CREAT | O_TRUNC | O_WRONLY, 0600);
    dup2(out, STDOUT_FILENO);
    dup2(err, STDERR_FILENO);
    execv(RILIEVO_PROGRAM, argv.data());
    _exit(127);
  }

  Ended Wait(pid_t child) const {
    int status = 0;
    waitpid(child, &status, 0);
    return {WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status), Content(At("stdout")),
            Content(At("stderr"))};
  }

  Ended Run(const std::vector<std::string>& arguments) const { return Wait(Start(arguments)); }

  // With the bytes of `input` coming through a pipe.
  Ended RunPiped(const std::string& input, const std::vector<std::string>& arguments) {
    stdin_ = At("fifo");
    fs::remove(stdin_);
    mkfifo(stdin_.c_str(), 0600);
    const pid_t child = Start(arguments);
    const pid_t writer = fork();
    if (writer == 0) {
      signal(SIGPIPE, SIG_DFL);
      std::ofstream(stdin_, std::ios::binary).write(input.data(), input.size()).flush();
      _exit(0);
    }
    const Ended ended = Wait(child);
    kill(writer, SIGTERM);
    waitpid(writer, nullptr, 0);
    stdin_.clear();
    return ended;
  }

  fs::path folder_;
  std::string stdin_;  // empty: the test's own
};

}  // namespace rilievo
