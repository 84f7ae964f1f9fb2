#include "tests/support/proxy.h"

#include <arpa/inet.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include "core/base/check.h"

namespace bakewell::test {

namespace {

sockaddr_in Loopback(int port) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(static_cast<uint16_t>(port));
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  return address;
}

}  // namespace

Proxy::Proxy(int target_port) : target_port_(target_port) {
  listener_ = socket(AF_INET, SOCK_STREAM, 0);
  sockaddr_in address = Loopback(0);
  BAKEWELL_CHECK_OP(bind(listener_, reinterpret_cast<sockaddr*>(&address), sizeof(address)), ==, 0);
  BAKEWELL_CHECK_OP(listen(listener_, 128), ==, 0);
  socklen_t size = sizeof(address);
  getsockname(listener_, reinterpret_cast<sockaddr*>(&address), &size);
  port_ = ntohs(address.sin_port);
  thread_ = std::thread([this] { AcceptLoop(); });
}

Proxy::~Proxy() {
  stopping_ = true;
  thread_.join();
  DropAll();
  for (Pair& pair : pairs_) {
    pair.up.join();
    pair.down.join();
    close(pair.near);
    close(pair.far);
  }
  close(listener_);
}

void Proxy::AcceptLoop() {
  while (!stopping_) {
    pollfd waiting{listener_, POLLIN, 0};
    Reap();
    if (poll(&waiting, 1, 50) <= 0) continue;
    const int near = accept(listener_, nullptr, nullptr);
    if (near < 0) continue;
    const int far = socket(AF_INET, SOCK_STREAM, 0);
    const sockaddr_in target = Loopback(target_port_);
    if (connect(far, reinterpret_cast<const sockaddr*>(&target), sizeof(target)) != 0) {
      close(far);
      close(near);
      continue;
    }
    ++connections_;
    const std::lock_guard lock(mutex_);
    Pair& pair = pairs_.emplace_back();
    pair.near = near;
    pair.far = far;
    pair.up = std::thread([this, &pair] { Pump(pair, pair.near, pair.far); });
    pair.down = std::thread([this, &pair] { Pump(pair, pair.far, pair.near); });
  }
}

void Proxy::Pump(Pair& pair, int from, int to) {
  std::minstd_rand random(static_cast<unsigned>(from));
  char bytes[16384];
  for (;;) {
    const ssize_t got = read(from, bytes, sizeof(bytes));
    if (got <= 0) break;
    if (const int delay = delay_ms_; delay > 0) {
      std::this_thread::sleep_for(std::chrono::milliseconds(random() % static_cast<unsigned>(delay)));
    }
    if (send(to, bytes, static_cast<size_t>(got), MSG_NOSIGNAL) != got) break;
  }
  shutdown(from, SHUT_RDWR);
  shutdown(to, SHUT_RDWR);
  ++pair.ended;
}

void Proxy::DropAll() {
  const std::lock_guard lock(mutex_);
  for (Pair& pair : pairs_) {
    shutdown(pair.near, SHUT_RDWR);
    shutdown(pair.far, SHUT_RDWR);
  }
}

void Proxy::Reap() {
  const std::lock_guard lock(mutex_);
  for (auto pair = pairs_.begin(); pair != pairs_.end();) {
    if (pair->ended < 2) {
      ++pair;
      continue;
    }
    pair->up.join();
    pair->down.join();
    close(pair->near);
    close(pair->far);
    pair = pairs_.erase(pair);
  }
}

}  // namespace bakewell::test
