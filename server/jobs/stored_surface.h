// A surface in the store on its way out, one message at a time.
#pragma once

#include <cstdint>

#include "absl/status/statusor.h"
#include "rilievo/v1/jobs.pb.h"
#include "server/os/file_descriptor.h"

namespace rilievo {

class StoredSurface {
 public:
  // From byte `offset` of `file`, whose chunks `header` states. OUT_OF_RANGE when it has no such
  // byte.
  static absl::StatusOr<StoredSurface> From(FileDescriptor file, v1::SurfaceHeader header,
                                            uint64_t offset);

  // The next message: header, then pieces of at most 128 KiB that lie in one chunk. False at the
  // end. Waits for the disk.
  absl::StatusOr<bool> Next(v1::StreamSurfaceResponse* response);

 private:
  StoredSurface(FileDescriptor file, v1::SurfaceHeader header, uint64_t offset)
      : file_(std::move(file)), header_(std::move(header)), offset_(offset) {}

  FileDescriptor file_;
  v1::SurfaceHeader header_;
  bool header_sent_ = false;
  uint64_t offset_;
  int chunk_ = 0;
  uint64_t chunk_begin_ = 0;
};

// Where a request begins; OUT_OF_RANGE when the surface has no such chunk.
absl::StatusOr<uint64_t> FirstByte(const v1::StreamSurfaceRequest& request,
                                   const v1::SurfaceHeader& header);

}  // namespace rilievo
