#include "server/postgres/postgres_blobs.h"

#include <algorithm>
#include <random>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "server/os/unnamed_file.h"
#include "server/store/content_name.h"

namespace rilievo {
namespace {

constexpr size_t kPartBytes = 1 << 20;

std::string NewName() {
  std::random_device random;
  return absl::StrCat("new:", absl::Hex(random(), absl::kZeroPad8),
                      absl::Hex(random(), absl::kZeroPad8), absl::Hex(random(), absl::kZeroPad8));
}

class StagedParts final : public StagedBlob {
 public:
  StagedParts(std::shared_ptr<PostgresConnections> connections, std::string staged,
              std::string name, int64_t bytes)
      : StagedBlob(std::move(name), bytes),
        connections_(std::move(connections)),
        staged_(std::move(staged)) {}
  // Nothing is left of them after a transaction that was kept.
  ~StagedParts() override {
    PostgresParts(connections_->Take().get()).Remove(staged_).IgnoreError();
  }

  absl::Status Adopt(Database* tables) const override {
    if (tables != nullptr) return PostgresParts(tables).Adopt(staged_, name(), bytes());
    const auto connection = connections_->Take();
    return connection->TransactBesideOthers([&] { return Adopt(connection.get()); });
  }

 private:
  const std::shared_ptr<PostgresConnections> connections_;
  const std::string staged_;
};

// Pieces of a source put together to parts of one size, the last one shorter.
class PartWriter {
 public:
  PartWriter(PostgresParts parts, std::string name) : parts_(parts), name_(std::move(name)) {}

  absl::Status Add(std::string_view piece) {
    AddBytes(piece.data(), piece.size(), &hash_);
    while (!piece.empty()) {
      const size_t count = std::min(piece.size(), kPartBytes - pending_.size());
      pending_.append(piece.substr(0, count));
      piece.remove_prefix(count);
      if (pending_.size() == kPartBytes) RILIEVO_RETURN_IF_ERROR(Flush());
    }
    return absl::OkStatus();
  }

  absl::Status Flush() {
    if (pending_.empty()) return absl::OkStatus();
    RILIEVO_RETURN_IF_ERROR(parts_.Append(name_, bytes_, pending_));
    bytes_ += static_cast<int64_t>(pending_.size());
    pending_.clear();
    return absl::OkStatus();
  }

  int64_t bytes() const { return bytes_; }
  std::string hash() const { return ContentName(hash_); }

 private:
  PostgresParts parts_;
  const std::string name_;
  std::string pending_;
  Sha256 hash_;
  int64_t bytes_ = 0;
};

}  // namespace

absl::StatusOr<std::unique_ptr<PostgresBlobs>> PostgresBlobs::Open(
    std::shared_ptr<PostgresConnections> connections, std::string scratch) {
  RILIEVO_RETURN_IF_ERROR(connections->Take()->Execute(
      "DELETE FROM parts WHERE name >= 'new:' AND name < 'new;' AND since < now() - interval '1"
      " day'; DELETE FROM parts WHERE name >= 'damaged:' AND name < 'damaged;' AND since < now() -"
      " interval '7 days'"));
  return std::unique_ptr<PostgresBlobs>(
      new PostgresBlobs(std::move(connections), std::move(scratch)));
}

absl::StatusOr<std::unique_ptr<StagedBlob>> PostgresBlobs::StageFrom(const BlobSource& next) const {
  const std::string staged = NewName();
  const auto connection = connections_->Take();
  PartWriter writer{PostgresParts(connection.get()), staged};
  const absl::Status written = connection->TransactUnflushed([&]() -> absl::Status {
    for (;;) {
      RILIEVO_ASSIGN_OR_RETURN(const std::string_view piece, next());
      if (piece.empty()) return writer.Flush();
      RILIEVO_RETURN_IF_ERROR(writer.Add(piece));
    }
  });
  RILIEVO_RETURN_IF_ERROR(written);
  return std::make_unique<StagedParts>(connections_, staged, writer.hash(), writer.bytes());
}

absl::StatusOr<FileDescriptor> PostgresBlobs::Fetch(const std::string& name,
                                                    const std::function<void()>& moved) const {
  absl::StatusOr<FileDescriptor> opened = UnnamedFile(scratch_);
  // NOT_FOUND would be said of the blob.
  if (!opened.ok()) return absl::UnavailableError(opened.status().message());
  FileDescriptor file = *std::move(opened);
  RILIEVO_ASSIGN_OR_RETURN(const int64_t bytes, BytesOf(name));
  const absl::Status read =
      PostgresParts(connections_->Take().get()).Read(name, [&](const std::string& part) {
        if (moved) moved();
        return file.Write(part.data(), part.size());
      });
  RILIEVO_RETURN_IF_ERROR(read);
  RILIEVO_ASSIGN_OR_RETURN(const int64_t size, file.Size());
  if (size != bytes) return absl::NotFoundError("it was removed meanwhile");
  return file;
}

absl::StatusOr<int64_t> PostgresBlobs::BytesOf(const std::string& name) const {
  if (!IsContentName(name)) return absl::NotFoundError("no such blob is stored");
  RILIEVO_ASSIGN_OR_RETURN(const int64_t bytes,
                           PostgresParts(connections_->Take().get()).End(name));
  if (bytes == 0) return absl::NotFoundError("no such blob is stored");
  return bytes;
}

absl::Status PostgresBlobs::Remove(const std::string& name) const {
  return PostgresParts(connections_->Take().get()).Remove(name);
}

absl::Status PostgresBlobs::SetAside(const std::string& name) const {
  const auto connection = connections_->Take();
  return connection->TransactBesideOthers(
      [&] { return PostgresParts(connection.get()).Rename(name, absl::StrCat("damaged:", name)); });
}

absl::StatusOr<std::vector<FileEntry>> PostgresBlobs::List() const {
  const auto connection = connections_->Take();
  RILIEVO_ASSIGN_OR_RETURN(
      Query query, connection->Prepare("SELECT name, CAST(SUM(octet_length(bytes)) AS BIGINT) FROM"
                                       " parts GROUP BY name ORDER BY name"));
  std::vector<FileEntry> entries;
  for (;;) {
    RILIEVO_ASSIGN_OR_RETURN(const bool row, query.Step());
    if (!row) return entries;
    FileEntry entry{.name = query.Bytes(0), .bytes = query.Integer(1)};
    if (IsContentName(entry.name)) entries.push_back(std::move(entry));
  }
}

}  // namespace rilievo
