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
    // A field may be empty in the heading and in the lines of the points.
    {"pandas with its index", ",x,y,z\n0,1,2,3\n", "text, columns x, y, z"},
    {"pandas with its index, tabs", "\tx\ty\tz\n0\t1\t2\t3\n", "text, columns x, y, z"},
    {"a point without its number", "Point;Easting;Northing;Height\n;1;2;3\n",
     "text, columns Easting, Northing, Height"},
    {"a point without its time", "time,x,y,z\n ,1,2,3\n", "text, columns x, y, z"},
    {"a tab for what is not known", "x\tcode\ty\tz\n1\t\t2\t3\n", "text, columns x, y, z"},
    {"nothing in a comment's columns", "//x,code,y,z,note\n1,,2,3,\n", "text, columns x, y, z"},
    {"a column without a name", "x,,y,z,\n1,9,2,3,\n", "text, columns x, y, z"},
    {"rows of commas", "x,y,z\n,,\n1,2,3\n,,\n", "text, columns x, y, z"},
    {"commas with tabs", "x,\tcode,\ty,\tz\n1,\t,\t2,\t3\n", "text, columns x, y, z"},
    // Blanks in a row are one separator, also beside a tab.
    {"columns of blanks", "  x    y    z\n  1    2    3  \n", "text, columns x, y, z"},
    {"blanks and tabs", "x \t y\tz\n1 \t 2\t3\n", "text, columns x, y, z"},
    {"blanks beside tabs", "1 2\t3\t7 8 9\n", "text"},
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

TEST(XyzHeadingTest, AnEmptyCoordinateIsAnErrorThatNamesIt) {
  for (const char* text : {"x,y,z\n1,2,3\n1,,3\n", "x\ty\tz\n1\t2\t3\n1\t\t3\t4\n"}) {
    const auto scan = Read(text, "scan.csv");
    ASSERT_TRUE(absl::IsInvalidArgument(scan.status())) << text;
    EXPECT_THAT(
        std::string(scan.status().message()),
        ::testing::HasSubstr("line 3: nothing between two separators in column 2, where y"));
  }
}

TEST(XyzHeadingTest, AnEmptyClassIsNotTheOneAskedFor) {
  std::istringstream in("x,y,z,note,classification\n1,2,3,,2\n4,5,6,2,\n");
  const auto scan = ReadScanStream(in, "scan.csv", {.classes = {2}});
  ASSERT_TRUE(scan.ok()) << scan.status();
  ASSERT_EQ(scan->cloud.points.cols(), 1);
  EXPECT_EQ(Eigen::Vector3d(scan->cloud.points.col(0)), Eigen::Vector3d(1, 2, 3));
}

TEST(XyzHeadingTest, AHeadingNamesAllThree) {
  for (const char* line : {"", "x", "x y", "a,b,c", "\"X\",\"Y\"", "x;y;y", "easting northing",
                           "\"X Y Z\"", "x.y.z", "[x] [y] [z]"}) {
    EXPECT_FALSE(ParseXyzHeading(line).has_value()) << line;
  }
  const auto heading = ParseXyzHeading("\"Z\" , 'y','X',");
  ASSERT_TRUE(heading.has_value());
  EXPECT_EQ(heading->axis_column, (std::array<int, 3>{2, 1, 0}));
  EXPECT_EQ(heading->names, (std::vector<std::string>{"z", "y", "x"}));
}

TEST(XyzHeadingTest, AHeadingWithoutTheAxesSaysWhatIsWanted) {
  const auto scan = Read("a,b,c\n1,2,3\n", "scan.csv");
  EXPECT_THAT(std::string(scan.status().message()), ::testing::HasSubstr("easting, northing"));
}

}  // namespace
}  // namespace rilievo
