// The colours and intensities of a scan, whatever its format.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <sstream>
#include <tuple>

#include "absl/strings/str_cat.h"
#include "client/formats/intensity_colors.h"
#include "client/formats/number_text.h"
#include "client/formats/scan_reader.h"
#include "tests/unit/formats/e57_file.h"
#include "tests/unit/formats/scan_samples.h"

namespace rilievo::testing {
namespace {

constexpr int kPoints = 60;

Rgb ColorOf(int i) {
  return {static_cast<uint8_t>(i), static_cast<uint8_t>(255 - i), static_cast<uint8_t>(3 * i)};
}

std::vector<Rgb> AllColors() {
  std::vector<Rgb> colors;
  for (int i = 0; i < kPoints; ++i) colors.push_back(ColorOf(i));
  return colors;
}

// A line a point: x y z, then what `more` gives.
template <typename More>
std::string Lines(const More& more) {
  const Eigen::Matrix3Xd points = SpherePoints(kPoints);
  std::string text;
  for (int i = 0; i < kPoints; ++i) {
    absl::StrAppend(&text, points(0, i), " ", points(1, i), " ", points(2, i), " ",
                    more(ColorOf(i)), "\n");
  }
  return text;
}

std::string Words(const Rgb& c) { return absl::StrCat(int{c[0]}, " ", int{c[1]}, " ", int{c[2]}); }

uint32_t Packed(const Rgb& c) {
  return 0xff000000u | uint32_t{c[0]} << 16 | uint32_t{c[1]} << 8 | c[2];
}

std::string PcdHead(const std::string& fields, const std::string& size, const std::string& type,
                    const std::string& data) {
  return absl::StrCat("VERSION .7\nFIELDS x y z ", fields, "\nSIZE 4 4 4 ", size, "\nTYPE F F F ",
                      type, "\nWIDTH ", kPoints, "\nHEIGHT 1\nPOINTS ", kPoints, "\nDATA ", data,
                      "\n");
}

std::string BinaryPcd(const std::string& type) {
  const Eigen::Matrix3Xd points = SpherePoints(kPoints);
  std::string bytes = PcdHead("rgb", "4", type, "binary");
  for (int i = 0; i < kPoints; ++i) {
    bytes += FloatRows(points.col(i)) + Raw(Packed(ColorOf(i)));
  }
  return bytes;
}

std::string LasOf(int step) {
  const Eigen::Matrix3Xd points = SpherePoints(kPoints);
  std::string file = LasFile(points, {.point_format = 2});
  const size_t begin = file.size() - 26 * kPoints;
  for (int i = 0; i < kPoints; ++i) {
    for (size_t k = 0; k < 3; ++k) {
      const auto value = static_cast<uint16_t>(ColorOf(i)[k] * step);
      file.replace(begin + 26 * static_cast<size_t>(i) + 20 + 2 * k, 2, Raw(value));
    }
  }
  return file;
}

std::string E57Of() {
  const Eigen::Matrix3Xd points = SpherePoints(kPoints);
  E57Scan scan;
  scan.records = kPoints;
  const char* const axes[] = {"cartesianX", "cartesianY", "cartesianZ"};
  const char* const names[] = {"colorRed", "colorGreen", "colorBlue"};
  for (int axis = 0; axis < 3; ++axis) {
    const Eigen::VectorXd row = points.row(axis);
    scan.columns.push_back(E57Reals(axes[axis], false, {row.begin(), row.end()}));
  }
  for (size_t k = 0; k < 3; ++k) {
    std::vector<int64_t> values;
    for (int i = 0; i < kPoints; ++i) values.push_back(ColorOf(i)[k]);
    scan.columns.push_back(E57Integers(names[k], 0, 255, values));
  }
  return E57File({scan});
}

std::vector<NamedBytes> ColoredScans() {
  const std::string xyz = "property float x\nproperty float y\nproperty float z\n";
  const auto ply = [&](const std::string& type, const std::string& names) {
    std::string properties = xyz;
    std::istringstream words(names);
    for (std::string name; words >> name;) {
      absl::StrAppend(&properties, "property ", type, " ", name, "\n");
    }
    return PlyHeaderText("ascii", absl::StrCat(kPoints), properties);
  };
  const auto shares = [](const Rgb& c) {
    return absl::StrCat(c[0] / 255.0, " ", c[1] / 255.0, " ", c[2] / 255.0);
  };
  const auto wide = [](const Rgb& c) {
    return absl::StrCat(256 * c[0] + 7, " ", 256 * c[1] + 99, " ", 256 * c[2] + 200);
  };
  return {
      {"bytes.ply", ply("uchar", "red green blue") + Lines(Words), kPoints},
      {"wide.ply", ply("ushort", "red green blue") + Lines(wide), kPoints},
      {"reals.ply", ply("float", "r g b") + Lines(shares), kPoints},
      {"packed.pcd", BinaryPcd("F"), kPoints},
      {"unsigned.pcd", BinaryPcd("U"), kPoints},
      {"fields.pcd", PcdHead("r g b", "1 1 1", "U U U", "ascii") + Lines(Words), kPoints},
      {"ascii.pcd", PcdHead("rgb", "4", "F", "ascii") + Lines([](const Rgb& c) {
                      std::string text;
                      AppendNumber(std::bit_cast<float>(Packed(c) & 0xffffffu), &text);
                      return text;
                    }),
       kPoints},
      {"six.xyz", Lines(Words), kPoints},
      {"heading.csv", "x y z r g b\n" + Lines(Words), kPoints},
      {"wide.csv", "x y z red green blue\n" + Lines(wide), kPoints},
      {"leica.pts", absl::StrCat(kPoints, "\n") + Lines([](const Rgb& c) {
                      return absl::StrCat("-1200 ", Words(c));
                    }),
       kPoints},
      {"shares.obj",
       [&] {
         std::string text = Lines(shares), lines;
         std::istringstream in(text);
         for (std::string line; std::getline(in, line);) absl::StrAppend(&lines, "v ", line, "\n");
         return lines;
       }(),
       kPoints},
      {"bytes.las", LasOf(1), kPoints},
      {"wide.las", LasOf(257), kPoints},
      {"reals.ptx", PtxCloud(kPoints, 1, kIdentity, Lines([](const Rgb& c) {
                               return absl::StrCat("0.5 ", Words(c));
                             })),
       kPoints},
      {"integers.e57", E57Of(), kPoints},
  };
}

TEST(ScanColorsTest, AreEqualInAllFormats) {
  for (const NamedBytes& file : ColoredScans()) {
    std::istringstream in(file.bytes);
    const auto scan = ReadScanStream(in, file.name, {.colors = true});
    ASSERT_TRUE(scan.ok()) << file.name << ": " << scan.status();
    EXPECT_EQ(scan->cloud.points.cols(), kPoints) << file.name;
    EXPECT_EQ(scan->cloud.sights.colors, AllColors()) << file.name;
    std::istringstream again(file.bytes);
    EXPECT_TRUE(ReadScanStream(again, file.name)->cloud.sights.colors.empty()) << file.name;
  }
}

TEST(ScanColorsTest, NumbersThatAreNoColoursAreNone) {
  const auto colors = [](const std::string& text) {
    std::istringstream in(text);
    return ReadScanStream(in, "a.xyz", {.colors = true})->cloud.sights.colors.size();
  };
  EXPECT_EQ(colors("0 0 0 0 0 1\n1 0 0 0 1 0\n"), 0u);        // normals
  EXPECT_EQ(colors("0 0 0 0.1 0.9 4\n1 0 0 1 2 3\n"), 0u);    // no whole numbers
  EXPECT_EQ(colors("0 0 0 -1 9 4\n1 0 0 1 2 3\n"), 0u);       // below 0
  EXPECT_EQ(colors("0 0 0 1 9 400\n1 0 0 1 2 3\n"), 0u);      // above 255
  EXPECT_EQ(colors("0 0 0 1 9 40\n1 0 0 1 2\n1 1 1\n"), 0u);  // not all points
  EXPECT_EQ(colors("0 0 0 1 9 40\n1 0 0 1 2 3\n"), 2u);
}

std::vector<Rgb> ColorsOf(const std::string& bytes, const std::string& name) {
  std::istringstream in(bytes);
  const auto scan = ReadScanStream(in, name, {.colors = true});
  EXPECT_TRUE(scan.ok()) << name << ": " << scan.status();
  return scan.ok() ? scan->cloud.sights.colors : std::vector<Rgb>();
}

TEST(ScanColorsTest, PointsWithoutOneTakeThatOfThePointBefore) {
  const std::vector<Rgb> expected = {{7, 8, 9}, {7, 8, 9}, {7, 8, 9}, {1, 2, 3}, {1, 2, 3}};
  EXPECT_EQ(ColorsOf("x y z r g b\n0 0 0\n1 0 0 7 8\n2 0 0 7 8 9\n3 0 0 1 2 3\n4 0 0\n", "a.xyz"),
            expected);
  EXPECT_EQ(ColorsOf("VERSION .7\nFIELDS x y z rgb\nSIZE 4 4 4 4\nTYPE F F F U\nWIDTH 5\nHEIGHT 1\n"
                     "POINTS 5\nDATA ascii\n0 0 0 nan\n1 0 0 1e300\n2 0 0 460809\n3 0 0 66051\n"
                     "4 0 0 -1e19\n",
                     "a.pcd"),
            expected);
  EXPECT_EQ(ColorsOf("VERSION .7\nFIELDS x y z rgb\nSIZE 4 4 4 4\nTYPE F F F F\nWIDTH 2\nHEIGHT 1\n"
                     "POINTS 2\nDATA ascii\n0 0 0 9.183564e-40\n1 0 0 nan\n",
                     "a.pcd"),
            (std::vector<Rgb>(2, Rgb{10, 0, 1})));
  EXPECT_TRUE(ColorsOf("x y z r g b\n0 0 0\n1 0 0\n", "a.xyz").empty());
}

TEST(ScanColorsTest, E57SaysWhichPointsHaveOne) {
  E57Scan scan;
  scan.records = 4;
  for (const char* axis : {"cartesianX", "cartesianY", "cartesianZ"}) {
    scan.columns.push_back(E57Reals(axis, false, {0, 1, 2, 3}));
  }
  scan.columns.push_back(E57Integers("colorRed", 0, 255, {0, 10, 0, 20}));
  scan.columns.push_back(E57Integers("isColorInvalid", 0, 1, {1, 0, 1, 0}));
  scan.columns.push_back(E57Integers("colorGreen", 0, 255, {0, 11, 0, 21}));
  scan.columns.push_back(E57Integers("colorBlue", 0, 255, {0, 12, 0, 22}));
  EXPECT_EQ(ColorsOf(E57File({scan}), "a.e57"),
            (std::vector<Rgb>{{10, 11, 12}, {10, 11, 12}, {10, 11, 12}, {20, 21, 22}}));
}

TEST(ScanColorsTest, WhereSomeScansHaveNoneTheFormatSaysSo) {
  E57Scan plain, colored;
  plain.records = colored.records = 2;
  for (const char* axis : {"cartesianX", "cartesianY", "cartesianZ"}) {
    plain.columns.push_back(E57Reals(axis, false, {0, 1}));
  }
  colored.columns = plain.columns;
  for (const char* name : {"colorRed", "colorGreen", "colorBlue"}) {
    colored.columns.push_back(E57Integers(name, 0, 255, {3, 4}));
  }
  const std::string ptx = PtxCloud(2, 1, kIdentity, "1 2 3 0.5 7 8 9\n4 5 6 0.5\n");
  const std::string obj = "v 0 0 0 1 0 0\nv 1 0 0\nv 2 0 0 0 1 0\n";
  for (const auto& [bytes, name, count] :
       {std::tuple(E57File({plain, colored}), "a.e57", 2), std::tuple(ptx, "a.ptx", 1),
        std::tuple(obj, "a.obj", 2)}) {
    std::istringstream in(bytes), again(bytes);
    const auto scan = ReadScanStream(in, name, {.colors = true});
    ASSERT_TRUE(scan.ok()) << name << ": " << scan.status();
    EXPECT_TRUE(scan->cloud.sights.colors.empty()) << name;
    EXPECT_THAT(scan->format, ::testing::HasSubstr(absl::StrCat(", without the colours that only ",
                                                                count, " points have")));
    EXPECT_THAT(ReadScanStream(again, name)->format, ::testing::Not(::testing::HasSubstr("only")));
  }
}

TEST(ScanColorsTest, BlackAloneIsNone) {
  EXPECT_TRUE(ColorsOf(LasOf(0), "a.las").empty());
  EXPECT_TRUE(ColorsOf("x y z r g b\n0 0 0 0 0 0\n1 0 0 0 0 0\n", "a.xyz").empty());
  EXPECT_EQ(ColorsOf("x y z r g b\n0 0 0 0 0 0\n1 0 0 0 9 0\n", "a.xyz").size(), 2u);
}

TEST(ScanColorsTest, ObjVerticesMayHaveAWeightOrAComment) {
  EXPECT_EQ(ColorsOf("v 0 0 0 0.2 0.4 1 # the first\nv 1 0 0 1 1 1\n", "a.obj"),
            (std::vector<Rgb>{{51, 102, 255}, {255, 255, 255}}));
  EXPECT_TRUE(ColorsOf("v 0 0 0 # the first\nv 1 0 0 1\n", "a.obj").empty());
}

// ---- intensity

std::vector<float> IntensityOf(const std::string& bytes, const std::string& name) {
  std::istringstream in(bytes);
  const auto scan = ReadScanStream(in, name, {.intensity = true});
  return scan.ok() ? scan->layers.intensity : std::vector<float>();
}

TEST(ScanIntensityTest, ItsColumnIsNamedOrTheFourthOfPts) {
  const std::vector<float> expected = {7, 9};
  EXPECT_EQ(IntensityOf("2\n0 0 0 7\n1 0 0 9\n", "a.pts"), expected);
  EXPECT_EQ(IntensityOf("2\n0 0 0 7 1 2 3\n1 0 0 9 4 5 6\n", "a.pts"), expected);
  EXPECT_EQ(IntensityOf("0 0 0 7\n1 0 0 9\n", "a.xyz"), std::vector<float>());
  EXPECT_EQ(IntensityOf("x,y,z,Intensity\n0,0,0,7\n1,0,0,9\n", "a.csv"), expected);
  EXPECT_EQ(IntensityOf("VERSION 0.7\nFIELDS x y z intensity\nSIZE 4 4 4 4\nTYPE F F F F\n"
                        "WIDTH 2\nHEIGHT 1\nPOINTS 2\nDATA ascii\n0 0 0 7\n1 0 0 9\n",
                        "a.pcd"),
            expected);
}

// Columns that have no names are passed over where they hold something else.
TEST(ScanIntensityTest, WordsInAFourthColumnAreNone) {
  for (const char* text : {"2\n0 0 0 wall\n1 0 0 9\n", "2\n0 0 0 7\n1 0 0 -\n"}) {
    std::istringstream in(text);
    const auto scan = ReadScanStream(in, "a.pts", {.intensity = true});
    ASSERT_TRUE(scan.ok()) << scan.status();
    EXPECT_EQ(scan->cloud.points.cols(), 2);
    EXPECT_TRUE(scan->layers.intensity.empty()) << text;
  }
  std::istringstream in("2\n0 0 0 wall 1 2 3\n1 0 0 door 4 5 6\n");
  const auto scan = ReadScanStream(in, "a.pts", {.intensity = true, .colors = true});
  ASSERT_TRUE(scan.ok()) << scan.status();
  EXPECT_EQ(scan->cloud.sights.colors, (std::vector<Rgb>{{1, 2, 3}, {4, 5, 6}}));
  EXPECT_TRUE(scan->layers.intensity.empty());
  EXPECT_TRUE(ColorsOf("0 0 0 1 2 3\n1 0 0 4 5 n/a\n", "a.xyz").empty());
  const auto format_of = [](const char* text) {
    std::istringstream lines(text);
    return ReadScanStream(lines, "a.xyz", {.colors = true})->format;
  };
  EXPECT_EQ(format_of("0 0 0 1 2 3\n1 0 0 4 5 n/a\n2 0 0 4 5 6\n"),
            "text, without the colours that only 2 points have");
  EXPECT_EQ(format_of("0 0 0 1 2 3\n1 0 0 4 5 6\n"), "text");
  EXPECT_EQ(format_of("0 0 0 1 2 wall\n1 0 0 4 5 door\n"), "text");
  EXPECT_EQ(format_of("0 0 0 .1 .2 .3\n1 0 0 .4 .5 n/a\n"), "text");
  std::istringstream named("x y z intensity\n0 0 0 wall\n");
  EXPECT_TRUE(
      absl::IsInvalidArgument(ReadScanStream(named, "a.xyz", {.intensity = true}).status()));
}

TEST(ScanIntensityTest, BecomesAGreyBetweenItsHundredths) {
  ScanFile scan;
  for (int i = 0; i <= 200; ++i) scan.layers.intensity.push_back(static_cast<float>(i));
  scan.layers.intensity.push_back(std::nanf(""));
  ASSERT_TRUE(ColorByIntensity(&scan).ok());
  const std::vector<Rgb>& colors = scan.cloud.sights.colors;
  ASSERT_EQ(colors.size(), 202u);
  EXPECT_EQ(colors[2], (Rgb{0, 0, 0}));
  EXPECT_EQ(colors[100], (Rgb{128, 128, 128}));
  EXPECT_EQ(colors[198], (Rgb{255, 255, 255}));
  EXPECT_EQ(colors[201], (Rgb{0, 0, 0}));
  scan.layers.intensity.assign(202, 5.0F);
  EXPECT_THAT(ColorByIntensity(&scan).message(), ::testing::HasSubstr("is 5 nearly everywhere"));
  scan.layers.intensity.clear();
  EXPECT_THAT(ColorByIntensity(&scan).message(), ::testing::HasSubstr("each point an intensity"));
}

}  // namespace
}  // namespace rilievo::testing
