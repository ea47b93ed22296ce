// Surfaces of simulated scans as voxels, read back from the files.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <map>
#include <numbers>

#include "tests/unit/cli/program_fixture.h"

namespace rilievo {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

// The fields of an NRRD header and what comes after it.
struct Nrrd {
  std::map<std::string, std::string> fields;
  std::string bytes;
};

Nrrd ReadNrrd(const std::string& content) {
  Nrrd nrrd;
  const size_t end = content.find("\n\n");
  EXPECT_NE(end, std::string::npos);
  std::istringstream header(content.substr(0, end));
  std::string line;
  std::getline(header, line);
  EXPECT_EQ(line, "NRRD0004");
  while (std::getline(header, line)) {
    const size_t colon = line.find(": ");
    EXPECT_NE(colon, std::string::npos) << line;
    nrrd.fields[line.substr(0, colon)] = line.substr(colon + 2);
  }
  nrrd.bytes = content.substr(end + 2);
  return nrrd;
}

// Without the line breaks.
std::string Unwrapped(std::string text) {
  for (size_t at; (at = text.find("\n  ")) != std::string::npos;) text.replace(at, 3, " ");
  return text;
}

class VoxelizeTest : public ProgramFixture {
 protected:
  static constexpr double kRing = 0.7, kTube = 0.28;

  void MakeTorus(const std::vector<std::string>& more = {}) {
    ASSERT_EQ(Run({"simulate", "torus", "-o", At("scan.ply"), "--points", "20000"}).code, 0);
    std::vector<std::string> words = {"reconstruct", At("scan.ply"), "-o", At("a.dss"), "--quiet"};
    words.insert(words.end(), more.begin(), more.end());
    ASSERT_EQ(Run(words).code, 0);
  }

