// Settings of scan/clean.
#pragma once

#include "core/base/ablation.h"

namespace rilievo {

struct CheckScanSettings {
  // The robust box spans these quantiles of each axis ...
  double stray_quantile = 0.02;
  // ... and a point this many of its diagonals away from its centre is a stray. Rooms seen through
  // a window, a street behind a facade or a few stations of a survey stay well below; a point at
  // 1e9 beside a unit sphere would leave the sphere a single cell of every grid of a later stage.
  double stray_factor = 50.0;
  // Standard deviations below this share of the diagonal count as no extent: about ten times what
  // rounding the coordinates to float32 leaves of a line or a plane.
  double flat_ratio = 1e-6;
  // Fewest distinct finite points that are taken for a surface.
  int min_scan_points = 20;
};
RILIEVO_SETTINGS CheckScanSettings kCheckScan;

struct FindFoliageSettings {
  // Of the distances to the neighbours along the normals. As many are of a point's own sheet.
  double own_sheet = 0.4;
  // How far off foliage is: in spacings, and in the scan's median, of lengths and of spacings.
  float off_spacing = 0.2F, off_median = 2.5F;
  // Points whose neighbourhoods of so many rings hold more such points belong to it.
  int rings = 2;
  float most_off = 1.0F / 3;  // share of such points, from which the neighbourhood is foliage
  // A neighbourhood is a volume where its deviation across its plane is more than this share of the
  // deviation along it. Rods look like one over few rings, but not over many; so does noise up to
  // most of a spacing. Leaves are a volume over both.
  double volume = 0.35;
  int volume_rings = 8;  // the many
  // Components with fewer points that lie deep in volumes, as all their neighbours do, are details:
  // the foot of a thin wall is a volume too, but a narrow one.
  int fewest_leaves = 100;
};
RILIEVO_SETTINGS FindFoliageSettings kFindFoliage;

struct RemoveOutliersSettings {
  // No island with so many points is dropped, however large the scan.
  int largest_island = 200;
  // How fast the spacing of a real scan grows from one place to the next: a scanner at 30 times its
  // height sees the ground at 0.1.
  double spacing_growth = 0.1;
  // Off sheets, where nothing is seen at a flat angle.
  double growth_off_sheets = 0.03;
  // Thicknesses of a sheet, and of the sheets of a scan, beyond which a point lies off them.
  double thicknesses_off = 4;
  double sheet = 0.3;          // thickness of a sheet against its spread
  double cloud_ratio = 0.33;   // thickness against spread; a sharp edge has more
  double cloud_sparse = 2.0;   // mean distance against the usual one
  double sheet_ratio = 0.2;    // thickness against spread of what is still a sheet
  double volume_ratio = 0.4;   // and of what is not a sheet at all
  double volume_sparse = 0.6;  // of factor, enough in a volume of points
  double off_usual = 0.3;      // of factor * usual distance
  double reject = 3.0;         // of factor
};
RILIEVO_SETTINGS RemoveOutliersSettings kRemoveOutliers;

}  // namespace rilievo
