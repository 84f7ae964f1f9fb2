#pragma once

#include <atomic>
#include <list>
#include <mutex>
#include <random>
#include <thread>

namespace bakewell::test {

// A TCP proxy on loopback that can be told to misbehave. One thread per connection and direction.
class Proxy {
 public:
  explicit Proxy(int target_port);
  ~Proxy();
  int port() const { return port_; }
  // Cuts every connection, in the middle of whatever it carries.
  void DropAll();
  // Holds every byte back for a while, at random, up to this long.
  void SetDelay(int max_ms) { delay_ms_ = max_ms; }
  int connections() const { return connections_; }

 private:
  struct Pair {
    int near = -1, far = -1;
    std::atomic<int> ended{0};
    std::thread up, down;
  };
  void AcceptLoop();
  void Pump(Pair& pair, int from, int to);
  void Reap();

  const int target_port_;
  int listener_ = -1, port_ = 0;
  std::atomic<bool> stopping_{false};
  std::atomic<int> delay_ms_{0}, connections_{0};
  std::mutex mutex_;
  std::list<Pair> pairs_;
  std::thread thread_;
};

}  // namespace bakewell::test
