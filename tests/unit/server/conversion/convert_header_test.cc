#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstring>
#include <functional>
#include <limits>

#include "server/conversion/job_request.h"

namespace rilievo {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

v1::ReconstructHeader ValidHeader() {
  v1::ReconstructHeader header;
  header.set_point_count(1000);
  header.set_coordinate_format(v1::COORDINATE_FORMAT_FLOAT32_LE);
  return header;
}

// The fields at fault, in order.
std::vector<std::string> Faults(const v1::ReconstructHeader& header,
                                const ServerOptions& limits = {}) {
  const auto parsed = ParseHeader(header, limits);
  std::vector<std::string> fields;
  if (const auto* error = std::get_if<CallError>(&parsed)) {
    EXPECT_EQ(error->code(), absl::StatusCode::kInvalidArgument);
    for (const auto& violation : error->violations) {
      EXPECT_FALSE(violation.description.empty());
      fields.push_back(violation.field);
    }
    EXPECT_FALSE(fields.empty());
  }
  return fields;
}

JobRequest Parse(const v1::ReconstructHeader& header, const ServerOptions& limits = {}) {
  auto parsed = ParseHeader(header, limits);
  EXPECT_TRUE(std::holds_alternative<JobRequest>(parsed)) << std::get<CallError>(parsed).message;
  return std::get<JobRequest>(std::move(parsed));
}

// A tetrahedron as the protocol writes it.
v1::ControlMesh Tetrahedron() {
  const double positions[12] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1};
  v1::ControlMesh mesh;
  mesh.set_positions(positions, sizeof(positions));
  for (const uint32_t v : {0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3}) mesh.add_faces(v);
  return mesh;
}

TEST(ParseHeader, EmptyOptionsAreTheCoresDefaults) {
  const JobRequest request = Parse(ValidHeader());
  const ReconstructOptions defaults;
  EXPECT_EQ(request.size.points, 1000);
  EXPECT_EQ(request.size.layout.coordinates, CoordinateType::kFloat32);
  EXPECT_EQ(request.options.max_level, std::nullopt);
  EXPECT_EQ(request.options.measure, true);
  EXPECT_EQ(request.options.control.topology, Topology::kAuto);
  EXPECT_EQ(request.options.control.boundary, BoundaryRule::kKeep);
  EXPECT_EQ(request.options.control.creases, CreaseRule::kAuto);
  EXPECT_EQ(request.options.control.target_faces, defaults.control.target_faces);
  EXPECT_EQ(request.options.fit.method, defaults.fit.method);
  EXPECT_EQ(request.options.fit.rounds, defaults.fit.rounds);
  EXPECT_EQ(request.options.displacement.max_height, defaults.displacement.max_height);
  EXPECT_EQ(request.options.encode.height_step, defaults.encode.height_step);
  EXPECT_GE(request.threads, 1);
}

