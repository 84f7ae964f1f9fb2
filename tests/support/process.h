#pragma once

#include <sys/types.h>

#include <chrono>
#include <map>
#include <string>
#include <vector>

namespace bakewell::test {

// A child process of the test, killed at the end if it still runs.
class Process {
 public:
  // Runs `arguments`, [0] being the program, with `environment` added. stderr goes to `log`, stdout to a pipe.
  Process(const std::vector<std::string>& arguments, const std::string& log,
          const std::map<std::string, std::string>& environment = {});
  ~Process();
  Process(const Process&) = delete;
  Process& operator=(const Process&) = delete;

  // The next line of its stdout; empty at the end or when nothing came in time.
  std::string ReadLine(std::chrono::milliseconds limit = std::chrono::seconds(20));
  void Signal(int signal);
  // kill -9, and waits.
  void Kill();
  // Waits for it to end by itself; the exit code, or -1 if it did not in time or died of a signal.
  int Wait(std::chrono::milliseconds limit);
  pid_t pid() const { return pid_; }

 private:
  pid_t pid_ = -1;
  int out_ = -1;
  std::string buffer_;
};

// A port that was free a moment ago.
int FreePort();

}  // namespace bakewell::test
