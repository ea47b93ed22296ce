// A line between client and server that can be cut.
#pragma once

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <atomic>
#include <thread>

namespace rilievo {

// Passes bytes between a client and a server until it is cut.
class CuttableLine {
 public:
  explicit CuttableLine(int server_port) : server_port_(server_port) {
    listener_ = socket(AF_INET, SOCK_STREAM, 0);
    sockaddr_in address = Loopback(0);
    EXPECT_EQ(bind(listener_, reinterpret_cast<sockaddr*>(&address), sizeof(address)), 0);
    EXPECT_EQ(listen(listener_, 1), 0);
    socklen_t size = sizeof(address);
    getsockname(listener_, reinterpret_cast<sockaddr*>(&address), &size);
    port_ = ntohs(address.sin_port);
    thread_ = std::jthread([this] { Run(); });
  }
  ~CuttableLine() {
    Cut();
    thread_.join();
    for (const int end : {client_.load(), server_.load()}) {
      if (end >= 0) close(end);
    }
    close(listener_);
  }

  int port() const { return port_; }

  void Cut() {
    for (const int end : {client_.load(), server_.load(), listener_}) {
      if (end >= 0) shutdown(end, SHUT_RDWR);
    }
  }

 private:
  static sockaddr_in Loopback(int port) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    address.sin_port = htons(static_cast<uint16_t>(port));
    return address;
  }

  static void Pump(int from, int to) {
    char buffer[65536];
    for (ssize_t n; (n = read(from, buffer, sizeof(buffer))) > 0;) {
      for (ssize_t at = 0; at < n;) {
        const ssize_t written = send(to, buffer + at, static_cast<size_t>(n - at), MSG_NOSIGNAL);
        if (written <= 0) return;
        at += written;
      }
    }
  }

  void Run() {
    client_ = accept(listener_, nullptr, nullptr);
    if (client_ < 0) return;
    server_ = socket(AF_INET, SOCK_STREAM, 0);
    const sockaddr_in address = Loopback(server_port_);
    if (connect(server_, reinterpret_cast<const sockaddr*>(&address), sizeof(address)) != 0) return;
    std::jthread back([this] { Pump(server_, client_); });
    Pump(client_, server_);
  }

  int server_port_, port_ = 0, listener_ = -1;
  std::atomic<int> client_{-1}, server_{-1};
  std::jthread thread_;
};

}  // namespace rilievo
