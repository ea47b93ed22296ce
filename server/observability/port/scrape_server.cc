#include "server/observability/port/scrape_server.h"

#include <poll.h>
#include <sys/eventfd.h>
#include <sys/socket.h>

#include <cerrno>
#include <utility>

#include "core/base/status_macros.h"

namespace rilievo {
namespace {

constexpr size_t kMostHead = 8192;
constexpr int kLookAroundMilliseconds = 250;  // for those whose time is over

void Wake(const FileDescriptor& wake) {
  const uint64_t one = 1;
  wake.Write(&one, sizeof(one)).IgnoreError();
}

bool IsTransient(int error) { return error == EAGAIN || error == EINTR; }

}  // namespace

absl::StatusOr<std::unique_ptr<ScrapeServer>> ScrapeServer::Open(const std::string& address,
                                                                 Answer answer) {
  std::unique_ptr<ScrapeServer> server(new ScrapeServer);
  server->answer_ = std::move(answer);
  server->wake_ = FileDescriptor(eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK));
  RILIEVO_ASSIGN_OR_RETURN(server->listener_, ConnectionListener::Open(address));
  server->thread_ =
      std::jthread([raw = server.get()](const std::stop_token& stop) { raw->Run(stop); });
  server->listener_->Start([raw = server.get()](FileDescriptor connection) {
    const std::lock_guard lock(raw->mutex_);
    raw->new_.push_back(std::move(connection));
    Wake(raw->wake_);
  });
  return server;
}

ScrapeServer::~ScrapeServer() {
  listener_.reset();
  thread_.request_stop();
  if (wake_.valid()) Wake(wake_);
}

void ScrapeServer::TakeNew() {
  uint64_t count = 0;
  wake_.Read(&count, sizeof(count)).IgnoreError();
  const std::lock_guard lock(mutex_);
  for (FileDescriptor& socket : new_) {
    if (connections_.size() >= kMostConnections) connections_.pop_front();
    connections_.push_back({std::move(socket), Clock::now() + kMostTime, "", ""});
  }
  new_.clear();
}

void ScrapeServer::Run(const std::stop_token& stop) {
  std::vector<pollfd> polled;
  while (!stop.stop_requested()) {
    polled = {{wake_.number(), POLLIN, 0}};
    for (const Connection& one : connections_) {
      const short due = one.answer.empty() ? POLLIN : POLLOUT;
      polled.push_back({one.socket.number(), due, 0});
    }
    poll(polled.data(), polled.size(), kLookAroundMilliseconds);
    const auto now = Clock::now();
    for (size_t i = 0; i < connections_.size(); ++i) {
      if (polled[i + 1].revents != 0) Serve(&connections_[i]);
      if (connections_[i].until < now) connections_[i].done = true;
    }
    std::erase_if(connections_, [](const Connection& one) { return one.done; });
    if (polled[0].revents != 0) TakeNew();
  }
}

void ScrapeServer::Serve(Connection* connection) const {
  const int socket = connection->socket.number();
  if (connection->answer.empty()) {
    char buffer[4096];
    const ssize_t size = recv(socket, buffer, sizeof(buffer), MSG_DONTWAIT);
    if (size <= 0) {
      connection->done = size == 0 || !IsTransient(errno);
      return;
    }
    connection->head.append(buffer, static_cast<size_t>(size));
    if (connection->head.find("\r\n\r\n") == std::string::npos) {
      connection->done = connection->head.size() > kMostHead;
      return;
    }
    connection->answer = answer_(connection->head);
  }
  const ssize_t sent = send(socket, connection->answer.data(), connection->answer.size(),
                            MSG_DONTWAIT | MSG_NOSIGNAL);
  if (sent > 0) connection->answer.erase(0, static_cast<size_t>(sent));
  connection->done = connection->answer.empty() || (sent < 0 && !IsTransient(errno));
}

}  // namespace rilievo
