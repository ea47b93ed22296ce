#include "client/cli/child_program.h"

#include <gtest/gtest.h>
#include <signal.h>

namespace rilievo {
namespace {

TEST(ChildProgramTest, SaysItsLinesAndEnds) {
  absl::StatusOr<ChildProgram> child = ChildProgram::Start({"sh", "-c", "echo one; echo two"});
  ASSERT_TRUE(child.ok()) << child.status();
  EXPECT_EQ(child->ReadLine({}), "one");
  EXPECT_EQ(child->ReadLine({}), "two");
  EXPECT_EQ(child->ReadLine({}), std::nullopt);
  EXPECT_TRUE(absl::IsNotFound(ChildProgram::Start({"no-program-of-this-name"}).status()));
}

// What we ignore or block still ends it.
TEST(ChildProgramTest, NoSignalIsIgnoredOrBlockedInIt) {
  const auto before = signal(SIGPIPE, SIG_IGN);
  sigset_t blocked, mask_before;
  sigemptyset(&blocked);
  sigaddset(&blocked, SIGTERM);
  pthread_sigmask(SIG_BLOCK, &blocked, &mask_before);
  for (const std::string name : {"PIPE", "TERM"}) {
    absl::StatusOr<ChildProgram> child =
        ChildProgram::Start({"sh", "-c", "echo in; kill -s " + name + " $$; echo lives"});
    EXPECT_TRUE(child.ok()) << child.status();
    if (!child.ok()) continue;
    EXPECT_EQ(child->ReadLine({}), "in");
    EXPECT_EQ(child->ReadLine({}), std::nullopt) << name;
  }
  pthread_sigmask(SIG_SETMASK, &mask_before, nullptr);
  signal(SIGPIPE, before);
}

}  // namespace
}  // namespace rilievo
