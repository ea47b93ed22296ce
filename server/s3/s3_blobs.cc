#include "server/s3/s3_blobs.h"

#include <algorithm>
#include <chrono>
#include <mutex>
#include <random>
#include <thread>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/sha256.h"
#include "core/base/status_macros.h"
#include "server/os/unnamed_file.h"
#include "server/store/content_name.h"

namespace rilievo {
namespace {

using Connections = LeasePool<Database>;

// Held in memory while a part is on its way; S3 takes 10 000 parts of at least 5 MiB.
constexpr size_t kPartBytes = 8 << 20;
constexpr size_t kMostParts = 10'000;
constexpr size_t kBatch = 100;
constexpr size_t kRemovals = 8;  // at a time
// Then no further batch: the thread has other things to do each second.
constexpr std::chrono::seconds kSweep{1};

std::string NewKey() {
  std::random_device random;
  std::string key;
  for (int i = 0; i < 4; ++i) absl::StrAppend(&key, absl::Hex(random(), absl::kZeroPad8));
  return key;
}

// Runs one statement, whose parameters are `values`; how many rows it changed.
absl::StatusOr<int> Change(Database* database, const std::string& sql,
                           const std::vector<std::string>& values) {
  RILIEVO_ASSIGN_OR_RETURN(Query query, database->Prepare(sql));
  for (const std::string& value : values) query.Bind(value);
  RILIEVO_RETURN_IF_ERROR(query.Run());
  return database->Changes();
}

// An object that is not a blob yet: removed later unless it was adopted.
class StagedObject final : public StagedBlob {
 public:
  StagedObject(std::shared_ptr<Connections> connections, std::string key, std::string name,
               int64_t bytes)
      : StagedBlob(std::move(name), bytes),
        connections_(std::move(connections)),
        key_(std::move(key)) {}
  ~StagedObject() override {
    Change(connections_->Take().get(),
           "UPDATE objects SET remove_after = now() WHERE key = $1 AND name IS NULL", {key_})
        .IgnoreError();
  }

  // Where the same bytes are a blob already, that one stays.
  absl::Status Adopt(Database* tables) const override {
    if (tables == nullptr) {
      const auto connection = connections_->Take();
      return connection->TransactBesideOthers([&] { return Adopt(connection.get()); });
    }
    RILIEVO_ASSIGN_OR_RETURN(Query known,
                             tables->Prepare("SELECT 1 FROM objects WHERE name = $1 FOR UPDATE"));
    RILIEVO_ASSIGN_OR_RETURN(const bool found, known.Bind(name()).Step());
    if (found) return absl::OkStatus();
    RILIEVO_ASSIGN_OR_RETURN(
        Query adopt,
        tables->Prepare("UPDATE objects SET name = $2, bytes = $3, remove_after = NULL, upload = ''"
                        " WHERE key = $1 AND name IS NULL"));
    RILIEVO_RETURN_IF_ERROR(adopt.Bind(key_).Bind(name()).Bind(bytes()).Run());
    if (tables->Changes() == 1) return absl::OkStatus();
    return absl::UnavailableError("the database lost what was written; send it again");
  }

 private:
  const std::shared_ptr<Connections> connections_;
  const std::string key_;
};

// Pieces of a source as one object: small ones at once, larger ones in parts.
class ObjectWriter {
 public:
  ObjectWriter(const S3Bucket& bucket, Connections* connections, std::string key)
      : bucket_(bucket), connections_(connections), key_(std::move(key)) {}

  absl::Status Add(std::string_view piece) {
    AddBytes(piece.data(), piece.size(), &hash_);
    bytes_ += static_cast<int64_t>(piece.size());
    while (!piece.empty()) {
      if (pending_.size() == kPartBytes) RILIEVO_RETURN_IF_ERROR(SendPart());
      const size_t count = std::min(piece.size(), kPartBytes - pending_.size());
      pending_.append(piece.substr(0, count));
      piece.remove_prefix(count);
    }
    return absl::OkStatus();
  }

  absl::Status End() {
    if (upload_.empty()) return bucket_.Put(key_, pending_);
    RILIEVO_RETURN_IF_ERROR(SendPart());
    return bucket_.EndParts(key_, upload_, tags_);
  }

