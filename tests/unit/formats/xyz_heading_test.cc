// Columns by their names, as the programs write them that scans come from.
#include "client/formats/xyz_heading.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <sstream>

#include "client/formats/scan_reader.h"

namespace rilievo {
namespace {

absl::StatusOr<ScanFile> Read(const std::string& text, const std::string& name) {
  std::istringstream in(text);
  return ReadScanStream(in, name);
}

// The point (1, 2, 3) among other values, and what the format says of it.
struct Sample {
  const char* program;
  std::string text;
  std::string format;
};

const Sample kSamples[] = {
    {"PDAL", "\"X\",\"Y\",\"Z\",\"Intensity\"\n1,2,3,9\n", "text, columns X, Y, Z"},
    {"PDAL with the time first", "\"GpsTime\",\"X\",\"Y\",\"Z\"\n9,1,2,3\n",
     "text, columns X, Y, Z"},
    {"CloudCompare", "//X Y Z R G B\n1 2 3 7 8 9\n", "text, columns X, Y, Z"},
    {"CloudCompare with a count", "//X Y Z R G B\n1\n1 2 3 7 8 9\n", "text, columns X, Y, Z"},
    {"CloudCompare with commas", "//Intensity,X,Y,Z\n9,1,2,3\n", "text, columns X, Y, Z"},
    {"a survey", "Point;Easting;Northing;Height\n17;1;2;3\n",
     "text, columns Easting, Northing, Height"},
    {"north first", "NORTHING\tEASTING\tELEVATION\n2\t1\t3\n",
     "text, columns EASTING, NORTHING, ELEVATION"},
    {"units", "x[m] y[m] z[m] t[s]\n1 2 3 9\n", "text, columns x, y, z"},
    {"units apart", "time [s], x [m], y [m], z [m]\n9, 1, 2, 3\n", "text, columns x, y, z"},
    {"units as words", "x (m) y (m) z (m)\n1 2 3\n", "text, columns x, y, z"},
    {"two heights", "X,Y,Height,Z\n1,2,9,3\n", "text, columns X, Y, Z"},
    {"Excel", "\xef\xbb\xbfX,Y,Z\r\n1,2,3\r\n", "text, columns X, Y, Z"},
    {"Excel without a heading",
     "\xef\xbb\xbf"
     "1,2,3\r\n",
     "text"},
    {"a name with a comma", "\"id, old\",x,y,z\n9,1,2,3\n", "text, columns x, y, z"},
    {"numpy.savetxt", "# x y z nx ny nz\n1 2 3 0 0 1\n", "text, columns x, y, z"},
    // Sentences that hold the same words.
    {"a comment", "# columns are x y z\n1 2 3\n", "text"},
    {"another comment", "// the x, y and z of the points\n1 2 3 4\n", "text"},
    {"a comment behind the heading", "x,y,z,i\n# i x y z\n1,2,3,9\n", "text, columns x, y, z"},
};

TEST(XyzHeadingTest, SamplesAreRead) {
  for (const Sample& sample : kSamples) {
    for (const char* name : {"scan.csv", "scan.txt", "scan"}) {
      const auto scan = Read(sample.text, name);
      ASSERT_TRUE(scan.ok()) << sample.program << ": " << scan.status();
      ASSERT_EQ(scan->cloud.points.cols(), 1) << sample.program;
      EXPECT_EQ(Eigen::Vector3d(scan->cloud.points.col(0)), Eigen::Vector3d(1, 2, 3))
          << sample.program;
      EXPECT_EQ(scan->format, sample.format) << sample.program;
    }
  }
}

TEST(XyzHeadingTest, AHeadingNamesAllThree) {
  for (const char* line : {"", "x", "x y", "a,b,c", "\"X\",\"Y\"", "x;y;y", "easting northing",
                           "\"X Y Z\"", "x.y.z", "[x] [y] [z]"}) {
    EXPECT_FALSE(ParseXyzHeading(line).has_value()) << line;
  }
  const auto heading = ParseXyzHeading("\"Z\" , 'y','X',");
  ASSERT_TRUE(heading.has_value());
  EXPECT_EQ(heading->axis_column, (std::array<int, 3>{2, 1, 0}));
  EXPECT_EQ(heading->columns, 3);
}

TEST(XyzHeadingTest, AHeadingWithoutTheAxesSaysWhatIsWanted) {
  const auto scan = Read("a,b,c\n1,2,3\n", "scan.csv");
  EXPECT_THAT(std::string(scan.status().message()), ::testing::HasSubstr("easting, northing"));
}

}  // namespace
}  // namespace rilievo
