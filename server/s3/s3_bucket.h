// Objects of a bucket, by HTTP with AWS Signature Version 4.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "server/os/file_descriptor.h"
#include "server/s3/s3_place.h"

namespace rilievo {

// Thread-safe; each function waits for the network. What may pass (the store is away or busy) is
// tried again for a while and is UNAVAILABLE then, as are wrong credentials and a missing bucket,
// which an operator mends. NOT_FOUND: S3 itself says that there is no such object.
// RESOURCE_EXHAUSTED: the store has no room.
class S3Bucket {
 public:
  struct Patience {
    std::chrono::seconds retry{10};  // from the first attempt to the begin of the last one
    std::chrono::seconds stall{10};  // without a byte, before an attempt has failed
  };
  explicit S3Bucket(S3Place place) : S3Bucket(std::move(place), Patience()) {}
  S3Bucket(S3Place place, const Patience& patience);
  ~S3Bucket();

  // The answer comes when the store has the bytes for good. At most 5 GiB, as S3 has it.
  absl::Status Put(const std::string& key, std::string_view bytes) const;

  // Into `file`, which is emptied. Calls `moved`, if any, as bytes come.
  absl::Status Get(const std::string& key, const FileDescriptor& file,
                   const std::function<void()>& moved = {}) const;

  // OK also when there was none.
  absl::Status Remove(const std::string& key) const;

  // An object that comes in parts of at least 5 MiB, the last one aside: the name of the upload.
  absl::StatusOr<std::string> BeginParts(const std::string& key) const;
  // Parts are numbered from 1. Returns the tag that EndParts() wants, in their order.
  absl::StatusOr<std::string> PutPart(const std::string& key, const std::string& upload, int number,
                                      std::string_view bytes) const;
  // There is an object only from then on. OK also where an attempt before had made it, whose answer
  // was lost: `key` must be one that no object had. UNAVAILABLE when the parts are gone.
  absl::Status EndParts(const std::string& key, const std::string& upload,
                        const std::vector<std::string>& tags) const;
  // Gives the parts up. OK also when there are none.
  absl::Status DropParts(const std::string& key, const std::string& upload) const;

 private:
  struct Request;
  struct Answer;
  class Connection;

  // The answer of an attempt that was not refused; else why it was.
  absl::StatusOr<Answer> Ask(const Request& request) const;
  absl::StatusOr<Answer> AskOnce(const Request& request, bool* may_pass) const;
  std::unique_ptr<Connection> TakeConnection() const;
  void GiveBack(std::unique_ptr<Connection> connection) const;

  const S3Place place_;
  const Patience patience_;
  mutable std::mutex mutex_;
  mutable std::vector<std::unique_ptr<Connection>> idle_;
};

}  // namespace rilievo
