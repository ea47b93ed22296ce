// A surface in the store on its way out, one message at a time.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "absl/status/statusor.h"
#include "core/base/sha256.h"
#include "rilievo/v1/jobs.pb.h"
#include "server/os/file_descriptor.h"

namespace rilievo {

class StoredSurface {
 public:
  // From byte `offset` of `file`, whose chunks `header` states and whose SHA-256 is `name`.
  // OUT_OF_RANGE when it has no such byte, DATA_LOSS when the file has another size.
  static absl::StatusOr<StoredSurface> From(FileDescriptor file, std::string name,
                                            v1::SurfaceHeader header, uint64_t offset);

  // The next message: header, then pieces of at most 128 KiB that lie in one chunk. False at the
  // end; there DATA_LOSS when it was read from its begin and is not what was stored. Waits for the
  // disk.
  absl::StatusOr<bool> Next(v1::StreamSurfaceResponse* response);

 private:
  StoredSurface(FileDescriptor file, std::string name, v1::SurfaceHeader header, uint64_t offset)
      : file_(std::move(file)),
        name_(std::move(name)),
        header_(std::move(header)),
        offset_(offset) {
    if (offset == 0) hash_.emplace();
  }

  FileDescriptor file_;
  std::string name_;
  std::optional<Sha256> hash_;
  v1::SurfaceHeader header_;
  bool header_sent_ = false;
  uint64_t offset_;
  int chunk_ = 0;
  uint64_t chunk_begin_ = 0;
};

// What a client is told of a surface that is lost or not what was stored.
absl::Status DamagedSurface();

// Where a request begins; OUT_OF_RANGE when the surface has no such chunk.
absl::StatusOr<uint64_t> FirstByte(const v1::StreamSurfaceRequest& request,
                                   const v1::SurfaceHeader& header);

}  // namespace rilievo