TEST(ParseHeader, EveryFieldReachesItsTarget) {
  v1::ReconstructHeader header = ValidHeader();
  header.set_coordinate_format(v1::COORDINATE_FORMAT_FLOAT64_LE);
  auto* options = header.mutable_options();
  options->set_max_level(0);
  options->set_threads(1);
  options->set_seed(77);
  options->set_measure(false);
  options->mutable_scan()->set_duplicate_distance_ratio(0.001);
  options->mutable_scan()->set_neighbors(20);
  options->mutable_scan()->set_outlier_distance_factor(0);
  options->mutable_scan()->set_min_component_share(0.05);
  options->mutable_control()->set_topology(v1::TOPOLOGY_SPHERICAL);
  options->mutable_control()->set_boundary(v1::BOUNDARY_CLOSE);
  options->mutable_control()->set_creases(v1::CREASES_OFF);
  options->mutable_control()->set_control_faces(500);
  options->mutable_control()->set_close_holes_below_ratio(0.75);
  options->mutable_fit()->set_method(v1::FIT_METHOD_SUZUKI);
  options->mutable_fit()->set_suzuki_rounds(9);
  options->mutable_fit()->set_suzuki_lambda(0.5);
  options->mutable_fit()->set_rounds(6);
  options->mutable_fit()->set_sample_level(3);
  options->mutable_fit()->set_tangential_weight(0.25);
  options->mutable_fit()->set_fairness_start(0.125);
  options->mutable_fit()->set_fairness_end(0.0625);
  options->mutable_fit()->set_robust_spacings(1.5);
  options->mutable_displacement()->set_max_height_ratio(0.1);
  options->mutable_displacement()->set_min_normal_agreement(-1);
  options->mutable_encode()->set_height_step_ratio(1e-4);
  options->mutable_encode()->set_position_step_ratio(1e-5);

  const JobRequest request = Parse(header);
  EXPECT_EQ(request.size.layout.coordinates, CoordinateType::kFloat64);
  EXPECT_EQ(request.threads, 1);
  EXPECT_EQ(request.seed, 77u);
  const ReconstructOptions& parsed = request.options;
  EXPECT_EQ(parsed.max_level, 0);
  EXPECT_FALSE(parsed.measure);
  EXPECT_EQ(parsed.check.duplicate_distance, 0.001);
  EXPECT_EQ(parsed.scan.neighbors.k, 20);
  EXPECT_EQ(parsed.scan.outliers.distance_factor, 0);
  EXPECT_EQ(parsed.scan.outliers.min_component_share, 0.05);
  EXPECT_EQ(parsed.control.topology, Topology::kSpherical);
  EXPECT_EQ(parsed.control.boundary, BoundaryRule::kClose);
  EXPECT_EQ(parsed.control.creases, CreaseRule::kOff);
  EXPECT_EQ(parsed.control.target_faces, 500);
  EXPECT_EQ(parsed.control.close_holes_below, 0.75);
  EXPECT_EQ(parsed.fit.method, FitMethod::kSuzuki);
  EXPECT_EQ(parsed.fit.suzuki_rounds, 9);
  EXPECT_EQ(parsed.fit.suzuki_lambda, 0.5);
  EXPECT_EQ(parsed.fit.rounds, 6);
  EXPECT_EQ(parsed.fit.sample_level, 3);
  EXPECT_EQ(parsed.fit.tangential_weight, 0.25);
  EXPECT_EQ(parsed.fit.fairness_start, 0.125);
  EXPECT_EQ(parsed.fit.fairness_end, 0.0625);
  EXPECT_EQ(parsed.fit.robust_spacings, 1.5);
  EXPECT_EQ(parsed.displacement.max_height, 0.1);
  EXPECT_EQ(parsed.displacement.min_normal_agreement, -1);
  EXPECT_EQ(parsed.encode.height_step, 1e-4);
  EXPECT_EQ(parsed.encode.position_step, 1e-5);
}

TEST(ParseHeader, NamesEachFieldOutOfRange) {
  using Options = v1::ReconstructOptions;
  const std::vector<std::pair<std::string, std::function<void(Options*)>>> cases = {
      {"max_level", [](Options* o) { o->set_max_level(9); }},
      {"threads", [](Options* o) { o->set_threads(1025); }},
      {"scan.duplicate_distance_ratio",
       [](Options* o) { o->mutable_scan()->set_duplicate_distance_ratio(0.011); }},
      {"scan.neighbors", [](Options* o) { o->mutable_scan()->set_neighbors(5); }},
      {"scan.outlier_distance_factor",
       [](Options* o) { o->mutable_scan()->set_outlier_distance_factor(1.4); }},
      {"scan.min_component_share",
       [](Options* o) { o->mutable_scan()->set_min_component_share(-0.1); }},
      {"control.topology",
       [](Options* o) { o->mutable_control()->set_topology(static_cast<v1::Topology>(99)); }},
      {"control.creases",
       [](Options* o) { o->mutable_control()->set_creases(static_cast<v1::Creases>(7)); }},
      {"control.boundary",
       [](Options* o) { o->mutable_control()->set_boundary(static_cast<v1::Boundary>(-1)); }},
      // Of a mesh alone.
      {"control.boundary",
       [](Options* o) { o->mutable_control()->set_boundary(v1::BOUNDARY_EXACT); }},
      {"control.control_faces",
       [](Options* o) { o->mutable_control()->set_control_faces(200001); }},
      {"control.close_holes_below_ratio",
       [](Options* o) { o->mutable_control()->set_close_holes_below_ratio(101); }},
      {"control.bridge_gaps_below_ratio",
       [](Options* o) { o->mutable_control()->set_bridge_gaps_below_ratio(1.5); }},
      {"fit.method",
       [](Options* o) { o->mutable_fit()->set_method(static_cast<v1::FitMethod>(3)); }},
      {"fit.suzuki_rounds", [](Options* o) { o->mutable_fit()->set_suzuki_rounds(51); }},
      {"fit.suzuki_lambda", [](Options* o) { o->mutable_fit()->set_suzuki_lambda(0); }},
      {"fit.rounds", [](Options* o) { o->mutable_fit()->set_rounds(0); }},
      {"fit.sample_level", [](Options* o) { o->mutable_fit()->set_sample_level(5); }},
      {"fit.tangential_weight", [](Options* o) { o->mutable_fit()->set_tangential_weight(kNan); }},
      {"fit.fairness_start", [](Options* o) { o->mutable_fit()->set_fairness_start(-1e-9); }},
      {"fit.fairness_end", [](Options* o) { o->mutable_fit()->set_fairness_end(kNan); }},
      {"fit.robust_spacings", [](Options* o) { o->mutable_fit()->set_robust_spacings(0); }},
      {"displacement.max_height_ratio",
       [](Options* o) { o->mutable_displacement()->set_max_height_ratio(0.51); }},
      {"displacement.min_normal_agreement",
       [](Options* o) { o->mutable_displacement()->set_min_normal_agreement(1); }},
      {"encode.height_step_ratio",
       [](Options* o) { o->mutable_encode()->set_height_step_ratio(0); }},
      {"encode.position_step_ratio",
       [](Options* o) { o->mutable_encode()->set_position_step_ratio(0.02); }},
      {"encode.max_error_length",
       [](Options* o) { o->mutable_encode()->set_max_error_length(-1); }},
      {"place.metres_per_unit", [](Options* o) { o->mutable_place()->set_metres_per_unit(0); }},
      {"place.up", [](Options* o) { o->mutable_place()->set_up(static_cast<v1::UpDirection>(7)); }},
      {"place.crs", [](Options* o) { o->mutable_place()->set_crs(std::string(65536, ' ')); }},
  };
  v1::ReconstructHeader all = ValidHeader();
  for (const auto& [field, change] : cases) {
    v1::ReconstructHeader header = ValidHeader();
    change(header.mutable_options());
    EXPECT_THAT(Faults(header), testing::ElementsAre("header.options." + field));
    change(all.mutable_options());
  }
  // Two goals of the file exclude each other, which is one fault more.
  EXPECT_EQ(Faults(all).size(), cases.size() + 1) << "all faults are told at once";
}

