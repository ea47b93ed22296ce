#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <optional>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/control/build_control_mesh.h"
#include "core/control/settings.h"
#include "core/meshes/scan_of_mesh.h"
#include "server/conversion/convert_control_mesh.h"
#include "server/conversion/convert_place.h"
#include "server/conversion/job_request.h"
#include "server/conversion/option_reader.h"
#include "server/conversion/scan_size.h"

namespace rilievo {
namespace {

static_assert(std::endian::native == std::endian::little, "coordinates travel little-endian");

using Violations = std::vector<FieldViolation>;

constexpr int64_t kVertexBytes = 3 * sizeof(double);

// `given`: whether the scan has what the rule is of, the `things`.
void ReadSightRule(v1::SightRule from, bool given, const char* field, const char* things,
                   OptionReader* reader, SightRule* rule) {
  switch (from) {
    case v1::SIGHT_RULE_UNSPECIFIED:
    case v1::SIGHT_RULE_AUTO:
      *rule = SightRule::kAuto;
      return;
    case v1::SIGHT_RULE_USE:
      *rule = SightRule::kUse;
      if (!given) {
        reader->Violate(field, absl::StrCat("to be used, but the scan has no ", things,
                                            "; auto goes on without"));
      }
      return;
    case v1::SIGHT_RULE_IGNORE:
      *rule = SightRule::kIgnore;
      return;
    default:
      reader->Violate(field, absl::StrCat(from, " is not a SightRule"));
  }
}

void ReadScan(const v1::ReconstructHeader& header, CheckOptions* check, ScanOptions* scan,
              Violations* violations) {
  const v1::ScanOptions& from = header.options().scan();
  const bool has_stations = !header.stations().empty(), has_normals = header.normals();
  OptionReader reader("header.options.scan", violations);
  reader.Read("duplicate_distance_ratio", from.has_duplicate_distance_ratio(),
              from.duplicate_distance_ratio(), {0, 0.01}, &check->duplicate_distance);
  reader.Read("neighbors", from.has_neighbors(), from.neighbors(), {6, 64}, &scan->neighbors.k);
  // Zero switches the filter off and lies apart from the range.
  if (from.has_outlier_distance_factor() && from.outlier_distance_factor() == 0) {
    scan->outliers.distance_factor = 0;
  } else {
    reader.Read("outlier_distance_factor", from.has_outlier_distance_factor(),
                from.outlier_distance_factor(), {1.5, 1000}, &scan->outliers.distance_factor);
  }
  reader.Read("min_component_share", from.has_min_component_share(), from.min_component_share(),
              {0, 0.1}, &scan->outliers.min_component_share);
  ReadSightRule(from.stations(), has_stations, "stations", "stations", &reader,
                &scan->sights.stations);
  ReadSightRule(from.normals(), has_normals, "normals", "normals", &reader, &scan->sights.normals);
}

void ReadFit(const v1::FitOptions& from, FitOptions* fit, Violations* violations) {
  OptionReader reader("header.options.fit", violations);
  switch (from.method()) {
    case v1::FIT_METHOD_UNSPECIFIED:
      break;
    case v1::FIT_METHOD_LEAST_SQUARES:
      fit->method = FitMethod::kLeastSquares;
      break;
    case v1::FIT_METHOD_SUZUKI:
      fit->method = FitMethod::kSuzuki;
      break;
    default:
      reader.Violate("method", absl::StrCat(from.method(), " is no FitMethod"));
  }
  reader.Read("suzuki_rounds", from.has_suzuki_rounds(), from.suzuki_rounds(), {0, 50},
              &fit->suzuki_rounds);
  reader.Read("suzuki_lambda", from.has_suzuki_lambda(), from.suzuki_lambda(),
              {.low = 0, .high = 1, .low_open = true}, &fit->suzuki_lambda);
  reader.Read("rounds", from.has_rounds(), from.rounds(), {1, 50}, &fit->rounds);
  reader.Read("sample_level", from.has_sample_level(), from.sample_level(), {0, 4},
              &fit->sample_level);
  reader.Read("tangential_weight", from.has_tangential_weight(), from.tangential_weight(), {0, 1},
              &fit->tangential_weight);
  reader.Read("fairness_start", from.has_fairness_start(), from.fairness_start(), {0, 1000},
              &fit->fairness_start);
  reader.Read("fairness_end", from.has_fairness_end(), from.fairness_end(), {0, 1000},
              &fit->fairness_end);
  reader.Read("robust_spacings", from.has_robust_spacings(), from.robust_spacings(),
              {.low = 0, .high = 1000, .low_open = true}, &fit->robust_spacings);
}

void ReadDisplacement(const v1::DisplacementOptions& from, DisplacementOptions* displacement,
                      Violations* violations) {
  OptionReader reader("header.options.displacement", violations);
  reader.Read("max_height_ratio", from.has_max_height_ratio(), from.max_height_ratio(),
              {.low = 0, .high = 0.5, .low_open = true}, &displacement->max_height);
  reader.Read("min_normal_agreement", from.has_min_normal_agreement(), from.min_normal_agreement(),
              {.low = -1, .high = 1, .high_open = true}, &displacement->min_normal_agreement);
}

// Its share of the diagonal is looked at once the points are known.
constexpr Range kLength{.low = 0, .high = 1e300, .low_open = true};

void ReadEncode(const v1::EncodeOptions& from, EncodeOptions* encode, OptionLengths* lengths,
                Violations* violations) {
  OptionReader reader("header.options.encode", violations);
  const Range step{.low = 0, .high = 0.01, .low_open = true};
  reader.Read("height_step_ratio", from.has_height_step_ratio(), from.height_step_ratio(), step,
              &encode->height_step);
  reader.Read("position_step_ratio", from.has_position_step_ratio(), from.position_step_ratio(),
              step, &encode->position_step);
  reader.Read("max_error_ratio", from.has_max_error_ratio(), from.max_error_ratio(), {1e-6, 0.1},
              &encode->max_error);
  reader.Read("max_bytes", from.has_max_bytes(), from.max_bytes(), {1, 1e15}, &encode->max_bytes);
  reader.Read("max_error_length", from.has_max_error_length(), from.max_error_length(), kLength,
              &lengths->max_error);
  reader.Read("height_step_length", from.has_height_step_length(), from.height_step_length(),
              kLength, &lengths->height_step);
  if (from.has_height_step_ratio() + from.has_max_error_ratio() + from.has_max_bytes() +
          from.has_max_error_length() + from.has_height_step_length() >
      1) {
    reader.Violate(from.has_max_error_length() ? "max_error_length" : "max_error_ratio",
                   "only one of height_step_ratio, max_error_ratio, max_bytes, max_error_length "
                   "and height_step_length can be kept; leave the others out");
  }
}

void ReadStations(const v1::ReconstructHeader& header, JobRequest* request,
                  Violations* violations) {
  OptionReader reader("header", violations);
  const size_t bytes = header.stations().size();
  if (bytes % kVertexBytes != 0) {
    reader.Violate("stations", absl::StrCat(bytes, " bytes; whole places take 24 bytes each"));
    return;
  }
  request->stations.resize(3, static_cast<Eigen::Index>(bytes / kVertexBytes));
  if (bytes > 0) std::memcpy(request->stations.data(), header.stations().data(), bytes);
  if (request->stations.cols() > kMostStations) {
    reader.Violate("stations", absl::StrCat(request->stations.cols(), " places; at most ",
                                            kMostStations, " are taken, merge some of them"));
  }
  if (!request->stations.allFinite()) {
    reader.Violate("stations", "a coordinate is not finite; give the place or leave it out");
  }
}

// What a mesh does not have or settles itself, each a violation of its own.
void RefuseWhatIsOfScans(const v1::ReconstructHeader& header, Violations* violations) {
  OptionReader reader("header", violations);
  const v1::ControlOptions& control = header.options().control();
  const auto refuse = [&](bool given, const char* field, const std::string& why) {
    if (given) reader.Violate(field, absl::StrCat(why, "; leave it out"));
  };
  refuse(!header.stations().empty(), "stations",
         "set, but the sides of a mesh are those of its triangles");
  refuse(header.normals(), "normals", "true, but the normals of a mesh are those of its triangles");
  refuse(header.options().has_scan(), "options.scan", "set, but this is a mesh and not a scan");
  refuse(control.topology() != v1::TOPOLOGY_UNSPECIFIED && control.topology() != v1::TOPOLOGY_AUTO,
         "options.control.topology",
         absl::StrCat(v1::Topology_Name(control.topology()), ", but a mesh keeps its own"));
  refuse(control.boundary() == v1::BOUNDARY_CLOSE, "options.control.boundary",
         "BOUNDARY_CLOSE, but a mesh keeps its borders, which can be closed in it");
  refuse(control.has_control_mesh(), "options.control.control_mesh",
         "set, but that of a mesh is made from its triangles");
}

// Its control mesh stays, and so does all that was decided with it.
void RefuseWhatIsOfNewSurfaces(const v1::ReconstructHeader& header, Violations* violations) {
  OptionReader reader("header", violations);
  if (header.triangle_count() > 0) {
    reader.Violate("triangle_count",
                   "set, but a surface is brought up to date by points; leave it out");
  }
  v1::ReconstructOptions rest = header.options();
  rest.clear_threads();
  if (rest.ByteSizeLong() > 0) {
    reader.Violate("options",
                   "set, but a surface that is brought up to date keeps those it was made with; "
                   "leave out all but threads");
  }
}

void ReadTopology(const v1::ControlOptions& from, OptionReader* reader, Topology* topology) {
  const bool given = from.has_control_mesh();
  switch (from.topology()) {
    case v1::TOPOLOGY_UNSPECIFIED:
      *topology = given ? Topology::kUser : Topology::kAuto;
      return;
    case v1::TOPOLOGY_AUTO:
      *topology = Topology::kAuto;
      break;
    case v1::TOPOLOGY_PLANAR:
      *topology = Topology::kPlanar;
      break;
    case v1::TOPOLOGY_SPHERICAL:
      *topology = Topology::kSpherical;
      break;
    case v1::TOPOLOGY_ARBITRARY:
      *topology = Topology::kArbitrary;
      break;
    case v1::TOPOLOGY_GIVEN:
      *topology = Topology::kUser;
      if (!given) reader->Violate("control_mesh", "TOPOLOGY_GIVEN needs it; give a mesh");
      return;
    default:
      reader->Violate("topology", absl::StrCat(from.topology(), " is no Topology"));
      return;
  }
  if (given) {
    reader->Violate("topology", absl::StrCat(v1::Topology_Name(from.topology()),
                                             " makes its own control mesh; leave out one of the "
                                             "two"));
  }
}

void ReadControl(const v1::ControlOptions& from, ControlOptions* control, OptionLengths* lengths,
                 Violations* violations) {
  OptionReader reader("header.options.control", violations);
  switch (from.boundary()) {
    case v1::BOUNDARY_UNSPECIFIED:
      break;
    case v1::BOUNDARY_KEEP:
      control->boundary = BoundaryRule::kKeep;
      break;
    case v1::BOUNDARY_CLOSE:
      control->boundary = BoundaryRule::kClose;
      break;
    case v1::BOUNDARY_EXACT:
      control->boundary = BoundaryRule::kExact;
      break;
    default:
      reader.Violate("boundary", absl::StrCat(from.boundary(), " is no Boundary"));
  }
  switch (from.creases()) {
    case v1::CREASES_UNSPECIFIED:
      break;
    case v1::CREASES_AUTO:
      control->creases = CreaseRule::kAuto;
      break;
    case v1::CREASES_OFF:
      control->creases = CreaseRule::kOff;
      break;
    default:
      reader.Violate("creases", absl::StrCat(from.creases(), " is no Creases"));
  }
  switch (from.scheme()) {
    case v1::SCHEME_UNSPECIFIED:
      break;
    case v1::SCHEME_LOOP:
      control->scheme = DomainScheme::kLoop;
      break;
    case v1::SCHEME_CATMULL_CLARK:
      control->scheme = DomainScheme::kCatmullClark;
      break;
    default:
      reader.Violate("scheme", absl::StrCat(from.scheme(), " is no Scheme"));
  }
  reader.Read("control_faces", from.has_control_faces(), from.control_faces(), {0, 200000},
              &control->target_faces);
  reader.Read(
      "close_holes_below_ratio", from.has_close_holes_below_ratio(), from.close_holes_below_ratio(),
      {kControlOptions.shortest_rim, kControlOptions.longest_rim}, &control->close_holes_below);
  reader.Read("close_holes_below_length", from.has_close_holes_below_length(),
              from.close_holes_below_length(), kLength, &lengths->close_holes_below);
  if (from.has_close_holes_below_ratio() && from.has_close_holes_below_length()) {
    reader.Violate("close_holes_below_length",
                   "set, and close_holes_below_ratio too; leave one of the two out");
  }
  reader.Read(
      "bridge_gaps_below_ratio", from.has_bridge_gaps_below_ratio(), from.bridge_gaps_below_ratio(),
      {kControlOptions.narrowest_gap, kControlOptions.widest_gap}, &control->bridge_gaps_below);
  reader.Read("bridge_gaps_below_length", from.has_bridge_gaps_below_length(),
              from.bridge_gaps_below_length(), kLength, &lengths->bridge_gaps_below);
  if (from.has_bridge_gaps_below_ratio() && from.has_bridge_gaps_below_length()) {
    reader.Violate("bridge_gaps_below_length",
                   "set, and bridge_gaps_below_ratio too; leave one of the two out");
  }
}

// What a scan has or may ask for, and a mesh does not.
void ReadWhatIsOfScans(const v1::ReconstructHeader& header, JobRequest* request,
                       Violations* violations) {
  const v1::ControlOptions& control = header.options().control();
  OptionReader reader("header.options.control", violations);
  ReadStations(header, request, violations);
  ReadScan(header, &request->options.check, &request->options.scan, violations);
  ReadTopology(control, &reader, &request->options.control.topology);
  if (control.has_control_mesh()) {
    ReadControlMesh(control.control_mesh(), &request->options.control, violations);
  }
}

// Control faces times 4^level, where that is more than the server may build.
std::optional<Excess> CheckSurfaceSize(const JobRequest& request, const ServerOptions& limits,
                                       Violations* violations) {
  if (!request.options.max_level) return std::nullopt;
  const int level = *request.options.max_level;
  const int64_t faces = ExpectedControlFaces(request);
  if (faces <= limits.max_surface_faces >> (2 * level)) return std::nullopt;
  OptionReader("header.options", violations)
      .Violate("max_level", absl::StrCat(faces, " control faces at level ", level,
                                         " make more than the ", limits.max_surface_faces,
                                         " faces this server builds; lower one of the two"));
  return Excess{limits.max_surface_faces, static_cast<uint64_t>(faces) << (2 * level)};
}

}  // namespace

int64_t WorkedPoints(const JobRequest& request) {
  if (request.size.triangles == 0) return request.size.points;
  return request.options.max_level ? FewestPointsOnMesh(request.size.triangles) : kMostPointsOnMesh;
}

int64_t ExpectedControlFaces(const JobRequest& request) {
  const ControlOptions& control = request.options.control;
  if (control.user_mesh) return control.user_mesh->faces.cols();
  if (control.target_faces > 0) {
    return UsefulControlFaces(control.target_faces, WorkedPoints(request));
  }
  return DefaultControlFaces(WorkedPoints(request));
}

std::variant<JobRequest, CallError> ParseHeader(const v1::ReconstructHeader& header,
                                                const ServerOptions& limits) {
  JobRequest request;
  Violations violations;
  std::optional<Excess> over_limit = ReadScanSize(header, limits, &request, &violations);
  if (header.has_base_surface()) {
    RefuseWhatIsOfNewSurfaces(header, &violations);
    ReadStations(header, &request, &violations);
  } else if (header.triangle_count() == 0) {
    ReadWhatIsOfScans(header, &request, &violations);
    if (header.options().control().boundary() == v1::BOUNDARY_EXACT) {
      OptionReader("header.options.control", &violations)
          .Violate("boundary",
                   "BOUNDARY_EXACT, but the border of a scan is nowhere exact; leave it out");
    }
  } else {
    RefuseWhatIsOfScans(header, &violations);
  }

  const v1::ReconstructOptions& from = header.options();
  OptionReader reader("header.options", &violations);
  reader.Read("max_level", from.has_max_level(), from.max_level(), {0, 8},
              &request.options.max_level);
  int threads = 0;
  reader.Read("threads", from.has_threads(), from.threads(), {0, 1024}, &threads);
  request.threads = threads == 0 ? limits.ThreadLimit() : std::min(threads, limits.ThreadLimit());
  request.seed = from.seed();
  if (from.has_measure()) request.options.measure = from.measure();

  ReadControl(from.control(), &request.options.control, &request.options.lengths, &violations);
  ReadFit(from.fit(), &request.options.fit, &violations);
  ReadDisplacement(from.displacement(), &request.options.displacement, &violations);
  ReadEncode(from.encode(), &request.options.encode, &request.options.lengths, &violations);
  request.options.place = ReadPlace(from.place(), &violations);
  request.options.max_surface_faces =
      std::clamp<int64_t>(limits.max_surface_faces, 1, request.options.max_surface_faces);
  if (const auto excess = CheckSurfaceSize(request, limits, &violations); excess && !over_limit) {
    over_limit = excess;
  }

  if (violations.empty()) {
    request.header = header;
    return request;
  }
  if (!over_limit) return BadRequestError(std::move(violations));
  return BadRequestError(std::move(violations), ErrorCause::kLimitExceeded)
      .Limit(over_limit->limit, over_limit->value);
}

}  // namespace rilievo
