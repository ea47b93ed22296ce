#include "server/worker/worker_process.h"

#include <gtest/gtest.h>
#include <signal.h>
#include <sys/mman.h>
#include <sys/wait.h>

#include <utility>

namespace rilievo {
namespace {

FileDescriptor Memory() { return FileDescriptor(memfd_create("test", MFD_CLOEXEC)); }

TEST(WorkerProcess, AProgramThatEndsClosesItsSocket) {
  auto process = WorkerProcess::Start(*WorkerProgram::Open("/bin/false"), Memory());
  ASSERT_TRUE(process.ok()) << process.status();
  char byte;
  EXPECT_EQ(process->socket().Read(&byte, 1).code(), absl::StatusCode::kOutOfRange);
  const int status = process->End();
  EXPECT_TRUE(WIFEXITED(status));
  EXPECT_EQ(WEXITSTATUS(status), 1);
}

TEST(WorkerProcess, EndKillsWhatStillRuns) {
  auto process = WorkerProcess::Start(*WorkerProgram::Open(RILIEVO_MOODY_WORKER),
                                      Memory());  // waits for its order
  ASSERT_TRUE(process.ok()) << process.status();
  const int status = process->End();
  EXPECT_TRUE(WIFSIGNALED(status));
  EXPECT_EQ(WTERMSIG(status), SIGKILL);
}

TEST(WorkerProcess, AbandonEndsTheReadsOfBothSides) {
  auto process = WorkerProcess::Start(*WorkerProgram::Open(RILIEVO_MOODY_WORKER), Memory());
  ASSERT_TRUE(process.ok()) << process.status();
  process->Abandon();
  char byte;
  EXPECT_FALSE(process->socket().Read(&byte, 1).ok());
}

TEST(WorkerProcess, StandardInputIsTheFileOfPoints) {
  FileDescriptor script = Memory();
  const std::string text = "echo hello >&3; exit 5\n";
  ASSERT_TRUE(script.Write(text.data(), text.size()).ok());
  ASSERT_EQ(lseek(script.number(), 0, SEEK_SET), 0);
  auto process = WorkerProcess::Start(*WorkerProgram::Open("/bin/sh"), script);
  ASSERT_TRUE(process.ok()) << process.status();
  char words[6];
  ASSERT_TRUE(process->socket().Read(words, 6).ok());
  EXPECT_EQ(std::string(words, 6), "hello\n");
}

TEST(WorkerProcess, WhatIsNoProgramIsAnError) {
  EXPECT_EQ(WorkerProgram::Open("/nonexistent/program").status().code(),
            absl::StatusCode::kNotFound);
  EXPECT_FALSE(WorkerProcess::Start(*WorkerProgram::Open("/etc/passwd"), Memory()).ok());
}

// What a server was given may be secret; what loads a program must be there.
TEST(WorkerProcess, OnlyWhatLoadsProgramsIsHandedOnOfTheEnvironment) {
  setenv("RILIEVO_TEST_SECRET", "1", 1);
  setenv("MALLOC_ARENA_TEST", "8", 1);
  FileDescriptor script = Memory();
  const std::string text = "env | cut -d= -f1 | grep -v -E '^(PWD|_|SHLVL|OLDPWD)$' | sort >&3\n";
  ASSERT_TRUE(script.Write(text.data(), text.size()).ok());
  ASSERT_EQ(lseek(script.number(), 0, SEEK_SET), 0);
  auto process = WorkerProcess::Start(*WorkerProgram::Open("/bin/sh"), script);
  unsetenv("RILIEVO_TEST_SECRET");
  unsetenv("MALLOC_ARENA_TEST");
  ASSERT_TRUE(process.ok()) << process.status();
  std::string names;
  for (char letter; process->socket().Read(&letter, 1).ok();) names += letter;
  EXPECT_NE(names.find("MALLOC_ARENA_TEST\n"), std::string::npos) << names;
  EXPECT_EQ(names.find("RILIEVO"), std::string::npos) << names;
  EXPECT_EQ(names.find("HOME"), std::string::npos) << names;
}

TEST(WorkerProcess, TheWorkerIsLookedForBesideTheProgram) {
  // The tests are built where the programs are.
  const auto worker = WorkerBesideThisProgram();
  ASSERT_TRUE(worker.ok()) << worker.status();
  EXPECT_EQ(*worker, RILIEVO_WORKER);
}

}  // namespace
}  // namespace rilievo
