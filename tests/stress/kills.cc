#include <signal.h>

#include <algorithm>
#include <random>

#include "tests/stress/known_scans.h"
#include "tests/stress/ledger.h"
#include "tests/stress/parts.h"
#include "tests/stress/stress_server.h"

namespace rilievo::stress {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

// Submits jobs of all known scans, several at a time, as long as it lives.
class Submitters {
 public:
  Submitters(const StressServer& server, const std::string& name, int most_waiting)
      : server_(server), name_(name), most_waiting_(most_waiting) {
    for (int i = 0; i < 3; ++i) {
      threads_.emplace_back([this, i](const std::stop_token& stop) { Submit(i, stop); });
    }
  }

  // Stops them, waits for the answers that are due, and asks for every job.
  Audit Finish() {
    threads_.clear();
    return ledger_.Check(server_);
  }

  int refused() const { return refused_; }

 private:
  void Submit(int who, const std::stop_token& stop) {
    const JobsClient jobs = server_.Jobs(OwnConnection(server_.address()));
    std::vector<std::string> waiting;
    for (int n = 0; !stop.stop_requested(); ++n) {
      const size_t scan = static_cast<size_t>(n + who) % KnownScans().size();
      const auto job =
          jobs.Submit(KnownScans()[scan].packed, {}, absl::StrFormat("%s-%d-%d", name_, who, n), {},
                      Within(seconds(60)));
      if (!job.ok()) {
        ++refused_;
        continue;
      }
      ledger_.Acknowledged(job->job_id(), scan);
      waiting.push_back(job->job_id());
      if (static_cast<int>(waiting.size()) < most_waiting_) continue;
      jobs.Watch(waiting.front(), {}, Within(seconds(60))).status().IgnoreError();
      waiting.erase(waiting.begin());
    }
  }

  const StressServer& server_;
  const std::string name_;
  const int most_waiting_;
  Ledger ledger_;
  std::atomic<int> refused_ = 0;
  std::vector<std::jthread> threads_;
};

// A job whose worker or server is killed ten times fails, as it should; these are to succeed.
bool SomeJobHasHadEnough(const JobsClient& jobs) {
  constexpr uint32_t kAttempts = 7;
  // All: one that was met with kills waits until nothing else does, and grows old.
  constexpr size_t kMostJobs = 100'000;
  const auto listed = jobs.List(kMostJobs, Within(seconds(10)));
  return listed.ok() && std::any_of(listed->begin(), listed->end(), [](const v1::Job& job) {
           const bool unfinished =
               job.state() == v1::JOB_STATE_QUEUED || job.state() == v1::JOB_STATE_RUNNING;
           return unfinished && job.attempts() >= kAttempts;
         });
}

void KillServers(const Scale& scale, Report* report) {
  StressServer server;
  server.Start({"--threads", "1"});
  std::mt19937 random(1);
  Submitters submitters(server, "s", 3);
  for (int kill = 0; kill < scale.kills; ++kill) {
    std::this_thread::sleep_for(milliseconds(random() % 400));
    const auto patience = std::chrono::steady_clock::now() + seconds(30);
    while (SomeJobHasHadEnough(server.Jobs()) && std::chrono::steady_clock::now() < patience) {
      std::this_thread::sleep_for(milliseconds(20));
    }
    server.Kill();
    server.Start({"--threads", "1"});
  }
  const Audit audit = submitters.Finish();
  report->Expect(
      "kills",
      absl::StrFormat("kill -9 of the server %d times: every job ends, same bytes", scale.kills),
      audit.clean() && submitters.refused() == 0, audit.Words());
}

void KillWorkers(const Scale& scale, Report* report) {
  StressServer server;
  server.Start({"--threads", "1"});
  std::mt19937 random(2);
  Submitters submitters(server, "w", 3);
  int killed = 0;
  const JobsClient jobs = server.Jobs();
  const auto end = std::chrono::steady_clock::now() + seconds(30) + scale.kills * seconds(3);
  while (killed < scale.kills && std::chrono::steady_clock::now() < end) {
    const pid_t worker = server.process().WaitForWorker(seconds(5));
    // Up to about twice the time of a job: half of them come to their end.
    std::this_thread::sleep_for(milliseconds(random() % 200));
    const auto now = server.process().Workers();
    if (std::find(now.begin(), now.end(), worker) == now.end()) continue;
    if (SomeJobHasHadEnough(jobs)) continue;
    killed += kill(worker, SIGKILL) == 0;
  }
  const Audit audit = submitters.Finish();
  report->Expect(
      "kills",
      absl::StrFormat("kill -9 of a worker %d times: every job ends, same bytes", scale.kills),
      killed == scale.kills && audit.clean() && submitters.refused() == 0,
      absl::StrFormat("%d killed; %s", killed, audit.Words()));
}

}  // namespace

void Kills(const Scale& scale, Report* report) {
  KillServers(scale, report);
  KillWorkers(scale, report);
}

}  // namespace rilievo::stress
