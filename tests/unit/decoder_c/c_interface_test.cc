// The C interface against the C++ library it stands for, and against everything C can do wrong.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <thread>
#include <vector>

#include "client/decoder_c/rilievo_decoder.h"
#include "core/codec/container/dss.h"
#include "core/surface/adaptive_tessellation.h"
#include "core/surface/displaced_surface.h"
#include "tests/unit/decoder_c/c_objects.h"

namespace rilievo {
namespace {

using testing::HasSubstr;

template <typename T, typename Matrix>
void ExpectSame(const std::vector<T>& c, const Matrix& cpp) {
  ASSERT_EQ(c.size(), static_cast<size_t>(cpp.size()));
  for (size_t i = 0; i < c.size(); ++i) {
    ASSERT_EQ(c[i], static_cast<T>(cpp.data()[i])) << "element " << i;
  }
}

void ExpectSameColors(const std::vector<uint8_t>& c, const std::vector<Rgb>& cpp) {
  std::vector<uint8_t> channels;
  for (const Rgb& color : cpp) channels.insert(channels.end(), color.begin(), color.end());
  EXPECT_EQ(c, channels);
}

class EveryGolden : public testing::TestWithParam<const char*> {};

TEST_P(EveryGolden, GivesTheSameBitsAsTheCppLibrary) {
  const std::vector<uint8_t> bytes = Golden(GetParam());
  const SurfacePtr surface = Decode(bytes);
  const DecodedSurface expected = *DecodeDss(bytes, RunContext());
  ASSERT_EQ(rilievo_surface_max_level(surface.get()), expected.surface.max_level);
  EXPECT_EQ(rilievo_surface_declared_max_level(surface.get()), expected.declared_max_level);
  ExpectSame(All(rilievo_surface_heights, surface.get()), expected.surface.heights);
  ExpectSame(All(rilievo_surface_height_changes, surface.get()), expected.height_changes);
  ExpectSameColors(All(rilievo_surface_colors, surface.get()), expected.surface.colors);
  const ControlMesh& control = expected.surface.control_mesh;
  ExpectSame(All(rilievo_control_faces, surface.get()), control.faces);
  ExpectSame(All(rilievo_control_corners, surface.get()), control.corners);
  const auto points = All(rilievo_control_vertices, surface.get());
  ASSERT_EQ(points.size(), static_cast<size_t>(control.vertices.size()));
  for (Eigen::Index v = 0; v < control.vertices.cols(); ++v) {
    const Eigen::Vector3d there = expected.surface.frame.ScanFromUnit(control.vertices.col(v));
    EXPECT_LT((Eigen::Map<const Eigen::Vector3d>(&points[3 * v]) - there).norm(),
              1e-14 * expected.surface.frame.diagonal);
  }
  const auto ends = All(rilievo_control_creases, surface.get());
  const auto sharpness = All(rilievo_control_sharpness, surface.get());
  ASSERT_EQ(sharpness.size(), control.creases.size());
  ASSERT_EQ(ends.size(), 2 * control.creases.size());
  for (size_t i = 0; i < sharpness.size(); ++i) {
    EXPECT_EQ(ends[2 * i], static_cast<uint32_t>(control.creases[i].a));
    EXPECT_EQ(ends[2 * i + 1], static_cast<uint32_t>(control.creases[i].b));
    EXPECT_EQ(sharpness[i], control.creases[i].sharpness);
  }
  for (int level = 0; level <= expected.surface.max_level + 2; ++level) {
    const TriangleMesh triangles = *Tessellate(expected.surface, level, RunContext());
    const MeshPtr mesh = Tessellated(surface.get(), level);
    ExpectSame(All(rilievo_mesh_vertices, mesh.get()), triangles.vertices);
    ExpectSame(All(rilievo_mesh_faces, mesh.get()), triangles.triangles);
    ExpectSame(All(rilievo_mesh_normals, mesh.get()), triangles.normals);
    ExpectSame(All(rilievo_mesh_flags, mesh.get()), SourcesAtLevel(expected.surface, level));
    ExpectSameColors(All(rilievo_mesh_colors, mesh.get()), ColorsAtLevel(expected.surface, level));
  }
}

INSTANTIATE_TEST_SUITE_P(Golden, EveryGolden,
                         testing::Values("sheet_and_octahedron_v1.dss",
                                         "sheet_and_octahedron_v2.dss",
                                         "torus_and_sheet_smoothed_v3.dss",
                                         "genus2_plain_levels_v3.dss",
                                         "colored_torus_in_groups_v3.dss",
                                         "updated_torus_in_groups_v3.dss"));

TEST(CInterfaceTest, RegionsArePartsOfTheWholeMesh) {
  for (const char* name :
       {"sheet_and_octahedron_v2.dss", "torus_in_groups_v3.dss",
        "torus_and_sheet_smoothed_in_groups_v3.dss", "colored_torus_in_groups_v3.dss"}) {
    const std::vector<uint8_t> bytes = Golden(name);
    const SurfacePtr surface = Decode(bytes);
    for (int level : {0, 2, -1}) {
      const int found = level < 0 ? rilievo_surface_max_level(surface.get()) : level;
      const MeshPtr whole = Tessellated(surface.get(), found);
      const std::vector<uint32_t> faces = {1, 2, 17};
      RilievoMesh* part = nullptr;
      ASSERT_EQ(rilievo_decode_region(bytes.data(), bytes.size(), faces.data(), faces.size(), level,
                                      1, &part),
                RILIEVO_OK)
          << rilievo_last_error();
      const MeshPtr owned(part);
      const auto numbers = All(rilievo_mesh_vertex_numbers, part);
      const auto points = All(rilievo_mesh_vertices, part);
      const auto all_points = All(rilievo_mesh_vertices, whole.get());
      const auto flags = All(rilievo_mesh_flags, part);
      const auto all_flags = All(rilievo_mesh_flags, whole.get());
      const auto colors = All(rilievo_mesh_colors, part);
      const auto all_colors = All(rilievo_mesh_colors, whole.get());
      EXPECT_EQ(All(rilievo_mesh_faces, part).size(), 9u << (2 * found));
      ASSERT_EQ(points.size(), 3 * numbers.size());
      for (size_t v = 0; v < numbers.size(); ++v) {
        EXPECT_EQ(flags[v], all_flags[numbers[v]]);
        for (size_t k = 0; k < 3 && !all_colors.empty(); ++k) {
          EXPECT_EQ(colors[3 * v + k], all_colors[3 * numbers[v] + k]);
        }
        for (int k = 0; k < 3; ++k) EXPECT_EQ(points[3 * v + k], all_points[3 * numbers[v] + k]);
      }
      EXPECT_TRUE(All(rilievo_mesh_vertex_numbers, whole.get()).empty());
    }
  }
}

TEST(CInterfaceTest, RegionsOfNoFacesThereAreRefused) {
  const std::vector<uint8_t> bytes = Golden("torus_in_groups_v3.dss");
  for (uint32_t face : {100000u, 0xffffffffu}) {
    RilievoMesh* part = nullptr;
    EXPECT_EQ(rilievo_decode_region(bytes.data(), bytes.size(), &face, 1, 0, 1, &part),
              RILIEVO_INVALID_ARGUMENT);
    EXPECT_EQ(part, nullptr);
    EXPECT_THAT(rilievo_last_error(), HasSubstr("control face"));
  }
  RilievoMesh* part = nullptr;
  EXPECT_EQ(rilievo_decode_region(bytes.data(), bytes.size(), nullptr, 1, 0, 1, &part),
            RILIEVO_INVALID_ARGUMENT);
  EXPECT_THAT(rilievo_last_error(), HasSubstr("faces is NULL"));
}

TEST(CInterfaceTest, InfoIsJsonWithTheFileFigures) {
  const std::vector<uint8_t> bytes = Golden("sheet_and_octahedron_v2.dss");
  const SurfacePtr surface = Decode(bytes);
  const DecodedSurface expected = *DecodeDss(bytes, RunContext());
  size_t count = 0;
  const char* text = rilievo_surface_info(surface.get(), &count);
  EXPECT_EQ(count, std::strlen(text));
  const auto info = nlohmann::json::parse(text);
  EXPECT_EQ(info["format_version"], 2);
  EXPECT_EQ(info["frame"]["diagonal"].get<double>(), expected.surface.frame.diagonal);
  EXPECT_EQ(info["chunk_bytes"].get<std::vector<int64_t>>(), expected.chunk_bytes);
  EXPECT_EQ(info["metadata"]["generator"], expected.metadata.generator);
  EXPECT_EQ(info["metadata"]["scan_points"], expected.metadata.scan_points);
  EXPECT_EQ(info["metadata"]["input_hash"].get<std::string>().size(),
            2 * expected.metadata.input_hash.size());
  const auto& levels = info["levels"];
  ASSERT_EQ(levels.size(), static_cast<size_t>(expected.surface.max_level) + 1);
  for (const auto& level : levels) {
    const TriangleMesh mesh =
        *Tessellate(expected.surface, level["level"].get<int>(), RunContext());
    EXPECT_EQ(level["vertices"], mesh.vertices.cols());
    EXPECT_EQ(level["faces"], mesh.triangles.cols());
  }
}

TEST(CInterfaceTest, InfoOfStrangeTextIsStillJson) {
  const std::vector<uint8_t> bytes = Golden("sheet_and_octahedron_v2.dss");
  DisplacedSurface surface = DecodeDss(bytes, RunContext())->surface;
  DssMetadata metadata;
  metadata.generator = "quote \" back \\ line \n UTF-8 \xc3\xa9 \xe2\x82\xac broken \xff\xc3";
  metadata.input_hash = std::string("\x00\xff\x10", 3);
  metadata.error_max = std::numeric_limits<double>::infinity();
  metadata.place = {0.001, UpDirection::kMinusX, "LOCAL_CS[\"here\"]"};
  EncodeOptions options;
  options.position_step = 1.0 / 1024;
  absl::StatusOr<EncodedSurface> encoded = absl::InternalError("");
  for (Eigen::Index i = 0; i < surface.control_mesh.vertices.size(); ++i) {
    double& x = surface.control_mesh.vertices.data()[i];
    x = std::round(x * 1024) / 1024;
  }
  encoded = EncodeDss(surface, metadata, options, RunContext());
  ASSERT_TRUE(encoded.ok()) << encoded.status();
  const auto info =
      nlohmann::json::parse(rilievo_surface_info(Decode(encoded->Concatenate()).get(), nullptr));
  EXPECT_EQ(info["metadata"]["generator"],
            "quote \" back \\ line \n UTF-8 \xc3\xa9 \xe2\x82\xac broken ??");
  EXPECT_EQ(info["metadata"]["input_hash"], "00ff10");
  EXPECT_EQ(info["place"]["metres_per_unit"], 0.001);
  EXPECT_EQ(info["place"]["up"], "-x");
  EXPECT_EQ(info["place"]["crs"], "LOCAL_CS[\"here\"]");
  const auto unknown = nlohmann::json::parse(rilievo_surface_info(Decode(bytes).get(), nullptr));
  for (const char* name : {"metres_per_unit", "up", "crs"}) {
    EXPECT_TRUE(unknown["place"][name].is_null()) << name;
  }
  EXPECT_TRUE(info["certificate"]["error_max"].is_null());
  EXPECT_TRUE(info["certificate"]["folds"].is_null());
}

TEST(CInterfaceTest, EveryBeginningGivesItsWholeLayers) {
  const std::vector<uint8_t> bytes = Golden("sheet_and_octahedron_v2.dss");
  const std::vector<int64_t> chunks = DecodeDss(bytes, RunContext())->chunk_bytes;
  for (size_t size = 0; size <= bytes.size(); ++size) {
    size_t expected = 0;
    int layers = -1;
    for (const int64_t chunk : chunks) {
      if (expected + static_cast<size_t>(chunk) > size) break;
      expected += static_cast<size_t>(chunk);
      ++layers;
    }
    // A copy of its own size, so that a sanitizer sees a look past its end.
    const std::vector<uint8_t> part(bytes.begin(),
                                    bytes.begin() + static_cast<std::ptrdiff_t>(size));
    size_t whole = 77;
    ASSERT_EQ(rilievo_whole_bytes(part.data(), size, -1, &whole), RILIEVO_OK) << size;
    ASSERT_EQ(whole, expected) << size;
    RilievoSurface* surface = nullptr;
    const RilievoCode code = rilievo_decode(part.data(), size, 1, &surface);
    EXPECT_EQ(code == RILIEVO_OK, whole == size && size > 0) << size;
    EXPECT_EQ(surface != nullptr, code == RILIEVO_OK);
    rilievo_surface_free(surface);
    if (whole == 0) continue;
    EXPECT_EQ(rilievo_surface_max_level(Decode({part.data(), whole}).get()),
              std::max(0, layers - 1));
  }
}

TEST(CInterfaceTest, CoarserThanTheFile) {
  const std::vector<uint8_t> bytes = Golden("sheet_and_octahedron_v2.dss");
  const int finest = rilievo_surface_max_level(Decode(bytes).get());
  ASSERT_GT(finest, 1);
  for (int level = 0; level <= finest + 3; ++level) {
    size_t whole = 0;
    ASSERT_EQ(rilievo_whole_bytes(bytes.data(), bytes.size(), level, &whole), RILIEVO_OK);
    const SurfacePtr coarse = Decode({bytes.data(), whole});
    EXPECT_EQ(rilievo_surface_max_level(coarse.get()), std::min(level, finest));
    EXPECT_EQ(rilievo_surface_declared_max_level(coarse.get()), finest);
  }
}

TEST(CInterfaceTest, AdaptiveMeshIsTheOneOfTheCppLibrary) {
  const std::vector<uint8_t> bytes = Golden("sheet_and_octahedron_v2.dss");
  const SurfacePtr surface = Decode(bytes);
  AdaptiveOptions options;
  options.triangles = 300;
  const AdaptiveMesh expected =
      *TessellateAdaptively(DecodeDss(bytes, RunContext())->surface, options, RunContext());
  RilievoMesh* raw = nullptr;
  double error = -1;
  ASSERT_EQ(rilievo_tessellate_adaptively(surface.get(), -1, 300, 0, &raw, &error), RILIEVO_OK);
  const MeshPtr mesh(raw);
  ExpectSame(All(rilievo_mesh_vertices, mesh.get()), expected.mesh.vertices);
  ExpectSame(All(rilievo_mesh_faces, mesh.get()), expected.mesh.triangles);
  EXPECT_EQ(All(rilievo_mesh_flags, mesh.get()).size(), expected.vertices.size());
  EXPECT_EQ(error, expected.error);
  ASSERT_EQ(rilievo_tessellate_adaptively(surface.get(), 0.5, 0, 0, &raw, nullptr), RILIEVO_OK);
  EXPECT_LE(All(rilievo_mesh_faces, MeshPtr(raw).get()).size(), 3 * 300u);
}

TEST(CInterfaceTest, ErrorsHaveACodeAndASentence) {
  RilievoSurface* surface = nullptr;
  std::vector<uint8_t> bytes = Golden("sheet_and_octahedron_v2.dss");
  EXPECT_EQ(rilievo_decode(nullptr, 5, 0, &surface), RILIEVO_INVALID_ARGUMENT);
  EXPECT_THAT(rilievo_last_error(), HasSubstr("bytes is NULL"));
  EXPECT_EQ(rilievo_decode(nullptr, 0, 0, &surface), RILIEVO_INVALID_ARGUMENT);
  EXPECT_EQ(rilievo_decode(bytes.data(), bytes.size(), 0, nullptr), RILIEVO_INVALID_ARGUMENT);
  EXPECT_EQ(rilievo_whole_bytes(bytes.data(), bytes.size(), 0, nullptr), RILIEVO_INVALID_ARGUMENT);
  const uint8_t ply[] = "ply\nformat ascii 1.0\n";
  EXPECT_EQ(rilievo_decode(ply, sizeof(ply), 0, &surface), RILIEVO_INVALID_ARGUMENT);
  EXPECT_THAT(rilievo_last_error(), HasSubstr("not a .dss"));
  size_t whole = 0;
  EXPECT_EQ(rilievo_whole_bytes(ply, sizeof(ply), 0, &whole), RILIEVO_INVALID_ARGUMENT);
  bytes[bytes.size() / 2] ^= 1;
  EXPECT_EQ(rilievo_decode(bytes.data(), bytes.size(), 0, &surface), RILIEVO_DATA_LOSS);
  EXPECT_THAT(rilievo_last_error(), HasSubstr("chunk"));
  bytes[8] = 250;
  EXPECT_EQ(rilievo_decode(bytes.data(), bytes.size(), 0, &surface), RILIEVO_UNIMPLEMENTED);
  EXPECT_EQ(surface, nullptr);
  rilievo_surface_free(nullptr);
  rilievo_mesh_free(nullptr);
}

TEST(CInterfaceTest, LevelsAndTolerancesOutOfRange) {
  const SurfacePtr surface = Decode(Golden("sheet_and_octahedron_v2.dss"));
  const int finest = rilievo_surface_max_level(surface.get());
  RilievoMesh* mesh = nullptr;
  for (const int level : {-1, finest + 3, 1000, -2147483647}) {
    EXPECT_EQ(rilievo_tessellate(surface.get(), level, 0, &mesh), RILIEVO_INVALID_ARGUMENT);
    EXPECT_THAT(rilievo_last_error(), HasSubstr(std::to_string(level)));
    EXPECT_EQ(mesh, nullptr);
  }
  EXPECT_EQ(rilievo_tessellate(nullptr, 0, 0, &mesh), RILIEVO_INVALID_ARGUMENT);
  EXPECT_EQ(rilievo_tessellate(surface.get(), 0, 0, nullptr), RILIEVO_INVALID_ARGUMENT);
  EXPECT_EQ(rilievo_tessellate_adaptively(surface.get(), 2, 0, 0, &mesh, nullptr),
            RILIEVO_INVALID_ARGUMENT);
  EXPECT_EQ(rilievo_tessellate_adaptively(surface.get(), 0, -4, 0, &mesh, nullptr),
            RILIEVO_INVALID_ARGUMENT);
}

TEST(CInterfaceTest, EachThreadHasItsOwnSentence) {
  RilievoSurface* surface = nullptr;
  const uint8_t text[] = "solid";
  ASSERT_EQ(rilievo_decode(text, sizeof(text), 0, &surface), RILIEVO_INVALID_ARGUMENT);
  const std::string before = rilievo_last_error();
  std::thread([] {
    EXPECT_STREQ(rilievo_last_error(), "");
    RilievoMesh* mesh = nullptr;
    EXPECT_EQ(rilievo_tessellate(nullptr, 0, 0, &mesh), RILIEVO_INVALID_ARGUMENT);
  }).join();
  EXPECT_EQ(rilievo_last_error(), before);
  EXPECT_EQ(rilievo_decoder_abi_version(), 10);
}

}  // namespace
}  // namespace rilievo