TEST(ParseHeader, EndsOfTheRangesPassTheCoresOwnChecks) {
  v1::ReconstructHeader low = ValidHeader(), high = ValidHeader();
  const auto fill = [](v1::ReconstructOptions* o, bool top) {
    o->set_max_level(top ? 8 : 0);
    o->mutable_scan()->set_duplicate_distance_ratio(top ? 0.01 : 0);
    o->mutable_scan()->set_neighbors(top ? 64 : 6);
    o->mutable_scan()->set_outlier_distance_factor(top ? 1000 : 0);
    o->mutable_scan()->set_min_component_share(top ? 0.1 : 0);
    o->mutable_control()->set_control_faces(top ? 200 : 0);
    o->mutable_control()->set_close_holes_below_ratio(top ? 100 : 1e-6);
    o->mutable_control()->set_bridge_gaps_below_ratio(top ? 1 : 1e-6);
    o->mutable_fit()->set_suzuki_rounds(top ? 50 : 0);
    o->mutable_fit()->set_suzuki_lambda(top ? 1 : 1e-6);
    o->mutable_fit()->set_rounds(top ? 50 : 1);
    o->mutable_fit()->set_sample_level(top ? 4 : 0);
    o->mutable_fit()->set_tangential_weight(top ? 1 : 0);
    o->mutable_fit()->set_fairness_start(top ? 1000 : 0);
    o->mutable_fit()->set_fairness_end(top ? 1000 : 0);
    o->mutable_fit()->set_robust_spacings(top ? 1000 : 1e-3);
    o->mutable_displacement()->set_max_height_ratio(top ? 0.5 : 1e-6);
    o->mutable_displacement()->set_min_normal_agreement(top ? 0.999 : -1);
    o->mutable_encode()->set_height_step_ratio(top ? 0.01 : 1e-9);
    o->mutable_encode()->set_position_step_ratio(top ? 0.01 : 1e-9);
  };
  fill(low.mutable_options(), false);
  fill(high.mutable_options(), true);
  EXPECT_TRUE(Parse(low).options.Validate().ok()) << Parse(low).options.Validate();
  EXPECT_TRUE(Parse(high).options.Validate().ok()) << Parse(high).options.Validate();
}

