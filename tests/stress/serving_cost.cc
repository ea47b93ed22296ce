#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <fstream>
#include <iterator>

#include "core/pipeline/reconstruct.h"
#include "tests/stress/known_scans.h"
#include "tests/stress/parts.h"
#include "tests/stress/stress_server.h"

namespace rilievo::stress {
namespace {

constexpr char kCostPart[] = "cost";
constexpr double kMostRatio = 1.05;

struct Cost {
  double wall = 0, processor = 0;  // seconds
};

double SecondsOf(const rusage& usage) {
  const auto in_seconds = [](const timeval& time) {
    return static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec);
  };
  return in_seconds(usage.ru_utime) + in_seconds(usage.ru_stime);
}

double OwnProcessorSeconds() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return SecondsOf(usage);
}

// Of the process and of the workers that it has waited for.
double ProcessorSecondsOf(pid_t process) {
  std::ifstream stat(absl::StrFormat("/proc/%d/stat", process));
  std::string text((std::istreambuf_iterator<char>(stat)), {});
  // The fields behind the name, which may hold anything, begin with the third.
  long ticks[4] = {};
  std::sscanf(text.c_str() + text.rfind(')') + 1,
              " %*c %*d %*d %*d %*d %*d %*u %*u %*u %*u %*u %ld %ld %ld %ld", &ticks[0], &ticks[1],
              &ticks[2], &ticks[3]);
  return static_cast<double>(ticks[0] + ticks[1] + ticks[2] + ticks[3]) /
         static_cast<double>(sysconf(_SC_CLK_TCK));
}

double Median(std::vector<double> values) {
  std::nth_element(values.begin(), values.begin() + static_cast<int64_t>(values.size() / 2),
                   values.end());
  return values[values.size() / 2];
}

}  // namespace

void ServingCost(const Scale& scale, Report* report) {
  StressServer server;
  server.Start();
  const PointCloud scan = Simulated("torus", 100'000, 0.0005);
  const ReconstructionClient client(OwnConnection(server.address()));
  const auto by_library = [&] {
    const double before = OwnProcessorSeconds();
    const auto start = std::chrono::steady_clock::now();
    const auto result = Reconstruct(scan, {}, {});
    return Cost{SecondsSince(start), OwnProcessorSeconds() - before};
  };
  const pid_t process = server.process().pid();
  // The client's own work counts too.
  const auto by_server = [&] {
    const double before = OwnProcessorSeconds() + ProcessorSecondsOf(process);
    const auto start = std::chrono::steady_clock::now();
    const auto result = client.Reconstruct(scan, {});
    return Cost{SecondsSince(start), OwnProcessorSeconds() + ProcessorSecondsOf(process) - before};
  };
  by_library();
  by_server();
  std::vector<double> wall, processor, library_wall, library_processor;
  for (int pair = 0; pair < scale.cost_pairs; ++pair) {
    const bool library_first = pair % 2 == 0;
    Cost one = library_first ? by_library() : by_server();
    Cost two = library_first ? by_server() : by_library();
    if (!library_first) std::swap(one, two);
    library_wall.push_back(one.wall);
    library_processor.push_back(one.processor);
    wall.push_back(two.wall / one.wall);
    processor.push_back(two.processor / one.processor);
  }
  report->Expect(
      kCostPart, "serving 100 000 points costs at most 5 % over the library call (processor time)",
      Median(processor) <= kMostRatio,
      absl::StrFormat("median of %d pairs: processor %+.1f %% of %.2f s, wall %+.1f %% of %.2f s",
                      scale.cost_pairs, 100 * (Median(processor) - 1), Median(library_processor),
                      100 * (Median(wall) - 1), Median(library_wall)));
}

}  // namespace rilievo::stress
