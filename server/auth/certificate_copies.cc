#include "server/auth/certificate_copies.h"

#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <chrono>
#include <fstream>
#include <iterator>
#include <optional>
#include <utility>

#include "absl/strings/str_cat.h"
#include "server/observability/server_log.h"

namespace rilievo {
namespace {

constexpr std::chrono::seconds kCopyPeriod{1};

std::optional<std::vector<std::string>> Read(const std::vector<std::string>& files) {
  std::vector<std::string> contents;
  for (const std::string& file : files) {
    contents.emplace_back();
    if (file.empty()) continue;
    std::ifstream in(file, std::ios::binary);
    if (!in) return std::nullopt;
    contents.back().assign(std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>());
  }
  return contents;
}

// -1 when there is no memory for it.
int InMemory(const std::string& content) {
  const int file = memfd_create("rilievo-certificate", MFD_CLOEXEC);
  if (file < 0) return -1;
  if (write(file, content.data(), content.size()) == static_cast<ssize_t>(content.size())) {
    return file;
  }
  close(file);
  return -1;
}

std::string PathOf(int file) { return file < 0 ? "" : absl::StrCat("/proc/self/fd/", file); }

void CloseAll(const std::vector<int>& files) {
  for (const int file : files) {
    if (file >= 0) close(file);
  }
}

// Empty when one of them cannot be made.
std::vector<int> AllInMemory(const std::vector<std::string>& files,
                             const std::vector<std::string>& contents) {
  std::vector<int> copies;
  for (size_t i = 0; i < files.size(); ++i) {
    copies.push_back(files[i].empty() ? -1 : InMemory(contents[i]));
    if (files[i].empty() || copies.back() >= 0) continue;
    CloseAll(copies);
    return {};
  }
  return copies;
}

std::vector<std::string> PathsOf(const std::vector<int>& copies) {
  std::vector<std::string> paths;
  for (const int copy : copies) paths.push_back(PathOf(copy));
  return paths;
}

}  // namespace

absl::StatusOr<std::unique_ptr<CertificateCopies>> CertificateCopies::Watch(
    std::vector<std::string> files, Check check) {
  std::unique_ptr<CertificateCopies> copies(new CertificateCopies);
  auto contents = Read(files);
  if (!contents) return absl::UnavailableError("a TLS file cannot be read");
  copies->copies_ = AllInMemory(files, *contents);
  if (copies->copies_.empty()) return absl::UnavailableError("no memory for the TLS files");
  copies->files_ = std::move(files);
  copies->check_ = std::move(check);
  copies->state_ = *std::move(contents);
  copies->thread_ =
      std::jthread([self = copies.get()](const std::stop_token& stop) { self->FollowUntil(stop); });
  return copies;
}

CertificateCopies::~CertificateCopies() {
  thread_.request_stop();
  if (thread_.joinable()) thread_.join();
  CloseAll(copies_);
}

std::vector<std::string> CertificateCopies::paths() const { return PathsOf(copies_); }

void CertificateCopies::FollowUntil(const std::stop_token& stop) {
  while (!stop.stop_requested()) {
    {
      std::unique_lock lock(mutex_);
      wake_.wait_for(lock, stop, kCopyPeriod, [] { return false; });
    }
    auto contents = Read(files_);
    if (!contents || *contents == state_) continue;
    const std::vector<int> fresh = AllInMemory(files_, *contents);
    if (fresh.empty()) continue;
    state_ = *std::move(contents);
    if (const absl::Status checked = check_(PathsOf(fresh)); checked.ok()) {
      for (size_t i = 0; i < fresh.size(); ++i) {
        if (fresh[i] >= 0) dup3(fresh[i], copies_[i], O_CLOEXEC);
      }
    } else {
      LogMessage(absl::StrCat(
          "the TLS files have changed and do not serve; those read before stay in use (",
          checked.message(), ")"));
    }
    CloseAll(fresh);
  }
}

}  // namespace rilievo