TEST(ParseHeader, OnlyOneGoalOfTheFileIsTaken) {
  v1::ReconstructHeader header = ValidHeader();
  header.mutable_options()->mutable_encode()->set_max_error_ratio(1e-3);
  EXPECT_EQ(Parse(header).options.encode.max_error, 1e-3);
  header.mutable_options()->mutable_encode()->set_max_error_ratio(0.2);
  EXPECT_THAT(Faults(header), testing::ElementsAre("header.options.encode.max_error_ratio"));
  header.mutable_options()->mutable_encode()->set_max_error_ratio(1e-3);
  header.mutable_options()->mutable_encode()->set_max_bytes(10000);
  EXPECT_THAT(Faults(header), testing::ElementsAre("header.options.encode.max_error_ratio"));
}

TEST(ParseHeader, LengthsAndThePlaceAreTaken) {
  v1::ReconstructHeader header = ValidHeader();
  v1::EncodeOptions& encode = *header.mutable_options()->mutable_encode();
  v1::ScanPlace& place = *header.mutable_options()->mutable_place();
  encode.set_max_error_length(0.02);
  place.set_metres_per_unit(0.001);
  place.set_up(v1::UP_DIRECTION_MINUS_Y);
  place.set_crs("EPSG:25832");
  const ReconstructOptions options = Parse(header).options;
  EXPECT_EQ(options.lengths.max_error, 0.02);
  EXPECT_FALSE(options.encode.max_error);
  v1::ControlOptions& control = *header.mutable_options()->mutable_control();
  control.set_close_holes_below_length(12);
  EXPECT_EQ(Parse(header).options.lengths.close_holes_below, 12);
  control.set_close_holes_below_ratio(0.5);
  EXPECT_THAT(Faults(header),
              testing::ElementsAre("header.options.control.close_holes_below_length"));
  control.Clear();
  control.set_bridge_gaps_below_length(3);
  EXPECT_EQ(Parse(header).options.lengths.bridge_gaps_below, 3);
  control.set_bridge_gaps_below_ratio(0.5);
  EXPECT_THAT(Faults(header),
              testing::ElementsAre("header.options.control.bridge_gaps_below_length"));
  control.Clear();
  EXPECT_EQ(options.place, (ScanPlace{0.001, UpDirection::kMinusY, "EPSG:25832"}));
  encode.set_max_error_ratio(0.01);
  EXPECT_THAT(Faults(header), testing::ElementsAre("header.options.encode.max_error_length"));
  encode.clear_max_error_ratio();
  encode.set_height_step_length(0.01);
  EXPECT_THAT(Faults(header), testing::ElementsAre("header.options.encode.max_error_length"));
}

