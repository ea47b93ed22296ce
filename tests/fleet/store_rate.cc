// How many lives of jobs a shared store takes a second: store_rate URL SECONDS
// Prints two figures: jobs that are there already claimed, begun and finished, and jobs made,
// claimed, begun and finished; by 24 threads over three stores.
#include <atomic>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "absl/strings/str_cat.h"
#include "server/postgres/postgres_store.h"

namespace rilievo {
namespace {

using Clock = std::chrono::steady_clock;

constexpr int kStores = 3, kThreads = 24;

void Check(const absl::Status& status) {
  if (status.ok()) return;
  std::fprintf(stderr, "%s\n", std::string(status.message()).c_str());
  std::exit(1);
}

class Rate {
 public:
  explicit Rate(const std::string& url) {
    for (int i = 0; i < kStores; ++i) {
      auto opened = OpenPostgresStore(url, "pg:", {});
      Check(opened.status());
      stores_.push_back(*std::move(opened));
    }
    scan_ = *stores_[0]->blobs().Put({{1, 2, 3}});
    Check(stores_[0]->AddScan("", scan_));
  }

  void Make(JobStore* store, int client) {
    StoredJob job;
    job.client = absl::StrCat("client", client);
    const std::string id = absl::StrCat("job", made_++);
    job.job.set_job_id(id);
    job.job.set_request_id(id);
    job.job.set_scan_id(scan_);
    job.job.set_state(v1::JOB_STATE_QUEUED);
    Check(store->Insert(job).status());
  }

  // False when none waits.
  bool Live(JobStore* store, const std::string& worker) {
    auto claimed = store->Claim({.worker = worker, .memory = 1, .idle = true});
    Check(claimed.status());
    if (!*claimed) return false;
    StoredJob job = **std::move(claimed);
    job.job.set_state(v1::JOB_STATE_RUNNING);
    Check(store->Update(job));
    job.job.set_state(v1::JOB_STATE_SUCCEEDED);
    const std::string& id = job.job.job_id();
    Check(store->Finish(job, {{id.begin(), id.end()}}));
    return true;
  }

  // Of `body` on all threads until it returns false or the time is over, per second.
  template <typename Body>
  double Measure(double seconds, const Body& body) {
    std::atomic<int> done{0};
    const Clock::time_point begin = Clock::now();
    std::vector<std::jthread> threads;
    for (int i = 0; i < kThreads; ++i) {
      threads.emplace_back([&, i] {
        JobStore* const store = stores_[static_cast<size_t>(i % kStores)].get();
        while (Seconds(begin) < seconds && body(store, i)) ++done;
      });
    }
    threads.clear();
    return done / Seconds(begin);
  }

 private:
  static double Seconds(Clock::time_point since) {
    return std::chrono::duration<double>(Clock::now() - since).count();
  }

  std::vector<std::unique_ptr<JobStore>> stores_;
  std::string scan_;
  std::atomic<int> made_{0};
};

int Main(const std::string& url, double seconds) {
  Rate rate(url);
  // More than can be done in the time.
  std::atomic<int> left{static_cast<int>(600 * seconds)};
  rate.Measure(3600, [&](JobStore* store, int thread) {
    rate.Make(store, thread % 7);
    return --left > 0;
  });
  const auto live = [&](JobStore* store, int thread) {
    return rate.Live(store, absl::StrCat("worker", thread));
  };
  const double there = rate.Measure(seconds, live);
  const double made = rate.Measure(seconds, [&](JobStore* store, int thread) {
    rate.Make(store, thread % 7);
    return live(store, thread);
  });
  std::printf("%.0f %.0f\n", there, made);
  return 0;
}

}  // namespace
}  // namespace rilievo

int main(int count, char** words) {
  if (count != 3) return 2;
  return rilievo::Main(words[1], std::atof(words[2]));
}
