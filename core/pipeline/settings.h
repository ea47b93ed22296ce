// Settings of pipeline.
#pragma once

#include <cstdint>
#include <limits>

#include "core/base/ablation.h"

namespace rilievo {

struct AnalyzePagesSettings {
  double near_spacings =
      3;  // of a thinned point: what is no farther from it takes its place and normal
};
RILIEVO_SETTINGS AnalyzePagesSettings kAnalyzePages;

struct CertificateSettings {
  // By how much a figure measured again may differ from the one that is stated: of the larger, and
  // of the diagonal.
  double relative = 3e-4, absolute = 5e-13;
  int certified_samples = 50000;  // points and places that are measured: an RMS to 1 %
};
RILIEVO_SETTINGS CertificateSettings kCertificate;

struct CoarseSurfaceSettings {
  // Points that the coarse pass sees of a scan with thick noise, for each that tells of shape.
  int64_t sampled_of_telling = 2;
  int64_t thinned_per_face = 4;  // fewest thinned points of a control face
  double points_per_vertex = 4;  // of the coarse surface
};
RILIEVO_SETTINGS CoarseSurfaceSettings kCoarseSurface;

struct CodeStoredSurfaceSettings {
  int64_t most_faces = 1024;  // of a group of the coded surface
};
RILIEVO_SETTINGS CodeStoredSurfaceSettings kCodeStoredSurface;

struct CodeSurfaceSettings {
  double share_of_own = 0.3;  // sqrt(1 + 0.3^2) = 1.044
  // Of an error asked for. Where it cannot be measured: what the surface errs between the points is
  // not all in its own error.
  double aim_measured = 0.985, aim = 0.96;
  double noise_room = 1.12;              // sqrt(1 + 0.5^2): see NoiseAllows()
  double finest = 1e-7, coarsest = 0.1;  // EncodeOptions::max_error
  // Of KeepError().
  double close = 0.98;  // of the error asked for: bytes to be won above are not worth it
  // Of it, between that and 1; a narrower bracket of coding errors is not divided further.
  double keep_aim = 0.99;
  double least_factor = 0.4, most_factor = 1.6;  // of the coding error, from one trial to the next
  double wide = 1.0 / 3;                         // a figure that takes as many bytes as any
  double spacings = 1.0 / 80;  // the least error of a surface between its points: see OwnError()
  // How often the heights are coded and measured once more, at most.
  int keep_error_rounds = 6;
};
RILIEVO_SETTINGS CodeSurfaceSettings kCodeSurface;

struct ColorSurfaceSettings {
  // Of the bytes asked for the part that is kept free for colours until they are coded, and the
  // part that heights are coded once more for when colours leave it.
  int64_t color_part = 3, worth_of_heights = 50;
};
RILIEVO_SETTINGS ColorSurfaceSettings kColorSurface;

struct CompactPartsSettings {
  double grid = 1 << 20;  // per diagonal
};
RILIEVO_SETTINGS CompactPartsSettings kCompactParts;

struct DomainOfMeshSettings {
  double least_area = 1e-12;      // of the squared diagonal, twice the area
  int sharp_edges_of_corner = 3;  // that meet at a vertex; two are a crease that goes on
};
RILIEVO_SETTINGS DomainOfMeshSettings kDomainOfMesh;

struct EditSurfaceSettings {
  // Of the file's step: heights that were rounded once are rounded again, to half of that error. A
  // step gets no finer than least_step by that, or a file would grow by each of many edits.
  double share_of_step = 0.5, least_step = 1e-5;
};
RILIEVO_SETTINGS EditSurfaceSettings kEditSurface;

struct FitDomainSettings {
  double share_of_faces = 0.21;        // that are tried next, of those before
  int fewest_faces = 100;              // of a control mesh that is tried
  double least_noise_spacings = 0.08;  // noise from which fewer faces are judged by the noise
  // RMS distance of the points from the domain, in standard deviations of their noise. At a fifth
  // of the faces smooth objects came to 1.14 under little noise, of which the nearest points show
  // too little, and to 1.04 at most from the ratio to the spacing on at which its scale is known
  // (kThickNoise.understated_noise); thin walls and detail to 1.8 and more, and to 1.11.
  double most_noise = 1.22, most_known_noise = 1.07;
  int fewest_exact = 24;  // faces
  int level_of_reach = 3,
      samples_of_reach =
          20'000;  // where the reach of a coarser domain is measured, and at so many places
  // Of position steps.
  double coarsest_step = 5e-3;
  double finest_of_lines = 1e-4;  // the finest where known lines ask for it
  // How far the curve may be off, and the coarsest step of its points: rounding moves them by
  // sqrt(3) / 2 of it at most. Lines cut along a curved shape are off by kTrimTolerance. Together
  // less than 1.
  double miss_of_borders = 0.65, step_of_borders = 0.15;  // of kControlOptions.exact_border
  // Of edges of the border, each to half of its length.
  int most_halvings = 4;
  double of_short_edges = 0.1, short_share = 0.05;  // the edge that 5 % are shorter than
  double of_coding_error = 4;  // what flat parts are rounded to, in the coding error
  int edges_per_crease = 50;   // a part with fewer creases than that counts as smooth
  // No heights take up the rounding of control points where there are no points.
  double step_where_filled = 1e-3;
};
RILIEVO_SETTINGS FitDomainSettings kFitDomain;

struct FitFromPagesSettings {
  // Around a part. With four the control points differ by 0.02 to 0.08 spacings from those of a fit
  // of the whole.
  int rings_around = 4;
};
RILIEVO_SETTINGS FitFromPagesSettings kFitFromPages;

struct HeightsInPartsSettings {
  // Of the triangles among which points look for their control face.
  int search_level = 1;
  // Around a part, at least: so many edges of the finest level. Filters reach less far; which ones
  // are chosen depends on points somewhat farther away, so that they differ a little at seams.
  int edges_around = 16;
  // Over so many control edges without points a height decays to exp(-12 / 6) of itself, see
  // SolveSettings::height_range.
  int bare_rings = 12;
};
RILIEVO_SETTINGS HeightsInPartsSettings kHeightsInParts;

// Fractions of the diagonal that may be asked for.
struct OptionLengthsSettings {
  double least_error = 1e-6, most_error = 0.1;  // max_error
  double least_step = 1e-9;                     // of heights; the most is the codec's
};
RILIEVO_SETTINGS OptionLengthsSettings kOptionLengths;

struct PageRunsSettings {
  double larger_half = 0.8;  // of the points: with more in it, halving is not worth it
  // Points so far from a part tell of it too; in median spacings of the thinned points. Normals of
  // all points agree with those of the whole scan from four spacings on, heights from eight; under
  // noise all but one normal in a hundred, where the border of a part cuts cells of the curve.
  double part_halo = 8;
};
RILIEVO_SETTINGS PageRunsSettings kPageRuns;

struct PagesToThinSettings {
  // Pages are read and analyzed so many at a time.
  int64_t pages_of_run = 64;
  // Those that the medians come of, where the scan has more.
  int64_t sampled_runs = 16;
};
RILIEVO_SETTINGS PagesToThinSettings kPagesToThin;

struct PointsOnSurfaceSettings {
  double median_of_normal = 0.6745;  // of |x|, where x has a deviation of 1
  // A point that is this many times farther off along the surface than across it lies beyond a
  // border.
  double beyond = 2;
};
RILIEVO_SETTINGS PointsOnSurfaceSettings kPointsOnSurface;

struct ReconstructSettings {
  // Points, faces or vertices of a part that options may ask for.
  int64_t least_of_part = 1024, most_of_part = std::numeric_limits<int32_t>::max();
};
RILIEVO_SETTINGS ReconstructSettings kReconstruct;

struct ReportWarningsSettings {
  // Thresholds beyond which a figure deserves a sentence.
  double poor_fit_spacings = 2.0;    // RMS of the points beyond their noise, in spacings
  double filled_share = 0.2;         // of all heights
  double disagreement_share = 0.05;  // of neighbouring normals
  double mostly_one_way = 1.5, mostly_noise = 0.75;  // shares of an error that explain it
};
RILIEVO_SETTINGS ReportWarningsSettings kReportWarnings;

struct SampleHeightsSettings {
  double noises = 2.5;  // distance of vertices where these are more than the spacing
  // The heights of so many vertices take 0.1 GB to find; those of twice as many are found at once.
  int64_t part_vertices = 300'000;
};
RILIEVO_SETTINGS SampleHeightsSettings kSampleHeights;

struct SearchControlFacesSettings {
  double ratio = 0.4;       // of the faces of one rung of the ladder to those of the rung above
  int fewest_faces = 40;    // that are tried
  double step_ratio = 1.5;  // of position steps
  double alike = 1.01;      // errors
};
RILIEVO_SETTINGS SearchControlFacesSettings kSearchControlFaces;

struct ShapeMeshSettings {
  // Of the edges of the mesh that is simplified, in those of equilateral triangles as many as
  // ShapeControlMesh() looks at.
  double longest_edge = 2;
  // Pieces of needles, in these.
  int64_t needle_pieces = 4;
  // Borders are exact, other than those of a scan, where the same weight would follow the
  // raggedness of its points: a vase of 70 openings comes to 0.87 of the RMS error that it has with
  // a weight of 1.
  double border_weight = 20;
  // Of arcs between points where no error is asked for: what conversions are to keep.
  double most_sagitta = 1e-4;
};
RILIEVO_SETTINGS ShapeMeshSettings kShapeMesh;

struct SharedCodingSettings {
  // What a part of a pass over the blocks holds of them: several, where that leaves some parts.
  int few_parts = 8, most_items_of_part = 4;
};
RILIEVO_SETTINGS SharedCodingSettings kSharedCoding;

struct SurfaceFromPagesSettings {
  double analyzed = 0.55, fitted = 0.65;  // of the time
};
RILIEVO_SETTINGS SurfaceFromPagesSettings kSurfaceFromPages;

struct UpdateSurfaceSettings {
  // Rings of patches around contradicted ones whose heights are made anew as well; along the last
  // of them they pass over into the old ones. As many rings of control faces around these tell the
  // plate and the points.
  int rings = 2;
  // Of the points that contradict the surface, those that may still do so in the end.
  double most_unreached = 0.1;
  double leverage = 1.0 / 16;  // of most heights; the file does not tell
  double usual_step = 2e-5;    // of heights, where the file has none
};
RILIEVO_SETTINGS UpdateSurfaceSettings kUpdateSurface;

}  // namespace rilievo
