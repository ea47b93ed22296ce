// What the health service says of a server.
#pragma once

#include <mutex>

namespace grpc {
class HealthCheckServiceInterface;
}

namespace rilievo {

// The name under which health says whether the server should be left to live: SERVING while it
// drains too.
inline constexpr char kAliveService[] = "alive";

// Thread-safe. All of "", the two services and kAliveService.
class ServerHealth {
 public:
  // `health` outlives this object. `keeps_jobs`: whether JobsService ever serves.
  ServerHealth(grpc::HealthCheckServiceInterface* health, bool keeps_jobs);

  // Whether all threads of the server move.
  void SetAlive(bool alive);
  // Whether this machine can work on jobs (MachineHealth); if not, the two services do not serve.
  void SetAble(bool able);
  // Whether the store has room for more; JobsService alone depends on it.
  void SetRoom(bool room);
  // No new jobs, for good.
  void SetDraining();

 private:
  void Tell() const;

  grpc::HealthCheckServiceInterface* const health_;
  const bool keeps_jobs_;
  std::mutex mutex_;
  bool alive_ = true, able_ = true, room_ = true, draining_ = false;
};

}  // namespace rilievo
