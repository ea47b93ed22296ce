// The kept jobs that are not finished: in the queue, at work, and watched.
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "rilievo/v1/jobs.pb.h"
#include "server/jobs/job_events.h"
#include "server/jobs/job_run.h"
#include "server/rpc/service_core.h"
#include "server/store/job_store.h"

namespace rilievo {

// Thread-safe. Functions that wait for the disk say so. What a watcher or a client is told is on
// disk.
class JobBoard {
 public:
  JobBoard(ServiceCore* core, JobStore* store) : core_(core), store_(store) {}

  // Stops what runs, without a word to the store: the next server works on it again.
  ~JobBoard();

  JobBoard(const JobBoard&) = delete;
  JobBoard& operator=(const JobBoard&) = delete;

  // Queues what an earlier server left unfinished; nothing of a shared store, where that is
  // anybody's. Waits for the disk.
  absl::Status Restore();

  // Queues a job that was claimed, as its last worker left it. Waits for the disk.
  void TakeUp(StoredJob stored);

  // Queues a job that the store holds. Waits for the disk.
  void Add(StoredJob stored);

  // Tries again to keep results that the store had no room or no time for.
  void KeepResults();

  // How many are not finished; and of one client.
  int size() const;
  int size(const std::string& client) const;

  // The job as CANCELLED, or as it ended before. Waits for the disk.
  absl::StatusOr<v1::Job> Cancel(const std::string& owner, const std::string& job_id);

  // The events of a job that is not finished; else nothing.
  std::shared_ptr<JobEvents> EventsOf(const std::string& job_id) const;

  // Of a shared store: those of a job of `owner`'s that is not worked on here. FollowOthers() asks
  // the store what became of it: of all of them in turn, of one at least, and no more from `until`
  // on. One thread calls it.
  std::shared_ptr<JobEvents> EventsElsewhere(const std::string& owner, const v1::Job& job);
  void FollowOthers(std::chrono::steady_clock::time_point until);
  // Tells the store how far the jobs here have got.
  void TellOthers();
  // Takes off what is no longer this worker's: a client cancelled it elsewhere, or its lease ran
  // out and another has it. Gives back claims of which nothing is known here. Waits for the disk.
  void Compare(const std::vector<JobClaim>& held);

  // By estimate, bytes.
  int64_t MemoryOf(const StoredJob& stored) const;

  // No more jobs begin, and watchers are told so; what runs goes on.
  void BeginDrain();

 private:
  struct LiveJob {
    StoredJob stored;
    std::shared_ptr<JobEvents> events;
    int64_t memory = 0;  // by estimate
    uint64_t work_number = 0;
    bool untried = false;              // its last attempt was none
    uint64_t told = 0;                 // number of the latest progress that the store was told
    std::shared_ptr<JobRun> run;       // while it is worked on
    std::optional<JobOutcome> unkept;  // done, but not on disk yet
  };

  // A job that somebody else works on, and who watches it here.
  struct Elsewhere {
    std::string owner;
    std::weak_ptr<JobEvents> events;
    uint64_t state = 0;  // number of the latest state that was told
  };

  // With mutex_ held. IsOn(): whether it is on the board, claimed as `stored` says.
  bool IsOn(const std::map<std::string, LiveJob>::iterator& job, const StoredJob& stored) {
    return job != jobs_.end() && job->second.stored.claim == stored.claim;
  }
  void Submit(const std::string& job_id, LiveJob* live);
  void Erase(std::map<std::string, LiveJob>::iterator job);
  // Takes a job off that goes on elsewhere: who watches it does so all the same.
  void HandOver(std::map<std::string, LiveJob>::iterator job);
  // Counts an attempt that ended with its server; a job that did so too often has failed then.
  static StoredJob AsLeft(StoredJob stored);

  // On a thread of the job pool.
  void Work(const std::string& job_id);
  // Nothing when the job is not to be worked on.
  std::shared_ptr<JobRun> BeginRun(const std::string& job_id);
  void EndRun(const std::shared_ptr<JobRun>& run);
  // Keeps what a job came to, or puts it with the job until the store takes it. Waits where too
  // much is put off already.
  void Conclude(const JobRun& run, JobOutcome outcome);
  // True when nothing is left to do for the outcome: it is kept, or cannot be.
  bool Keep(JobOutcome* outcome);
  bool PutOff(JobOutcome* outcome);

  // Takes a finished job off the board.
  void Publish(const v1::Job& job);
  // Takes off a job that was finished or removed meanwhile, as the store holds it.
  void TakeOff(const StoredJob& stored);
  // Another worker has the job, or had it: counted, and told to the log.
  void NoteDropped(const StoredJob& stored);
  // Puts a job whose worker was killed back into the queue; false after too many unclean ends.
  // One that got on counts as the first.
  bool Requeue(const StoredJob& tried, bool got_on);
  // Puts back what this machine could not work on; its attempt does not count. Waits for the disk.
  void RequeueUntried(StoredJob stored);
  // The server ends in order: the next one begins with this job as if it had never run.
  void PutBack(StoredJob stored);
  // One that was claimed and never begun.
  void GiveBack(const std::string& job_id);
  void Lose(const std::string& job_id);

  ServiceCore* const core_;
  JobStore* const store_;
  mutable std::mutex mutex_;
  std::condition_variable idle_;
  bool draining_ = false;
  int running_ = 0;
  int64_t unkept_bytes_ = 0;  // of surfaces that wait for the store
  std::map<std::string, LiveJob> jobs_;
  std::map<std::string, Elsewhere> elsewhere_;
  std::string followed_;  // the job elsewhere that the store was asked about last
};

}  // namespace rilievo
