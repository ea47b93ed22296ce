// The way of a moving scanner, and the stations that it gives to the points of LAS files.
#include "client/formats/trajectory.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <sstream>
#include <string>

#include "client/formats/las_header.h"
#include "client/formats/scan_reader.h"
#include "tests/unit/formats/scan_samples.h"

namespace rilievo {
namespace {

using ::testing::HasSubstr;

absl::StatusOr<Trajectory> ReadWay(const std::string& text) {
  std::istringstream in(text);
  return Trajectory::Read(in);
}

TEST(TrajectoryTest, GoesStraightBetweenItsTimes) {
  const auto trajectory = ReadWay("# way of the aircraft\n12 4 8 100\n10;0;0;100\n\n20,4,0,108\n");
  ASSERT_TRUE(trajectory.ok()) << trajectory.status();
  EXPECT_EQ(trajectory->At(10), Eigen::Vector3d(0, 0, 100));
  EXPECT_EQ(trajectory->At(11), Eigen::Vector3d(2, 4, 100));
  EXPECT_EQ(trajectory->At(12), Eigen::Vector3d(4, 8, 100));
  EXPECT_EQ(trajectory->At(16), Eigen::Vector3d(4, 4, 104));
  EXPECT_EQ(trajectory->At(20), Eigen::Vector3d(4, 0, 108));
  for (const double outside : {9.999, 20.001, std::nan("")}) {
    EXPECT_TRUE(trajectory->At(outside).array().isNaN().all()) << outside;
  }
}

TEST(TrajectoryTest, DoesNotGuessAcrossGaps) {
  const auto trajectory = ReadWay("0 0 0 0\n1 1 0 0\n100 2 0 0\n101 3 0 0\n");
  ASSERT_TRUE(trajectory.ok()) << trajectory.status();
  EXPECT_EQ(trajectory->At(0.5).x(), 0.5);
  EXPECT_TRUE(std::isnan(trajectory->At(50).x()));
  EXPECT_EQ(trajectory->At(100.5).x(), 2.5);
}

TEST(TrajectoryTest, ReadsTheColumnsOfItsHeading) {
  for (const std::string heading : {"\"Easting[m]\",\"GpsTime\",\"Roll\",Northing,Height\n",
                                    "# x gps_time roll y z\n", "%x;time;roll;y;z\n"}) {
    const auto trajectory = ReadWay(heading + "1 5 -9 2 3\n3 6 -9 2 3\n");
    ASSERT_TRUE(trajectory.ok()) << trajectory.status();
    EXPECT_EQ(trajectory->At(5.5), Eigen::Vector3d(2, 2, 3)) << heading;
  }
}

TEST(TrajectoryTest, KeepsTheColumnsOfEmptyFields) {
  for (const std::string text :
       {"time,roll,x,y,z\n0,,1,2,3\n2,-9,3,2,3\n", ";time;x;y;z\n;0;1;2;3\n7;2;3;2;3\n",
        "time\troll\tx\ty\tz\n0\t\t1\t2\t3\n2\t-9\t3\t2\t3\n"}) {
    const auto trajectory = ReadWay(text);
    ASSERT_TRUE(trajectory.ok()) << trajectory.status();
    EXPECT_EQ(trajectory->At(0), Eigen::Vector3d(1, 2, 3)) << text;
    EXPECT_EQ(trajectory->At(1), Eigen::Vector3d(2, 2, 3)) << text;
  }
  const auto shifted = ReadWay("time,x,y,z,roll\n0,1,,3,4\n1,1,2,3,4\n");
  ASSERT_TRUE(absl::IsInvalidArgument(shifted.status()));
  EXPECT_THAT(std::string(shifted.status().message()), HasSubstr("line 2: time, x, y and z"));
}

TEST(TrajectoryTest, RefusesWhatIsNotOne) {
  for (const auto& [text, part] :
       {std::pair("", "0 times"), std::pair("1 2 3 4\n", "1 times"),
        std::pair("1 2 3 4\n1 2 3 4\n", "1 times"),
        std::pair("1 2 3 4\n2 3\n", "line 2: time, x, y and z"), std::pair("1 2 3 nan\n", "line 1"),
        std::pair("1 2 x 4\n", "line 1: 'x'")}) {
    const auto trajectory = ReadWay(text);
    ASSERT_TRUE(absl::IsInvalidArgument(trajectory.status())) << text;
    EXPECT_THAT(std::string(trajectory.status().message()), HasSubstr(part));
  }
}

// Point i has the time 100 + i.
std::string TimedLas(int point_format, int count) {
  const testing::LasSample sample{.minor = 4, .point_format = point_format};
  std::string bytes = testing::LasFile(testing::SpherePoints(count), sample);
  uint32_t first;
  std::memcpy(&first, bytes.data() + 96, sizeof first);
  uint16_t size;
  std::memcpy(&size, bytes.data() + 105, sizeof size);
  for (int i = 0; i < count; ++i) {
    const double time = 100 + i;
    std::memcpy(bytes.data() + first + size_t{size} * static_cast<size_t>(i) +
                    kLasTimeOffsets[point_format],
                &time, sizeof time);
  }
  return bytes;
}

absl::StatusOr<ScanFile> ReadWith(const std::string& las, const Trajectory& trajectory) {
  std::istringstream in(las);
  return ReadLasScan(in, {.stations = true, .trajectory = &trajectory});
}

TEST(TrajectoryTest, GivesLasPointsTheirStations) {
  const Trajectory trajectory = *ReadWay("101 0 0 1000\n110 9 0 1000\n");
  for (const int format : {1, 3, 4, 5, 6, 7, 8, 9, 10}) {
    const auto scan = ReadWith(TimedLas(format, 20), trajectory);
    ASSERT_TRUE(scan.ok()) << scan.status();
    const PointSights& sights = scan->cloud.sights;
    ASSERT_EQ(sights.station_of.size(), 20u);
    EXPECT_EQ(sights.stations.cols(), 10);
    for (int i = 0; i < 20; ++i) {
      const uint16_t station = sights.station_of[static_cast<size_t>(i)];
      if (i < 1 || i > 10) {
        EXPECT_EQ(station, kNoStation);
      } else {
        EXPECT_EQ(sights.stations.col(station), Eigen::Vector3d(i - 1, 0, 1000));
      }
    }
  }
}

TEST(TrajectoryTest, MustHaveTimesOfThePoints) {
  const Trajectory elsewhere = *ReadWay("0 0 0 0\n9 0 0 0\n");
  const auto scan = ReadWith(TimedLas(6, 20), elsewhere);
  ASSERT_TRUE(absl::IsInvalidArgument(scan.status()));
  EXPECT_THAT(std::string(scan.status().message()),
              HasSubstr("from 100 to 119, the trajectory from 0 to 9"));
  const auto timeless = ReadWith(testing::LasFile(testing::SpherePoints(9), {}), elsewhere);
  ASSERT_TRUE(absl::IsInvalidArgument(timeless.status()));
  EXPECT_THAT(std::string(timeless.status().message()), HasSubstr("format 0 have no GPS time"));
}

}  // namespace
}  // namespace rilievo
