// The line that names the columns of a text file of points.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace rilievo {

struct XyzHeading {
  std::array<int, 3> axis_column;  // of x, y and z, from 0
  int columns;                     // that are named
  std::vector<std::string> names;  // of them, in lower case
  std::string axis_names;          // "X, Y, Z", as the line writes them
};

// Of a line without the # or // in front. The axes are called x, y and z, or easting, northing and
// height (east, north; elevation, altitude), in any case; each may stand in quotes and have its
// unit behind it, "x[m]" or "X (m)". Nothing when one of them is not named.
std::optional<XyzHeading> ParseXyzHeading(std::string_view line);

}  // namespace rilievo
