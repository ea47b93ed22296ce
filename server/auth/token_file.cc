#include "server/auth/token_file.h"

#include <fcntl.h>
#include <sys/stat.h>

#include <cerrno>
#include <chrono>
#include <fstream>
#include <iterator>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "server/os/file_descriptor.h"

namespace rilievo {
namespace {

constexpr std::chrono::milliseconds kFilePeriod{500};

}  // namespace

absl::Status AddTokenLine(const std::string& path, const std::string& line) {
  const FileDescriptor file(open(path.c_str(), O_RDWR | O_APPEND | O_CREAT | O_CLOEXEC, 0600));
  if (!file.valid()) return StatusOfErrno(errno, path);
  RILIEVO_ASSIGN_OR_RETURN(const int64_t size, file.Size());
  char last = '\n';
  if (size > 0) RILIEVO_RETURN_IF_ERROR(file.ReadAt(size - 1, &last, 1));
  const std::string text = absl::StrCat(last == '\n' ? "" : "\n", line, "\n");
  return file.Write(text.data(), text.size());
}

absl::StatusOr<std::unique_ptr<TokenFile>> TokenFile::Open(
    const std::string& path, std::function<void(const absl::Status&)> complain) {
  std::unique_ptr<TokenFile> file(new TokenFile(path, std::move(complain)));
  file->version_ = file->CurrentVersion();
  RILIEVO_RETURN_IF_ERROR(file->Read());
  file->watcher_ =
      std::jthread([raw = file.get()](const std::stop_token& stop) { raw->WatchUntil(stop); });
  return file;
}

std::optional<std::string> TokenFile::OwnerOf(absl::string_view token) const {
  std::shared_ptr<const AccessTokens> tokens;
  {
    const std::lock_guard lock(mutex_);
    tokens = tokens_;
  }
  return tokens->OwnerOf(token);
}

TokenFile::Version TokenFile::CurrentVersion() const {
  struct stat now {};
  if (stat(path_.c_str(), &now) != 0) return {};
  return {static_cast<int64_t>(now.st_dev), static_cast<int64_t>(now.st_ino), now.st_size,
          now.st_mtim.tv_sec, now.st_mtim.tv_nsec};
}

absl::Status TokenFile::Read() {
  std::ifstream in(path_, std::ios::binary);
  if (!in) {
    return absl::NotFoundError(absl::StrCat("--tokens ", path_,
                                            " cannot be read; make it with "
                                            "rilievod --make-token NAME --tokens ",
                                            path_));
  }
  const std::string text{std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
  auto parsed = AccessTokens::Parse(text);
  if (!parsed.ok()) {
    return absl::InvalidArgumentError(
        absl::StrCat("--tokens ", path_, ", ", parsed.status().message()));
  }
  auto tokens = std::make_shared<const AccessTokens>(*std::move(parsed));
  const std::lock_guard lock(mutex_);
  tokens_ = std::move(tokens);
  return absl::OkStatus();
}

void TokenFile::WatchUntil(const std::stop_token& stop) {
  while (!stop.stop_requested()) {
    const Version now = CurrentVersion();
    // One that is being written may look empty, which is a file without tokens: it counts once it
    // has been the same for a period.
    const bool settled = std::exchange(seen_, now) == now;
    if (now != version_ && settled) {
      const absl::Status read = Read();
      // One that cannot be read may become readable without a change of its own.
      if (!absl::IsNotFound(read)) version_ = now;
      if (!read.ok() && complain_ && complained_ != now) complain_(read);
      complained_ = read.ok() ? std::nullopt : std::optional(now);
    }
    std::unique_lock lock(mutex_);
    wake_.wait_for(lock, stop, kFilePeriod, [] { return false; });
  }
}

}  // namespace rilievo