TEST(ParseHeader, ScanSizeIsCheckedAgainstTheLimits) {
  ServerOptions limits;
  limits.max_points = 5000;
  limits.max_scan_bytes = 24000;
  v1::ReconstructHeader header = ValidHeader();
  header.set_point_count(19);
  EXPECT_THAT(Faults(header, limits), testing::ElementsAre("header.point_count"));
  header.set_point_count(20);
  EXPECT_THAT(Faults(header, limits), IsEmpty());
  header.set_point_count(2000);
  EXPECT_THAT(Faults(header, limits), IsEmpty());
  header.set_point_count(2001);
  EXPECT_THAT(Faults(header, limits), testing::ElementsAre("header.point_count"));
  header.set_coordinate_format(v1::COORDINATE_FORMAT_FLOAT64_LE);
  header.set_point_count(1001);
  EXPECT_THAT(Faults(header, limits), testing::ElementsAre("header.point_count"));
  for (const uint64_t huge : {uint64_t{4'000'000'000}, uint64_t{1} << 60, ~uint64_t{0}}) {
    header.set_point_count(huge);
    const auto parsed = ParseHeader(header, limits);
    ASSERT_TRUE(std::holds_alternative<CallError>(parsed));
    EXPECT_EQ(std::get<CallError>(parsed).reason, ErrorCause::kLimitExceeded);
    EXPECT_EQ(std::get<CallError>(parsed).metadata.at("limit"), "1000");
    EXPECT_EQ(std::get<CallError>(parsed).metadata.at("value"), std::to_string(huge));
    EXPECT_THAT(std::get<CallError>(parsed).message, HasSubstr("at most 1000"));
  }
  header.set_point_count(1000);
  header.set_coordinate_format(v1::COORDINATE_FORMAT_UNSPECIFIED);
  EXPECT_THAT(Faults(header, limits), testing::ElementsAre("header.coordinate_format"));
}

TEST(ParseHeader, SurfaceSizeIsCheckedAgainstTheLimit) {
  ServerOptions limits;
  limits.max_surface_faces = 1024;
  v1::ReconstructHeader header = ValidHeader();
  header.mutable_options()->mutable_control()->set_control_faces(64);
  header.mutable_options()->set_max_level(2);
  EXPECT_THAT(Faults(header, limits), IsEmpty());
  header.mutable_options()->set_max_level(3);
  EXPECT_THAT(Faults(header, limits), testing::ElementsAre("header.options.max_level"));
  // Left out: as many faces as the control stage would choose for so many points.
  header = ValidHeader();
  limits = {};
  header.mutable_options()->set_max_level(8);
  EXPECT_THAT(Faults(header, limits), IsEmpty());
  header.set_point_count(1'000'000);
  EXPECT_THAT(Faults(header, limits), testing::ElementsAre("header.options.max_level"));
  header.mutable_options()->set_max_level(5);
  EXPECT_THAT(Faults(header, limits), IsEmpty());
}

TEST(ParseHeader, ThreadsAreCappedAndZeroMeansAllowed) {
  ServerOptions limits;
  limits.threads = 3;
  v1::ReconstructHeader header = ValidHeader();
  EXPECT_EQ(Parse(header, limits).threads, 3);
  header.mutable_options()->set_threads(0);
  EXPECT_EQ(Parse(header, limits).threads, 3);
  header.mutable_options()->set_threads(2);
  EXPECT_EQ(Parse(header, limits).threads, 2);
  header.mutable_options()->set_threads(64);
  EXPECT_EQ(Parse(header, limits).threads, 3);
}

TEST(ParseHeader, ControlMeshArrivesAsItWasSent) {
  v1::ReconstructHeader header = ValidHeader();
  *header.mutable_options()->mutable_control()->mutable_control_mesh() = Tetrahedron();
  const JobRequest request = Parse(header);
  EXPECT_EQ(request.options.control.topology, Topology::kUser);
  ASSERT_TRUE(request.options.control.user_mesh.has_value());
  const ControlMesh& mesh = *request.options.control.user_mesh;
  ASSERT_EQ(mesh.vertices.cols(), 4);
  ASSERT_EQ(mesh.faces.cols(), 4);
  EXPECT_EQ(mesh.vertices.col(1), Eigen::Vector3d(1, 0, 0));
  EXPECT_EQ(mesh.faces.col(3), Eigen::Vector3i(1, 2, 3));
}

TEST(ParseHeader, TagsOfAControlMeshAreSortedAndEachThereOnce) {
  v1::ReconstructHeader header = ValidHeader();
  v1::ControlMesh* mesh = header.mutable_options()->mutable_control()->mutable_control_mesh();
  *mesh = Tetrahedron();
  for (const uint32_t end : {3, 1, 0, 2, 1, 3}) mesh->add_creases(end);
  for (const uint32_t corner : {2, 0, 2}) mesh->add_corners(corner);
  EXPECT_EQ(Parse(header).options.control.user_mesh->creases,
            (std::vector<Crease>{{0, 2, kInfiniteSharpness}, {1, 3, kInfiniteSharpness}}));
  for (const float sharpness : {1.5f, 2.0f, 3.0f}) mesh->add_sharpness(sharpness);
  const JobRequest request = Parse(header);
  EXPECT_EQ(request.options.control.user_mesh->creases,
            (std::vector<Crease>{{0, 2, 2.0f}, {1, 3, 1.5f}}));
  EXPECT_EQ(request.options.control.user_mesh->corners, (std::vector<int>{0, 2}));
}

TEST(ParseHeader, ControlMeshFaultsAreNamed) {
  const auto faults = [](const std::function<void(v1::ControlOptions*)>& change) {
    v1::ReconstructHeader header = ValidHeader();
    auto* control = header.mutable_options()->mutable_control();
    *control->mutable_control_mesh() = Tetrahedron();
    change(control);
    return Faults(header);
  };
  using testing::ElementsAre;
  const std::string mesh = "header.options.control.control_mesh";
  EXPECT_THAT(faults([](auto*) {}), IsEmpty());
  EXPECT_THAT(faults([](auto* c) { c->mutable_control_mesh()->mutable_positions()->pop_back(); }),
              ElementsAre(mesh + ".positions"));
  EXPECT_THAT(faults([](auto* c) { c->mutable_control_mesh()->clear_positions(); }),
              ElementsAre(mesh + ".positions"));
  EXPECT_THAT(faults([](auto* c) { c->mutable_control_mesh()->add_faces(0); }),
              ElementsAre(mesh + ".faces"));
  EXPECT_THAT(faults([](auto* c) { c->mutable_control_mesh()->set_faces(4, 4); }),
              ElementsAre(mesh + ".faces"));
  EXPECT_THAT(faults([](auto* c) { c->mutable_control_mesh()->set_faces(4, 4294967295u); }),
              ElementsAre(mesh + ".faces"));
  EXPECT_THAT(faults([](auto* c) {
                std::memcpy(c->mutable_control_mesh()->mutable_positions()->data(), &kNan, 8);
              }),
              ElementsAre(mesh + ".positions"));
  EXPECT_THAT(faults([](auto* c) { c->mutable_control_mesh()->add_creases(0); }),
              ElementsAre(mesh + ".creases"));
  EXPECT_THAT(faults([](auto* c) { c->mutable_control_mesh()->add_sharpness(1); }),
              ElementsAre(mesh + ".sharpness"));
  EXPECT_THAT(faults([](auto* c) { c->mutable_control_mesh()->add_corners(4); }),
              ElementsAre(mesh + ".corners"));
  EXPECT_THAT(faults([](auto* c) {
                for (const uint32_t end : {0, 1}) c->mutable_control_mesh()->add_creases(end);
                c->mutable_control_mesh()->add_sharpness(0);
              }),
              ElementsAre(mesh + ".sharpness"));
  EXPECT_THAT(faults([](auto* c) { c->set_topology(v1::TOPOLOGY_PLANAR); }),
              ElementsAre("header.options.control.topology"));
  EXPECT_THAT(faults([](auto* c) {
                c->clear_control_mesh();
                c->set_topology(v1::TOPOLOGY_GIVEN);
              }),
              ElementsAre("header.options.control.control_mesh"));
  EXPECT_THAT(faults([](auto* c) {
                for (int i = 0; i < 3 * (kMaxControlFaces + 1); ++i) {
                  c->mutable_control_mesh()->add_faces(static_cast<uint32_t>(i % 3));
                }
              }),
              ElementsAre(mesh + ".faces"));
}

TEST(ParseHeader, StationsAndNormalsReachTheirTarget) {
  v1::ReconstructHeader header = ValidHeader();
  const double places[6] = {1, 2, 3, 0.1, -5, 1e6};
  header.set_stations(places, sizeof(places));
  header.set_normals(true);
  header.mutable_options()->mutable_scan()->set_stations(v1::SIGHT_RULE_USE);
  header.mutable_options()->mutable_scan()->set_normals(v1::SIGHT_RULE_IGNORE);
  const JobRequest request = Parse(header);
  EXPECT_EQ(request.size.layout.bytes(), 12 + 2 + 12);
  header.set_colors(true);
  EXPECT_EQ(Parse(header).size.layout.bytes(), 12 + 2 + 12 + 3);
  ASSERT_EQ(request.stations.cols(), 2);
  EXPECT_EQ(request.stations(2, 1), 1e6);
  EXPECT_EQ(request.options.scan.sights.stations, SightRule::kUse);
  EXPECT_EQ(request.options.scan.sights.normals, SightRule::kIgnore);
}

TEST(ParseHeader, StationsThatAreNoneAreRefused) {
  v1::ReconstructHeader header = ValidHeader();
  auto* scan = header.mutable_options()->mutable_scan();
  scan->set_stations(v1::SIGHT_RULE_USE);
  scan->set_normals(v1::SIGHT_RULE_USE);
  EXPECT_THAT(Faults(header),
              testing::ElementsAre("header.options.scan.stations", "header.options.scan.normals"));
  scan->set_stations(static_cast<v1::SightRule>(77));
  scan->clear_normals();
  EXPECT_THAT(Faults(header), testing::ElementsAre("header.options.scan.stations"));
  scan->clear_stations();
  header.set_stations("twelve bytes");
  EXPECT_THAT(Faults(header), testing::ElementsAre("header.stations"));
  std::vector<double> places(3 * (kMostStations + 1), 0.0);
  header.set_stations(places.data(), 8 * places.size());
  EXPECT_THAT(Faults(header), testing::ElementsAre("header.stations"));
  places[2] = kNan;
  header.set_stations(places.data(), 24);
  EXPECT_THAT(Faults(header), testing::ElementsAre("header.stations"));
}

}  // namespace
}  // namespace rilievo