  Json Voxelized(const std::string& output, std::vector<std::string> arguments) const {
    arguments.insert(arguments.begin(), {"voxelize", At("a.dss"), At(output), "--json", "--quiet"});
    const Ended ended = Run(arguments);
    EXPECT_EQ(ended.code, 0) << ended.err;
    EXPECT_EQ(ended.err, "");
    return Json::parse(ended.out);
  }
};

TEST_F(VoxelizeTest, ASolidTorusHasItsVolume) {
  MakeTorus();
  const Json told = Voxelized("a.nrrd", {"--kind", "solid", "--resolution", "200"});
  const double volume = 2 * std::numbers::pi * std::numbers::pi * kRing * kTube * kTube;
  EXPECT_NEAR(told["volume"].get<double>() / volume, 1, 2e-3);
  const Ended measured = Run({"measure", At("a.dss"), "--json"});
  EXPECT_NEAR(told["volume"].get<double>() / Json::parse(measured.out)["volume"].get<double>(), 1,
              1e-3);
  const Nrrd nrrd = ReadNrrd(Content(At("a.nrrd")));
  EXPECT_EQ(nrrd.fields.at("type"), "uint8");
  const auto size = told["size"].get<std::vector<int>>();
  EXPECT_EQ(nrrd.fields.at("sizes"), std::to_string(size[0]) + " " + std::to_string(size[1]) + " " +
                                         std::to_string(size[2]));
  EXPECT_EQ(std::max(size[0], size[1]), 202);
  EXPECT_EQ(std::count(nrrd.bytes.begin(), nrrd.bytes.end(), 1), told["filled"].get<int64_t>());
  EXPECT_EQ(std::count(nrrd.bytes.begin(), nrrd.bytes.end(), 0),
            static_cast<int64_t>(nrrd.bytes.size()) - told["filled"].get<int64_t>());
  // Where the file says that its voxels lie, a centre in the tube is inside, one on the axis is
  // not.
  double first[3], step = 0;
  ASSERT_EQ(std::sscanf(nrrd.fields.at("space origin").c_str(), "(%lf,%lf,%lf)", &first[0],
                        &first[1], &first[2]),
            3);
  ASSERT_EQ(std::sscanf(nrrd.fields.at("space directions").c_str(), "(%lf,0,0)", &step), 1);
  EXPECT_NEAR(first[0], told["origin"][0].get<double>() + step / 2, 1e-12);
  const auto at = [&](double x, double y, double z) {
    const auto index = [&](double value, int axis) {
      return std::lround((value - first[axis]) / step);
    };
    return int{nrrd.bytes[static_cast<size_t>((index(z, 2) * size[1] + index(y, 1)) * size[0] +
                                              index(x, 0))]};
  };
  EXPECT_EQ(at(kRing, 0, 0), 1);
  EXPECT_EQ(at(0, -kRing, 0.2), 1);
  EXPECT_EQ(at(0, 0, 0), 0);
  EXPECT_EQ(at(kRing, 0, 0.29), 0);
}

TEST_F(VoxelizeTest, AShellIsThin) {
  MakeTorus({"--unit", "mm"});
  const Json told = Voxelized("a.raw", {"--voxel", "20um"});
  EXPECT_EQ(told["kind"], "shell");
  EXPECT_EQ(told["unit"], "mm");
  EXPECT_NEAR(told["voxel"].get<double>(), 0.02, 1e-15);
  const auto size = told["size"].get<std::vector<int64_t>>();
  const std::string bytes = Content(At("a.raw"));
  ASSERT_EQ(static_cast<int64_t>(bytes.size()), size[0] * size[1] * size[2]);
  EXPECT_EQ(std::count(bytes.begin(), bytes.end(), 1), told["filled"].get<int64_t>());
  // Of planes in all directions half a voxel to one and a half pass through a unit of area.
  const double area = 4 * std::numbers::pi * std::numbers::pi * kRing * kTube / (0.02 * 0.02);
  EXPECT_GT(told["filled"].get<double>(), area);
  EXPECT_LT(told["filled"].get<double>(), 2 * area);
}

TEST_F(VoxelizeTest, DistancesAreThoseOfTheTorus) {
  MakeTorus();
  const Json told =
      Voxelized("a.nrrd", {"--kind", "distance", "--resolution", "60", "--band", "4"});
  EXPECT_TRUE(told["signed"].get<bool>());
  const double voxel = told["voxel"].get<double>(), band = told["band"].get<double>();
  EXPECT_NEAR(band, 4 * voxel, 1e-12);
  const Nrrd nrrd = ReadNrrd(Content(At("a.nrrd")));
  EXPECT_EQ(nrrd.fields.at("type"), "float");
  const auto size = told["size"].get<std::vector<int>>();
  ASSERT_EQ(nrrd.bytes.size(), sizeof(float) * static_cast<size_t>(size[0] * size[1] * size[2]));
  double worst = 0;
  size_t offset = 0;
  for (int z = 0; z < size[2]; ++z) {
    for (int y = 0; y < size[1]; ++y) {
      for (int x = 0; x < size[0]; ++x, offset += sizeof(float)) {
        float value = 0;
        std::memcpy(&value, nrrd.bytes.data() + offset, sizeof(float));
        double at[3];
        const int voxel_at[3] = {x, y, z};
        for (size_t axis = 0; axis < 3; ++axis) {
          at[axis] = told["origin"][axis].get<double>() + voxel * (voxel_at[axis] + 0.5);
        }
        const double exact = std::hypot(std::hypot(at[0], at[1]) - kRing, at[2]) - kTube;
        worst = std::max(worst, std::abs(value - std::clamp(exact, -band, band)));
      }
    }
  }
  EXPECT_LT(worst, 0.004);  // that of the reconstruction
  const Ended measured = Run({"measure", At("a.dss"), "--json"});
  // The tube has a radius of nine voxels: what its curvature adds falls with their square.
  EXPECT_NEAR(told["volume"].get<double>() / Json::parse(measured.out)["volume"].get<double>(), 1,
              2e-3);
}

TEST_F(VoxelizeTest, WordsFitATerminalAndBytesAPipe) {
  MakeTorus();
  const Ended text =
      Run({"voxelize", At("a.dss"), At("a.nrrd"), "--resolution", "40", "--kind", "distance"});
  EXPECT_EQ(text.code, 0) << text.err;
  EXPECT_LE(WidestLine(text.out), 80u);
  EXPECT_THAT(text.out, HasSubstr("negative inside"));
  EXPECT_THAT(text.out, HasSubstr("volume"));
  const Ended piped = Run({"voxelize", At("a.dss"), "-", "--resolution", "40", "--level", "2"});
  EXPECT_EQ(piped.code, 0) << piped.err;
  const Nrrd nrrd = ReadNrrd(piped.out);
  EXPECT_THAT(nrrd.fields.at("content"), HasSubstr("shell of surface at level 2"));
  EXPECT_THAT(piped.err, HasSubstr("uint8: 1 in"));
}

TEST_F(VoxelizeTest, WritesForOpenVdb) {
  MakeTorus();
  const Json told = Voxelized("a.vdb", {"--kind", "distance", "--resolution", "150"});
  const std::string bytes = Content(At("a.vdb"));
  EXPECT_EQ(bytes.substr(0, 4), " BDV");
  EXPECT_THAT(bytes.substr(0, 400), HasSubstr("level set"));
  const auto size = told["size"].get<std::vector<size_t>>();
  EXPECT_LT(bytes.size(), sizeof(float) * size[0] * size[1] * size[2]);
}

TEST_F(VoxelizeTest, MeshesAreTakenToo) {
  std::ofstream(At("sheet.obj")) << "v 0 0 0\nv 2 0 0\nv 2 1 0\nv 0 1 0\nf 1 2 3\nf 1 3 4\n";
  const Ended shell =
      Run({"voxelize", At("sheet.obj"), At("a.raw"), "--resolution", "20", "--json"});
  EXPECT_EQ(shell.code, 0) << shell.err;
  EXPECT_THAT(Json::parse(shell.out)["size"].get<std::vector<int>>(), ElementsAre(22, 12, 3));
  EXPECT_EQ(Json::parse(shell.out)["filled"], 200);
  const Ended solid =
      Run({"voxelize", At("sheet.obj"), At("b.raw"), "--resolution", "20", "--kind", "solid"});
  EXPECT_EQ(solid.code, 3);
  EXPECT_THAT(Unwrapped(solid.err), HasSubstr("the surface is open"));
  EXPECT_FALSE(fs::exists(At("b.raw")));
}

TEST_F(VoxelizeTest, RefusesWhatCannotBe) {
  std::ofstream(At("sheet.obj")) << "v 0 0 0\nv 2 0 0\nv 2 1 0\nv 0 1 0\nf 1 2 3\nf 1 3 4\n";
  const auto refused = [&](std::vector<std::string> arguments, int code, const std::string& said) {
    arguments.insert(arguments.begin(), {"voxelize", At("sheet.obj"), "--quiet"});
    const Ended ended = Run(arguments);
    EXPECT_EQ(ended.code, code) << ended.err;
    EXPECT_THAT(Unwrapped(ended.err), HasSubstr(said));
    EXPECT_EQ(ended.out, "");
  };
  refused({At("a.nrrd")}, 2, "give --resolution or --voxel");
  refused({At("a.nrrd"), "--resolution", "5", "--voxel", "1u"}, 2, "exclude each other");
  refused({At("a.nrrd"), "--resolution", "5000"}, 2, "from 1 to 2048");
  refused({At("a.vti"), "--resolution", "5"}, 2, ".nrrd, .vdb or .raw");
  refused({At("sheet.obj"), "--resolution", "5"}, 2, ".nrrd, .vdb or .raw");
  refused({At("a.nrrd"), "--resolution", "5", "--band", "4"}, 2, "add --kind distance");
  refused({At("a.nrrd"), "--resolution", "5", "--kind", "hull"}, 2, "shell, solid, distance");
  refused({At("a.nrrd"), "--voxel", "2mm"}, 2, "the unit of");
  refused({At("a.nrrd"), "--voxel", "0.000001u"}, 2, "take a voxel of");
  refused({At("a.nrrd"), "--resolution", "5", "--level", "2"}, 2, "leave --level out");
  refused({At("none") + "/a.nrrd", "--resolution", "5"}, 6, "cannot be written");
  fs::copy(At("sheet.obj"), At("sheet.raw"));
  const Ended same =
      Run({"voxelize", At("sheet.raw"), At("sheet.raw"), "--format", "obj", "--resolution", "5"});
  EXPECT_EQ(same.code, 2);
  EXPECT_THAT(same.err, HasSubstr("overwrite"));
  EXPECT_EQ(Content(At("sheet.raw")), Content(At("sheet.obj")));
}

}  // namespace
}  // namespace rilievo
