// What programs find in files of plane sections.
#include "client/formats/section_writer.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <regex>
#include <sstream>
#include <string>
#include <vector>

namespace rilievo {
namespace {

using Eigen::Vector3d;
using ::testing::HasSubstr;

// A square with a hole and an open line, in the plane y = 2.
PlaneSection Section() {
  PlaneSection section;
  section.plane = {Vector3d::UnitY(), 2};
  const auto add = [&](const std::vector<Vector3d>& points, bool closed) {
    SectionPolyline polyline;
    polyline.closed = closed;
    polyline.points.resize(3, static_cast<Eigen::Index>(points.size()));
    for (size_t i = 0; i < points.size(); ++i) {
      polyline.points.col(static_cast<Eigen::Index>(i)) = points[i];
    }
    section.polylines.push_back(polyline);
  };
  add({{10, 2, 0}, {14, 2, 0}, {14, 2, 4}, {10, 2, 4}}, true);
  add({{11, 2, 1}, {11, 2, 2}, {12.5, 2, 1}}, true);
  add({{15, 2, 0}, {16, 2, 5}}, false);
  return section;
}

int Count(const std::string& text, const std::string& pattern) {
  const std::regex regex(pattern);
  return static_cast<int>(std::distance(std::sregex_iterator(text.begin(), text.end(), regex), {}));
}

TEST(SectionWriterTest, ObjHasLinesThatEndWhereTheyBegin) {
  std::ostringstream out;
  ASSERT_TRUE(WriteObjSections(std::vector{Section(), Section()}, out).ok());
  EXPECT_EQ(Count(out.str(), "\nv "), 18);
  EXPECT_THAT(out.str(), HasSubstr("o section_1\nv 10 2 0\nv 14 2 0\n"));
  EXPECT_THAT(out.str(), HasSubstr("\nl 1 2 3 4 1\n"));
  EXPECT_THAT(out.str(), HasSubstr("\nl 8 9\n"));
  EXPECT_THAT(out.str(), HasSubstr("\nl 10 11 12 13 10\n"));
}

TEST(SectionWriterTest, DxfHasPairsOfGroupsAndPolylinesThatEnd) {
  std::ostringstream out;
  ASSERT_TRUE(WriteDxfSections(std::vector{Section(), Section()}, out).ok());
  const std::string text = out.str();
  std::istringstream lines(text);
  int closed = 0, vertices = 0, polylines = 0, ended = 0;
  std::string entity, last;
  for (std::string code, value; std::getline(lines, code) && std::getline(lines, value);) {
    ASSERT_TRUE(std::regex_match(code, std::regex("[0-9]+"))) << code;
    if (code == "0") {
      entity = value;
      polylines += value == "POLYLINE";
      vertices += value == "VERTEX";
      ended += value == "SEQEND";
    }
    if (code == "70" && entity == "POLYLINE") closed += value == "9";
    last = value;
  }
  EXPECT_EQ(polylines, 6);
  EXPECT_EQ(ended, 6);
  EXPECT_EQ(vertices, 18);
  EXPECT_EQ(closed, 4);
  EXPECT_EQ(last, "EOF");
  EXPECT_THAT(text, HasSubstr("\n8\nsection_2\n10\n12.5\n20\n2\n30\n1\n"));
}

// Seen along -y from the tip of the normal, x runs to the left.
TEST(SectionWriterTest, SvgIsSeenFromTheTipOfTheNormal) {
  std::ostringstream out;
  ASSERT_TRUE(WriteSvgSection(std::vector{Section()}, out).ok());
  const std::string text = out.str();
  EXPECT_THAT(text, HasSubstr("viewBox=\"0 0 6 5\""));
  EXPECT_THAT(text, HasSubstr("M6 5L2 5L2 1L6 1Z"));
  EXPECT_THAT(text, HasSubstr("fill=\"none\" d=\"M1 5L0 0\n"));
  EXPECT_THAT(text, HasSubstr("the origin of the picture is at 16 2 5"));
  EXPECT_EQ(Count(text, "Z"), 2);
}

TEST(SectionWriterTest, SvgHoldsOneSectionThatIsThere) {
  std::ostringstream out;
  EXPECT_THAT(std::string(WriteSvgSection(std::vector{Section(), Section()}, out).message()),
              HasSubstr("one section, not 2"));
  PlaneSection empty;
  EXPECT_THAT(std::string(WriteSvgSection(std::vector{empty}, out).message()),
              HasSubstr("does not meet"));
  EXPECT_THAT(std::string(WriteSections("a.ply", std::vector{empty}).message()),
              HasSubstr(".obj, .dxf or .svg"));
}

}  // namespace
}  // namespace rilievo
