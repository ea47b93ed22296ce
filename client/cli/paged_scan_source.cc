#include "client/cli/paged_scan_source.h"

#include <sys/stat.h>

#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <limits>
#include <optional>
#include <system_error>
#include <utility>
#include <variant>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "client/cli/working_server.h"
#include "core/base/status_macros.h"
#include "core/codec/bytes/saved_value.h"
#include "core/paging/parts_recipe.h"
#include "core/paging/scan_pager.h"
#include "core/pipeline/reconstruct.h"
#include "server/conversion/call_error.h"
#include "server/conversion/job_report.h"
#include "server/conversion/job_request.h"

namespace rilievo {
namespace {

class PagingSink : public PointSink {
 public:
  explicit PagingSink(ScanPager* pager) : pager_(*pager) {}
  absl::Status Expect(uint64_t points) override {
    return status_ = pager_.Expect(static_cast<int64_t>(points));
  }
  absl::Status Take(const Eigen::Ref<const Eigen::Matrix3Xd>& points) override {
    return status_ = pager_.Add(points);
  }
  const absl::Status& status() const { return status_; }

 private:
  ScanPager& pager_;
  absl::Status status_;
};

// Where temporary files go, as other programs have it; large ones may outlive no restart there.
std::string DefaultScratchFolder() {
  const char* folder = std::getenv("TMPDIR");
  return folder != nullptr && *folder != '\0' ? folder : "/var/tmp";
}

// All that pages, parts and bytes depend on: the file, told by its path, size and time of change,
// and what is asked for.
absl::StatusOr<std::string> IdentityOf(const std::string& path, const ScanArguments& arguments,
                                       const ReconstructArguments& options,
                                       const PartSizes& sizes) {
  struct stat file;
  if (stat(path.c_str(), &file) != 0) return absl::NotFoundError(absl::StrCat(path, ": not found"));
  std::error_code error;
  const std::string absolute = std::filesystem::absolute(path, error).string();
  RILIEVO_ASSIGN_OR_RETURN(v1::ReconstructOptions asked, OptionsFrom(options));
  asked.clear_threads();
  const PlaceArguments& place = options.place;
  return absl::StrJoin(
      {absl::StrCat("rilievo " RILIEVO_VERSION " ", kPartsRecipe), absolute,
       absl::StrCat(file.st_size), absl::StrCat(file.st_mtim.tv_sec, ".", file.st_mtim.tv_nsec),
       arguments.format, absl::StrJoin(arguments.classes, ","),
       absl::StrCat(arguments.last_returns), asked.SerializeAsString(), options.height_step,
       options.max_error, options.close_holes_below, options.bridge_gaps_below, place.unit,
       place.up, place.crs, absl::StrCat(sizes.part_points)},
      std::string(1, '\0'));
}

constexpr char kFileName[] = "file";

template <typename Archive, typename File>
void VisitFile(Archive& archive, File& file) {
  archive(file.format);
  archive(file.faces);
  archive(file.place.metres_per_unit);
  archive(file.place.up);
  archive(file.place.crs);
}

absl::StatusOr<bool> FindPaged(const RunContext& context, PagedFile* paged) {
  const ScratchFolder& folder = paged->kept->folder();
  const std::optional<std::vector<uint8_t>> saved = folder.Load(kFileName);
  if (!saved) return false;
  ValueReader reader(*saved);
  VisitFile(reader, paged->file);
  if (!reader.Finished()) return false;
  RILIEVO_ASSIGN_OR_RETURN(std::optional<PagedScan> scan, FindPagedScan(folder, context));
  if (scan) paged->scan = std::make_shared<const PagedScan>(*std::move(scan));
  return paged->scan != nullptr;
}

// The points of the file, to where `paged` has its files.
absl::Status ReadIntoPages(const std::string& path, const ScanArguments& arguments,
                           const ScratchFolder& folder, const RunContext& context,
                           PagedFile* paged) {
  RILIEVO_ASSIGN_OR_RETURN(ScanPager pager, ScanPager::Create(folder));
  PagingSink sink(&pager);
  WantedLayers wanted;
  wanted.sink = &sink;
  absl::StatusOr<ScanFile> file = LoadScan(path, arguments, wanted);
  RILIEVO_RETURN_IF_ERROR(sink.status());
  RILIEVO_ASSIGN_OR_RETURN(paged->file, std::move(file));
  RILIEVO_ASSIGN_OR_RETURN(PagedScan scan, pager.Finish(context));
  paged->scan = std::make_shared<const PagedScan>(std::move(scan));
  ValueWriter writer;
  VisitFile(writer, paged->file);
  return folder.Save(kFileName, writer.bytes);
}

}  // namespace

bool IsLasting(const absl::Status& status) {
  return absl::IsInvalidArgument(status) || absl::IsFailedPrecondition(status) ||
         absl::IsOutOfRange(status) || absl::IsUnimplemented(status);
}

absl::StatusOr<PagedFile> LoadPaged(const std::string& path, const ScanArguments& arguments,
                                    const ReconstructArguments& options,
                                    const ScratchArguments& scratch, const std::stop_token& stop) {
  RunContext context;
  context.stop = stop;
  PagedFile paged;
  ScratchFolder folder(scratch.folder.empty() ? DefaultScratchFolder() : scratch.folder);
  if (!scratch.folder.empty() && path != "-") {
    RILIEVO_ASSIGN_OR_RETURN(const std::string identity,
                             IdentityOf(path, arguments, options, scratch.sizes));
    RILIEVO_ASSIGN_OR_RETURN(KeptScratch kept, KeptScratch::Open(scratch.folder, identity));
    paged.kept = std::make_shared<KeptScratch>(std::move(kept));
    RILIEVO_ASSIGN_OR_RETURN(const bool found, FindPaged(context, &paged));
    if (found) return paged;
    // What was made of other pages, or of some that are damaged, goes with them.
    paged.kept->Remove();
    RILIEVO_ASSIGN_OR_RETURN(KeptScratch anew, KeptScratch::Open(scratch.folder, identity));
    paged.kept = std::make_shared<KeptScratch>(std::move(anew));
    folder = paged.kept->folder();
  }
  const absl::Status read = ReadIntoPages(path, arguments, folder, context, &paged);
  if (IsLasting(read) && paged.kept != nullptr) paged.kept->Remove();
  RILIEVO_RETURN_IF_ERROR(read);
  return paged;
}

absl::StatusOr<std::shared_ptr<const PagedScan>> PageScan(const std::string& path,
                                                          const ScanArguments& arguments,
                                                          const std::string& scratch,
                                                          const std::stop_token& stop) {
  RunContext context;
  context.stop = stop;
  PagedFile paged;
  const ScratchFolder folder(scratch.empty() ? DefaultScratchFolder() : scratch);
  RILIEVO_RETURN_IF_ERROR(ReadIntoPages(path, arguments, folder, context, &paged));
  return std::move(paged.scan);
}

absl::StatusOr<ReconstructResult> ReconstructPages(
    const PagedScan& scan, const PartSizes& sizes, const v1::ReconstructOptions& options,
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
                           ReconstructPaged(scan, sizes, request.options, context));
  ReconstructResult result;
  result.dss = made.encoded.Concatenate();
  for (const auto& chunk : made.encoded.chunks) {
    result.chunk_bytes.push_back(static_cast<int64_t>(chunk.size()));
  }
  result.report = ProtoReport(made.report, request.options.measure);
  return result;
}

}  // namespace rilievo
