// How long a reconstruction by parts still takes.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "rilievo/v1/reconstruction.pb.h"

namespace rilievo {

// Knows how the work of a scan falls to the steps, and measures how fast it is done.
class TimeLeft {
 public:
  // Of so many points, and so many in the coarse pass.
  TimeLeft(int64_t points, int64_t thinned_points);

  // Seconds left once a stage has come to `fraction`, `seconds` after the first call; stages come
  // in order, and those that an earlier run has finished not at all. Unset while too little is done
  // to tell. An error that is kept by measuring several times takes longer than this says.
  std::optional<double> After(v1::Stage stage, double fraction, double seconds);

 private:
  struct Step {
    v1::Stage stage;
    double work;
  };

  std::vector<Step> steps_;
  std::optional<size_t> at_;   // the step that is being done
  double fraction_ = 0;        // of it
  double begun_fraction_ = 0;  // of it, when it was first heard of
  double done_ = 0;            // work of those before it
};

// "about 20 s left", "about 3 min left", "about 2 h left".
std::string TimeLeftText(double seconds);

}  // namespace rilievo
