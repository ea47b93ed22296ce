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
  std::vector<std::string> names;  // of the columns, in lower case; empty where there is none
  std::string axis_names;          // "X, Y, Z", as the line writes them
};

// Of a line without the # or // in front. The axes are called x, y and z, or easting, northing and
// height (east, north; elevation, altitude), in any case; each may stand in quotes and have its
// unit behind it, "x[m]" or "X (m)". Columns are counted as NextField() does: ",x,y,z" has four.
// Nothing when one of the axes is not named.
std::optional<XyzHeading> ParseXyzHeading(std::string_view line);

}  // namespace rilievo
