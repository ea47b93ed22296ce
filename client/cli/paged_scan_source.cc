#include "client/cli/paged_scan_source.h"

#include <algorithm>
#include <cstdint>
#include <limits>
#include <utility>
#include <variant>

#include "client/cli/working_server.h"
#include "core/base/status_macros.h"
#include "core/paging/scan_pager.h"
#include "core/pipeline/reconstruct.h"
#include "server/conversion/call_error.h"
#include "server/conversion/job_report.h"
#include "server/conversion/job_request.h"

namespace rilievo {
namespace {

// Goes on without a word after an error, which is told at the end.
class PagingSink : public PointSink {
 public:
  explicit PagingSink(ScanPager* pager) : pager_(*pager) {}
  absl::Status Expect(uint64_t points) override {
    return pager_.Expect(static_cast<int64_t>(points));
  }
  void Take(const Eigen::Ref<const Eigen::Matrix3Xd>& points) override {
    if (status_.ok()) status_ = pager_.Add(points);
  }
  const absl::Status& status() const { return status_; }

 private:
  ScanPager& pager_;
  absl::Status status_;
};

}  // namespace

absl::StatusOr<PagedFile> LoadPaged(const std::string& path, const ScanArguments& arguments,
                                    const std::string& scratch_folder,
                                    const std::stop_token& stop) {
  RILIEVO_ASSIGN_OR_RETURN(ScanPager pager, ScanPager::Create(scratch_folder));
  PagingSink sink(&pager);
  WantedLayers wanted;
  wanted.sink = &sink;
  PagedFile paged;
  RILIEVO_ASSIGN_OR_RETURN(paged.file, LoadScan(path, arguments, wanted));
  RILIEVO_RETURN_IF_ERROR(sink.status());
  RunContext context;
  context.stop = stop;
  RILIEVO_ASSIGN_OR_RETURN(PagedScan scan, pager.Finish(context));
  paged.scan = std::make_shared<const PagedScan>(std::move(scan));
  return paged;
}

absl::StatusOr<ReconstructResult> ReconstructPages(
    const PagedScan& scan, const v1::ReconstructOptions& options,
    const std::function<void(const v1::Progress&)>& progress, const std::stop_token& stop) {
  v1::ReconstructHeader header;
  // That of the thinned scan is bounded; options do not depend on it.
  header.set_point_count(
      std::min<uint64_t>(static_cast<uint64_t>(scan.size()), std::numeric_limits<int32_t>::max()));
  header.set_coordinate_format(v1::COORDINATE_FORMAT_FLOAT64_LE);
  *header.mutable_options() = options;
  const auto parsed = ParseHeader(header, LimitsForOneself());
  if (const auto* error = std::get_if<CallError>(&parsed)) return StatusOf(*error);
  const auto& request = std::get<JobRequest>(parsed);
  RunContext context;
  context.stop = stop;
  context.threads = request.threads;
  context.seed = request.seed;
  context.progress = [&](const Progress& seen) {
    v1::Progress told;
    told.set_stage(ProtoStage(seen.stage));
    told.set_fraction(static_cast<float>(seen.fraction));
    progress(told);
  };
  RILIEVO_ASSIGN_OR_RETURN(const Reconstruction made,
                           ReconstructPaged(scan, PartSizes{}, request.options, context));
  ReconstructResult result;
  result.dss = made.encoded.Concatenate();
  for (const auto& chunk : made.encoded.chunks) {
    result.chunk_bytes.push_back(static_cast<int64_t>(chunk.size()));
  }
  result.report = ProtoReport(made.report, request.options.measure);
  return result;
}

}  // namespace rilievo
