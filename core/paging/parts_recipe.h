// What tells runs by parts apart that share none.
#pragma once

namespace rilievo {

// Raised with each change of how a run is cut into parts, or of what comes of one: processes that
// differ in it share no parts, and a run that was killed does not go on with those of another.
inline constexpr int kPartsRecipe = 15;

}  // namespace rilievo
