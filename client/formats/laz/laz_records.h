// The points of a LAZ file as records of LAS.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "client/formats/byte_source.h"
#include "client/formats/las_header.h"
#include "client/formats/laz/layered_chunk.h"
#include "client/formats/laz/laz_parameters.h"
#include "client/formats/laz/pointwise_chunk.h"
#include "client/formats/point_layers.h"

namespace rilievo::laz {

// LASzip of 2011 and later, versions 2 to 4 of its items; all point formats, and so COPC (copc.io),
// which is LAZ in an order of its own. Chunks end by themselves, so that a pipe will do; only the
// chunks of different sizes of the formats 0 to 5 need the table at the end, and the rest of the
// file in memory.
class LazRecords {
 public:
  // `source`, which stands at the first point, and `header` must outlive this; `laszip`: the record
  // of LASzip. Errors of ReadLazParameters() and ReadChunkTable().
  static absl::StatusOr<std::unique_ptr<LazRecords>> Open(ByteSource* source,
                                                          const LasHeader& header,
                                                          const std::optional<std::string>& laszip,
                                                          const WantedLayers& wanted);

  // The next of header.point_count records, valid until the next call, or nullptr: see status().
  // Its x, y, z, returns and flags are those of the point, and of intensity, classes, colours and,
  // for a trajectory, times what is wanted; the other bytes are without meaning.
  const char* Next();

  // DATA_LOSS, with the chunk and the point, where the file is cut off or damaged;
  // INVALID_ARGUMENT where a few bytes claim to hold very many points.
  const absl::Status& status() const { return status_; }

  // After the last record: DATA_LOSS where the chunks do not end at the table behind them.
  absl::Status CheckEnd() const;

 private:
  LazRecords(ByteSource* source, const LasHeader& header, const WantedLayers& wanted,
             const LazParameters& parameters);

  absl::Status ReadTable();
  absl::Status BeginChunk();
  absl::Status EndChunk();
  absl::Status BeginPointwiseChunk();
  absl::Status BeginLayeredChunk();
  absl::Status CheckExpansion() const;
  absl::Status Lost(absl::string_view what) const;

  ByteSource* const source_;
  const LasHeader& header_;
  const WantedLayers wanted_;
  const LazParameters parameters_;
  int64_t table_ = 0;                   // where the file says that its chunk table is
  std::vector<uint32_t> chunk_points_;  // of that table, where it was needed

  std::vector<char> record_;
  std::optional<PointwiseChunk> pointwise_;
  std::unique_ptr<LayeredChunk> layered_;
  uint64_t delivered_ = 0;      // points
  uint64_t chunks_ = 0;         // begun
  uint64_t left_in_chunk_ = 0;  // points
  absl::Status status_;
};

}  // namespace rilievo::laz
