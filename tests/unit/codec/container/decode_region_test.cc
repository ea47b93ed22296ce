#include "core/codec/container/decode_region.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "absl/strings/str_cat.h"
#include "core/codec/container/dss.h"
#include "core/codec/container/open_dss.h"
#include "core/codec/heights/height_layout.h"
#include "tests/unit/codec/test_surfaces.h"

namespace rilievo {
namespace {

using ::testing::HasSubstr;

constexpr int kRegionLevel = 3;

// A torus beside a sheet with a hole: 1 200 faces, eight groups or so, borders of every kind.
const std::vector<uint8_t>& Bytes(int group_faces) {
  static const auto encode = [](int groups) {
    const ControlMesh mesh =
        Together(Torus(24, 16), Sheet(16, 16, true), Eigen::Vector3d(0.02, 0.05, 0.01));
    DisplacedSurface surface = SurfaceOver(mesh, kRegionLevel, 4e-4, 2e-4);
    ControlMesh& control = surface.control_mesh;
    for (int k = 0; k < 2; ++k) {
      const auto [a, b] = std::minmax(control.faces(k, 9), control.faces(k + 1, 9));
      control.creases.push_back({a, b, k == 0 ? kInfiniteSharpness : 1.5f});
    }
    std::sort(control.creases.begin(), control.creases.end(), [](const Crease& x, const Crease& y) {
      return std::pair(x.a, x.b) < std::pair(y.a, y.b);
    });
    EncodeOptions options;
    options.group_faces = groups;
    options.position_step = 4e-4;
    options.height_step = 1e-4;
    const auto encoded = EncodeDss(surface, {}, options, RunContext());
    EXPECT_TRUE(encoded.ok()) << encoded.status();
    return encoded->Concatenate();
  };
  static const std::vector<uint8_t> with = encode(kLeastGroupLimit), without = encode(0);
  return group_faces > 0 ? with : without;
}

std::vector<int> CollapseGuards(const ControlMesh& mesh, int face, double radius) {
  std::vector<int> faces;
  const auto middle = [&](Eigen::Index f) {
    return ((mesh.vertices.col(mesh.faces(0, f)) + mesh.vertices.col(mesh.faces(1, f)) +
             mesh.vertices.col(mesh.faces(2, f))) /
            3)
        .eval();
  };
  for (Eigen::Index f = 0; f < mesh.faces.cols(); ++f) {
    if ((middle(f) - middle(face)).norm() <= radius) faces.push_back(static_cast<int>(f));
  }
  return faces;
}

void ExpectPartOfWhole(const DecodedSurface& whole, const std::vector<int>& faces,
                       const DecodedRegion& part) {
  const TriangleMesh mesh = *Tessellate(whole.surface, part.level, RunContext());
  const RegionMesh& region = part.region;
  const Eigen::Index per_face = mesh.triangles.cols() / whole.surface.control_mesh.faces.cols();
  ASSERT_EQ(region.mesh.triangles.cols(), per_face * static_cast<Eigen::Index>(faces.size()));
  ASSERT_EQ(part.sources.size(), region.vertices.size());
  EXPECT_TRUE(std::is_sorted(region.vertices.begin(), region.vertices.end()));
  for (Eigen::Index t = 0; t < region.mesh.triangles.cols(); ++t) {
    const Eigen::Index in_whole =
        faces[static_cast<size_t>(t / per_face)] * per_face + t % per_face;
    for (int k = 0; k < 3; ++k) {
      const int here = region.mesh.triangles(k, t), there = mesh.triangles(k, in_whole);
      ASSERT_EQ(region.vertices[here], there);
      ASSERT_EQ(region.mesh.vertices.col(here), mesh.vertices.col(there));
      ASSERT_EQ(region.mesh.normals.col(here), mesh.normals.col(there));
      ASSERT_EQ(part.sources[here], whole.surface.sources[there]);
    }
  }
}

// Of one chunk of groups: where each piece stands in the file.
std::vector<std::pair<size_t, size_t>> PiecesOf(const std::vector<uint8_t>& bytes, size_t layer,
                                                int groups) {
  const OpenedDss file = *OpenDss(bytes, true);
  const std::span<const uint8_t> payload = file.layers[layer].payload;
  const auto layout = ReadGroupedLayout(payload, static_cast<int>(layer), groups);
  std::vector<std::pair<size_t, size_t>> places;
  for (const auto& piece : layout->pieces) {
    places.emplace_back(piece.empty() ? 0 : piece.data() - bytes.data(), piece.size());
  }
  return places;
}

TEST(DecodeRegionTest, IsThatPartOfTheWholeBitForBit) {
  for (int groups : {kLeastGroupLimit, 0}) {
    const std::vector<uint8_t>& bytes = Bytes(groups);
    const auto whole = DecodeDss(bytes, RunContext());
    ASSERT_TRUE(whole.ok()) << whole.status();
    const ControlMesh& mesh = whole->surface.control_mesh;
    const int count = static_cast<int>(mesh.faces.cols());
    for (int face : {0, 9, 200, count - 1}) {
      for (int level = 0; level <= kRegionLevel; level += groups > 0 ? 1 : kRegionLevel) {
        const std::vector<int> faces = CollapseGuards(mesh, face, 0.06);
        const auto part = DecodeRegion(bytes, faces, level, RunContext());
        ASSERT_TRUE(part.ok()) << part.status();
        EXPECT_EQ(part->level, level);
        ExpectPartOfWhole(*whole, faces, *part);
        if (groups == 0) {
          EXPECT_EQ(part->groups, 0);
        } else {
          EXPECT_GE(part->groups, count / kLeastGroupLimit);
          EXPECT_LT(part->groups_read, part->groups);
        }
      }
    }
  }
}

// A chunk whose frame was touched may not be taken for one of another kind or level.
TEST(DecodeRegionTest, EveryChangedFrameOfALayerIsNoticed) {
  const std::vector<uint8_t>& bytes = Bytes(kLeastGroupLimit);
  const std::vector<int> faces = {0};
  const OpenedDss file = *OpenDss(bytes, true);
  size_t begin = 0;
  for (const int64_t size : file.chunk_bytes) {
    if (begin > 0) {
      for (size_t at = begin; at < begin + 3; ++at) {  // the tag and the length
        for (int bit = 0; bit < 8; ++bit) {
          std::vector<uint8_t> changed = bytes;
          changed[at] ^= static_cast<uint8_t>(1 << bit);
          EXPECT_FALSE(DecodeRegion(changed, faces, kFinestLevel, RunContext()).ok())
              << "byte " << at - begin << " of the chunk at " << begin << ", bit " << bit;
        }
      }
    }
    begin += static_cast<size_t>(size);
  }
}

TEST(DecodeRegionTest, LooksAtNothingElse) {
  std::vector<uint8_t> bytes = Bytes(kLeastGroupLimit);
  const auto whole = DecodeDss(bytes, RunContext());
  const std::vector<int> faces = {0};
  const auto part = DecodeRegion(bytes, faces, kFinestLevel, RunContext());
  ASSERT_TRUE(part.ok()) << part.status();
  // Each group's pieces are spoiled in turn: as many regions fail as groups were read, by name.
  int failed = 0;
  for (int g = 0; g < part->groups; ++g) {
    std::vector<uint8_t> spoiled = bytes;
    for (size_t layer = kFirstGroupedLevel; layer <= kRegionLevel; ++layer) {
      const auto [begin, size] = PiecesOf(bytes, layer, static_cast<int>(part->groups))[g];
      std::fill_n(spoiled.begin() + static_cast<std::ptrdiff_t>(begin), size, 0);
    }
    EXPECT_FALSE(DecodeDss(spoiled, RunContext()).ok());
    const auto again = DecodeRegion(spoiled, faces, kFinestLevel, RunContext());
    if (again.ok()) {
      ExpectPartOfWhole(*whole, faces, *again);
    } else {
      EXPECT_EQ(again.status().code(), absl::StatusCode::kDataLoss);
      EXPECT_THAT(again.status().message(), HasSubstr(absl::StrCat("group ", g, " of level 2")));
      ++failed;
    }
  }
  EXPECT_EQ(failed, part->groups_read);
  EXPECT_LT(failed, part->groups / 2 + 1);
}

TEST(DecodeRegionTest, DecodesPrefixes) {
  const std::vector<uint8_t>& bytes = Bytes(kLeastGroupLimit);
  const auto whole = DecodeDss(bytes, RunContext());
  size_t end = 0;
  for (size_t chunk = 0; chunk < whole->chunk_bytes.size(); ++chunk) {
    end += static_cast<size_t>(whole->chunk_bytes[chunk]);
    const std::span<const uint8_t> prefix(bytes.data(), end);
    const auto of_prefix = DecodeDss(prefix, RunContext());
    ASSERT_TRUE(of_prefix.ok()) << of_prefix.status();
    const std::vector<int> faces = {3, 4, 5, 700};
    const auto part = DecodeRegion(prefix, faces, kFinestLevel, RunContext());
    ASSERT_TRUE(part.ok()) << part.status();
    EXPECT_EQ(part->level, of_prefix->surface.max_level);
    ExpectPartOfWhole(*of_prefix, faces, *part);
  }
}

TEST(DecodeRegionTest, OtherFacesAndLevelsAreRefused) {
  const std::vector<uint8_t>& bytes = Bytes(kLeastGroupLimit);
  for (const std::vector<int>& faces : {std::vector<int>{-1}, {100000}, {3, 3}, {4, 2}}) {
    const auto part = DecodeRegion(bytes, faces, 1, RunContext());
    EXPECT_EQ(part.status().code(), absl::StatusCode::kInvalidArgument);
    EXPECT_THAT(part.status().message(), HasSubstr("control face"));
  }
  const std::vector<int> face = {1};
  EXPECT_EQ(DecodeRegion(bytes, face, kRegionLevel + 1, RunContext()).status().code(),
            absl::StatusCode::kInvalidArgument);
  const auto nothing = DecodeRegion(bytes, {}, 1, RunContext());
  ASSERT_TRUE(nothing.ok()) << nothing.status();
  EXPECT_EQ(nothing->region.mesh.triangles.cols(), 0);
}

TEST(ControlFacesInBoxTest, AreThoseWithACornerOrTheirMiddleInside) {
  ControlMesh mesh;
  mesh.vertices.resize(3, 4);
  mesh.vertices << 0, 1, 0, 1,  //
      0, 0, 1, 1,               //
      0, 0, 0, 0;
  mesh.faces.resize(3, 2);
  mesh.faces << 0, 1,  //
      1, 3,            //
      2, 2;
  const SpatialFrame frame{.center = {10, 0, 0}, .diagonal = 3};
  const auto box = [](double x, double y) {
    return Eigen::AlignedBox3d(Eigen::Vector3d(x - 0.1, y - 0.1, -1),
                               Eigen::Vector3d(x + 0.1, y + 0.1, 1));
  };
  EXPECT_EQ(ControlFacesInBox(frame, mesh, box(10, 0)), std::vector<int>{0});
  EXPECT_EQ(ControlFacesInBox(frame, mesh, box(13, 0)), (std::vector<int>{0, 1}));
  EXPECT_EQ(ControlFacesInBox(frame, mesh, box(12, 2)), std::vector<int>{1});
  EXPECT_EQ(ControlFacesInBox(frame, mesh, box(11.5, 0)), std::vector<int>{});
}

}  // namespace
}  // namespace rilievo
