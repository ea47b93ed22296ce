#include "server/worker/worker_sandbox.h"

#include <fcntl.h>
#include <linux/landlock.h>
#include <sched.h>
#include <seccomp.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <cerrno>
#include <initializer_list>
#include <memory>
#include <system_error>

#include "absl/strings/str_cat.h"
#include "core/base/sanitized.h"

namespace rilievo {
namespace {

// Whatever their arguments: they reach no further than this process and the files it holds.
constexpr auto kAllowed = {
    SCMP_SYS(read),          SCMP_SYS(pread64),         SCMP_SYS(sendto),
    SCMP_SYS(lseek),         SCMP_SYS(fstat),           SCMP_SYS(close),
    SCMP_SYS(munmap),        SCMP_SYS(mremap),          SCMP_SYS(madvise),
    SCMP_SYS(brk),           SCMP_SYS(futex),           SCMP_SYS(set_robust_list),
    SCMP_SYS(rseq),          SCMP_SYS(sched_yield),     SCMP_SYS(sched_getaffinity),
    SCMP_SYS(gettid),        SCMP_SYS(getpid),          SCMP_SYS(getpgrp),
    SCMP_SYS(clock_gettime), SCMP_SYS(clock_nanosleep), SCMP_SYS(nanosleep),
    SCMP_SYS(gettimeofday),  SCMP_SYS(getrandom),       SCMP_SYS(sysinfo),
    SCMP_SYS(rt_sigaction),  SCMP_SYS(rt_sigprocmask),  SCMP_SYS(rt_sigreturn),
    SCMP_SYS(sigaltstack),   SCMP_SYS(pause),           SCMP_SYS(restart_syscall),
    SCMP_SYS(exit),          SCMP_SYS(exit_group)};

using Filter = std::unique_ptr<void, decltype(&seccomp_release)>;

// 0, or what the library says of the first rule that it did not take.
int AddRules(scmp_filter_ctx filter, int first_written, int written_count) {
  int error = 0;
  const auto allow = [&](int call, std::initializer_list<scmp_arg_cmp> arguments = {}) {
    const int result = seccomp_rule_add_array(
        filter, SCMP_ACT_ALLOW, call, static_cast<unsigned>(arguments.size()), arguments.begin());
    if (error == 0) error = result;
  };
  for (const int call : kAllowed) allow(call);
  for (const int output : {STDOUT_FILENO, STDERR_FILENO}) {
    allow(SCMP_SYS(write), {SCMP_A0(SCMP_CMP_EQ, static_cast<scmp_datum_t>(output))});
  }
  for (int i = 0; i < written_count; ++i) {
    const auto file = static_cast<scmp_datum_t>(first_written + i);
    allow(SCMP_SYS(pwrite64), {SCMP_A0(SCMP_CMP_EQ, file)});
    allow(SCMP_SYS(ftruncate), {SCMP_A0(SCMP_CMP_EQ, file)});
  }
  // Threads, and no process.
  allow(SCMP_SYS(clone), {SCMP_A0(SCMP_CMP_MASKED_EQ, CLONE_THREAD, CLONE_THREAD)});
  // Its flags lie in memory, where a filter does not see them: the C library takes clone() then.
  const int without = seccomp_rule_add(filter, SCMP_ACT_ERRNO(ENOSYS), SCMP_SYS(clone3), 0);
  if (error == 0) error = without;
  allow(SCMP_SYS(mmap), {SCMP_A2(SCMP_CMP_MASKED_EQ, PROT_EXEC, 0)});
  allow(SCMP_SYS(mprotect), {SCMP_A2(SCMP_CMP_MASKED_EQ, PROT_EXEC, 0)});
  // Of its own: abort().
  const auto self = static_cast<scmp_datum_t>(getpid());
  allow(SCMP_SYS(tgkill), {SCMP_A0(SCMP_CMP_EQ, self)});
  // The limits may be read.
  allow(SCMP_SYS(prlimit64), {SCMP_A0(SCMP_CMP_EQ, 0), SCMP_A2(SCMP_CMP_EQ, 0)});
  return error;
}

absl::Status Refusal(const char* what, int error) {
  return absl::UnavailableError(absl::StrCat("the sandbox of the worker: ", what, ": ",
                                             std::generic_category().message(error)));
}

// A wish: a kernel without it has the filter still.
void ShutFiles() {
  landlock_ruleset_attr all{};
  all.handled_access_fs = (LANDLOCK_ACCESS_FS_MAKE_SYM << 1) - 1;  // of the first version
  const long rules = syscall(SYS_landlock_create_ruleset, &all, sizeof(all), 0);
  if (rules < 0) return;
  syscall(SYS_landlock_restrict_self, static_cast<int>(rules), 0);
  close(static_cast<int>(rules));
}

}  // namespace

absl::Status EnterSandbox(int first_written, int written_count) {
  if (kSanitized) return absl::OkStatus();
  prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0);
  ShutFiles();
  const Filter filter(seccomp_init(SCMP_ACT_ERRNO(EPERM)), seccomp_release);
  if (!filter) return Refusal("no filter", ENOMEM);
  // All threads, also those that a library started before; and without the mitigation of a
  // processor's speculation that old kernels put on every filtered process.
  seccomp_attr_set(filter.get(), SCMP_FLTATR_CTL_TSYNC, 1);
  seccomp_attr_set(filter.get(), SCMP_FLTATR_CTL_SSB, 1);
  seccomp_attr_set(filter.get(), SCMP_FLTATR_CTL_OPTIMIZE, 2);
  if (const int error = AddRules(filter.get(), first_written, written_count); error != 0) {
    return Refusal("a rule", -error);
  }
  if (const int error = seccomp_load(filter.get()); error != 0) return Refusal("loading", -error);
  return absl::OkStatus();
}

}  // namespace rilievo