  int64_t bytes() const { return bytes_; }
  std::string hash() const { return ContentName(hash_); }

 private:
  absl::Status SendPart() {
    if (upload_.empty()) {
      RILIEVO_ASSIGN_OR_RETURN(upload_, bucket_.BeginParts(key_));
      // Or its parts would stay where this process ends.
      RILIEVO_RETURN_IF_ERROR(Change(connections_->Take().get(),
                                     "UPDATE objects SET upload = $2 WHERE key = $1",
                                     {key_, upload_})
                                  .status());
    }
    if (tags_.size() == kMostParts) {
      return absl::ResourceExhaustedError("S3: an object has at most 10000 parts of 8 MiB");
    }
    RILIEVO_ASSIGN_OR_RETURN(
        std::string tag,
        bucket_.PutPart(key_, upload_, static_cast<int>(tags_.size()) + 1, pending_));
    tags_.push_back(std::move(tag));
    pending_.clear();
    return absl::OkStatus();
  }

  const S3Bucket& bucket_;
  Connections* const connections_;
  const std::string key_;
  std::string pending_;
  std::string upload_;  // its name; empty while nothing was sent
  std::vector<std::string> tags_;
  Sha256 hash_;
  int64_t bytes_ = 0;
};

}  // namespace

absl::StatusOr<std::unique_ptr<S3Blobs>> S3Blobs::Open(std::shared_ptr<Connections> connections,
                                                       const S3Place& place, std::string scratch) {
  std::unique_ptr<S3Blobs> blobs(new S3Blobs(std::move(connections), place, std::move(scratch)));
  const std::string probe = "probe-" + NewKey();
  RILIEVO_RETURN_IF_ERROR(blobs->bucket_.Put(probe, "rilievod looks whether it may write"));
  RILIEVO_RETURN_IF_ERROR(blobs->bucket_.Remove(probe));
  return blobs;
}

absl::StatusOr<std::unique_ptr<StagedBlob>> S3Blobs::StageFrom(const BlobSource& next) const {
  const std::string key = NewKey();
  {
    const auto connection = connections_->Take();
    const absl::Status noted = connection->TransactBesideOthers([&] {
      return Change(connection.get(),
                    "INSERT INTO objects(key, remove_after) VALUES($1, now() + interval '1 day')",
                    {key})
          .status();
    });
    RILIEVO_RETURN_IF_ERROR(noted);
  }
  ObjectWriter writer(bucket_, connections_.get(), key);
  const auto write = [&]() -> absl::Status {
    for (;;) {
      RILIEVO_ASSIGN_OR_RETURN(const std::string_view piece, next());
      if (piece.empty()) return writer.End();
      RILIEVO_RETURN_IF_ERROR(writer.Add(piece));
    }
  };
  const absl::Status written = write();
  // Its destructor has what was not written whole removed.
  auto staged = std::make_unique<StagedObject>(connections_, key, writer.hash(), writer.bytes());
  RILIEVO_RETURN_IF_ERROR(written);
  return staged;
}

absl::StatusOr<S3Blobs::Object> S3Blobs::Find(const std::string& name) const {
  const absl::Status none = absl::NotFoundError("no such blob is stored");
  if (!IsContentName(name)) return none;
  const auto connection = connections_->Take();
  RILIEVO_ASSIGN_OR_RETURN(Query query,
                           connection->Prepare("SELECT key, bytes FROM objects WHERE name = $1"));
  RILIEVO_ASSIGN_OR_RETURN(const bool found, query.Bind(name).Step());
  if (!found) return none;
  return Object{query.Bytes(0), query.Integer(1)};
}

absl::StatusOr<FileDescriptor> S3Blobs::Fetch(const std::string& name,
                                              const std::function<void()>& moved) const {
  absl::StatusOr<FileDescriptor> opened = UnnamedFile(scratch_);
  // NOT_FOUND would be said of the blob.
  if (!opened.ok()) return absl::UnavailableError(opened.status().message());
  FileDescriptor file = *std::move(opened);
  RILIEVO_ASSIGN_OR_RETURN(const Object object, Find(name));
  RILIEVO_RETURN_IF_ERROR(bucket_.Get(object.key, file, moved));
  return file;
}

absl::StatusOr<int64_t> S3Blobs::BytesOf(const std::string& name) const {
  RILIEVO_ASSIGN_OR_RETURN(const Object object, Find(name));
  return object.bytes;
}

absl::Status S3Blobs::LetGo(const std::string& name, const std::string& after) const {
  return Change(connections_->Take().get(),
                absl::StrCat("UPDATE objects SET name = NULL, was = $1, remove_after = now() +"
                             " interval '",
                             after, "' WHERE name = $1"),
                {name})
      .status();
}

// Whoever has just looked up its key may still read it.
absl::Status S3Blobs::Remove(const std::string& name) const { return LetGo(name, "1 minute"); }

absl::Status S3Blobs::SetAside(const std::string& name) const { return LetGo(name, "7 days"); }

absl::StatusOr<std::vector<FileEntry>> S3Blobs::List() const {
  const auto connection = connections_->Take();
  RILIEVO_ASSIGN_OR_RETURN(Query query,
                           connection->Prepare("SELECT name, bytes FROM objects WHERE name IS NOT"
                                               " NULL ORDER BY name"));
  std::vector<FileEntry> entries;
  for (;;) {
    RILIEVO_ASSIGN_OR_RETURN(const bool row, query.Step());
    if (!row) return entries;
    entries.push_back({.name = query.Bytes(0), .bytes = query.Integer(1)});
  }
}

absl::StatusOr<std::vector<S3Blobs::Leftover>> S3Blobs::TakeLeftovers() const {
  // Whoever puts the time off has them; another does after it where this one ends.
  const auto connection = connections_->Take();
  RILIEVO_ASSIGN_OR_RETURN(
      Query query,
      connection->Prepare(absl::StrCat(
          "UPDATE objects SET remove_after = now() + interval '2 minutes' WHERE key IN (SELECT key"
          " FROM objects WHERE remove_after < now() ORDER BY remove_after LIMIT ",
          kBatch, " FOR UPDATE SKIP LOCKED) RETURNING key, upload")));
  std::vector<Leftover> leftovers;
  for (;;) {
    RILIEVO_ASSIGN_OR_RETURN(const bool row, query.Step());
    if (!row) return leftovers;
    leftovers.push_back({query.Bytes(0), query.Bytes(1)});
  }
}

absl::Status S3Blobs::RemoveObjects(const std::vector<Leftover>& leftovers) const {
  std::mutex mutex;
  size_t next = 0;
  std::vector<std::string> removed;
  absl::Status status;
  const auto work = [&] {
    std::unique_lock lock(mutex);
    while (status.ok() && next < leftovers.size()) {
      const Leftover& leftover = leftovers[next++];
      lock.unlock();
      absl::Status done = leftover.upload.empty()
                              ? absl::OkStatus()
                              : bucket_.DropParts(leftover.key, leftover.upload);
      if (done.ok()) done = bucket_.Remove(leftover.key);
      lock.lock();
      if (done.ok()) removed.push_back(leftover.key);
      status.Update(done);
    }
  };
  {
    std::vector<std::jthread> others;
    while (others.size() + 1 < std::min(kRemovals, leftovers.size())) others.emplace_back(work);
    work();
  }
  if (removed.empty()) return status;
  std::string places = "$1";
  for (size_t i = 2; i <= removed.size(); ++i) absl::StrAppend(&places, ",$", i);
  status.Update(
      Change(connections_->Take().get(),
             absl::StrCat("DELETE FROM objects WHERE name IS NULL AND key IN (", places, ")"),
             removed)
          .status());
  return status;
}

absl::Status S3Blobs::Sweep() const {
  const auto end = std::chrono::steady_clock::now() + kSweep;
  for (;;) {
    RILIEVO_ASSIGN_OR_RETURN(const std::vector<Leftover> leftovers, TakeLeftovers());
    RILIEVO_RETURN_IF_ERROR(RemoveObjects(leftovers));
    if (leftovers.size() < kBatch || std::chrono::steady_clock::now() > end) {
      return absl::OkStatus();
    }
  }
}

}  // namespace rilievo
