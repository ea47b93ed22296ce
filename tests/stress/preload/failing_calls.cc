// A library to preload into rilievod: makes the n-th write, sync, rename or allocation fail, as
// fault_control.h says. Nothing fails without a control file, nor in any other program.
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <stdlib.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <sys/uio.h>
#include <unistd.h>

#include <cstring>

#include "tests/stress/preload/fault_control.h"

extern "C" void* __libc_malloc(size_t size);
extern "C" void* __libc_calloc(size_t count, size_t size);
extern "C" void* __libc_realloc(void* block, size_t size);

namespace rilievo::stress {
namespace {

FaultControl* control = nullptr;

__attribute__((constructor)) void MapControl() {
  const char* path = getenv(kFaultVariable);
  if (path == nullptr || std::strcmp(program_invocation_short_name, "rilievod") != 0) return;
  const int file = open(path, O_RDWR | O_CLOEXEC);
  if (file < 0) return;
  void* mapped = mmap(nullptr, sizeof(FaultControl), PROT_READ | PROT_WRITE, MAP_SHARED, file, 0);
  close(file);
  if (mapped != MAP_FAILED) control = static_cast<FaultControl*>(mapped);
}

// Whether this call is the one; sets errno then.
bool Fails(FaultKind kind) {
  if (control == nullptr) return false;
  const int i = static_cast<int>(kind);
  ++control->calls[i];
  auto& countdown = control->countdown[i];
  if (countdown.load(std::memory_order_relaxed) <= 0) return false;
  if (const int64_t left = --countdown; left > 0 || (left < 0 && !control->lasting)) return false;
  if (control->lasting) countdown = 1;
  ++control->failed;
  errno = control->error;
  return true;
}

bool FailsAt(FaultKind kind, int file) {
  struct stat about;
  if (control == nullptr || fstat(file, &about) != 0 || !S_ISREG(about.st_mode)) return false;
  return Fails(kind);
}

bool AllocationFails(const void* caller) {
  if (!Fails(FaultKind::kAllocate)) return false;
  Dl_info about;
  if (dladdr(caller, &about) != 0 && about.dli_fname != nullptr) {
    const char* slash = std::strrchr(about.dli_fname, '/');
    std::strncpy(control->library, slash != nullptr ? slash + 1 : about.dli_fname,
                 sizeof(control->library) - 1);
  }
  errno = control->error;
  return true;
}

template <typename Function>
Function* Next(const char* name) {
  return reinterpret_cast<Function*>(dlsym(RTLD_NEXT, name));
}

}  // namespace
}  // namespace rilievo::stress

using rilievo::stress::AllocationFails;
using rilievo::stress::Fails;
using rilievo::stress::FailsAt;
using rilievo::stress::FaultKind;
using rilievo::stress::Next;

extern "C" {

ssize_t write(int file, const void* bytes, size_t size) {
  static const auto next = Next<decltype(write)>("write");
  return FailsAt(FaultKind::kWrite, file) ? -1 : next(file, bytes, size);
}

ssize_t writev(int file, const iovec* parts, int count) {
  static const auto next = Next<decltype(writev)>("writev");
  return FailsAt(FaultKind::kWrite, file) ? -1 : next(file, parts, count);
}

ssize_t pwrite(int file, const void* bytes, size_t size, off_t offset) {
  static const auto next = Next<decltype(pwrite)>("pwrite");
  return FailsAt(FaultKind::kWrite, file) ? -1 : next(file, bytes, size, offset);
}

ssize_t pwrite64(int file, const void* bytes, size_t size, off64_t offset) {
  static const auto next = Next<decltype(pwrite64)>("pwrite64");
  return FailsAt(FaultKind::kWrite, file) ? -1 : next(file, bytes, size, offset);
}

int fsync(int file) {
  static const auto next = Next<decltype(fsync)>("fsync");
  return Fails(FaultKind::kSync) ? -1 : next(file);
}

int fdatasync(int file) {
  static const auto next = Next<decltype(fdatasync)>("fdatasync");
  return Fails(FaultKind::kSync) ? -1 : next(file);
}

int rename(const char* from, const char* to) noexcept {
  static const auto next = Next<int(const char*, const char*)>("rename");
  return Fails(FaultKind::kRename) ? -1 : next(from, to);
}

int renameat(int from_folder, const char* from, int to_folder, const char* to) noexcept {
  static const auto next = Next<int(int, const char*, int, const char*)>("renameat");
  return Fails(FaultKind::kRename) ? -1 : next(from_folder, from, to_folder, to);
}

void* malloc(size_t size) {
  return AllocationFails(__builtin_return_address(0)) ? nullptr : __libc_malloc(size);
}

void* calloc(size_t count, size_t size) {
  return AllocationFails(__builtin_return_address(0)) ? nullptr : __libc_calloc(count, size);
}

void* realloc(void* block, size_t size) {
  return AllocationFails(__builtin_return_address(0)) ? nullptr : __libc_realloc(block, size);
}

}  // extern "C"
