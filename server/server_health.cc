#include "server/server_health.h"

#include "grpcpp/health_check_service_interface.h"
#include "rilievo/v1/jobs.grpc.pb.h"
#include "rilievo/v1/reconstruction.grpc.pb.h"

namespace rilievo {

ServerHealth::ServerHealth(grpc::HealthCheckServiceInterface* health, bool keeps_jobs)
    : health_(health), keeps_jobs_(keeps_jobs) {
  Tell();
}

void ServerHealth::SetAlive(bool alive) {
  const std::lock_guard lock(mutex_);
  alive_ = alive;
  Tell();
}

void ServerHealth::SetAble(bool able) {
  const std::lock_guard lock(mutex_);
  able_ = able;
  Tell();
}

void ServerHealth::SetRoom(bool room) {
  const std::lock_guard lock(mutex_);
  if (room_ == room) return;
  room_ = room;
  Tell();
}

void ServerHealth::SetDraining() {
  const std::lock_guard lock(mutex_);
  draining_ = true;
  Tell();
}

void ServerHealth::Tell() const {
  const bool serving = alive_ && !draining_;
  health_->SetServingStatus("", serving);
  health_->SetServingStatus(v1::ReconstructionService::service_full_name(), serving && able_);
  health_->SetServingStatus(v1::JobsService::service_full_name(),
                            serving && able_ && keeps_jobs_ && room_);
  health_->SetServingStatus(kAliveService, alive_);
}

}  // namespace rilievo
