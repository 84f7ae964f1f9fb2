// BAKEWELL_TEST_FAULT: "hang" (tasks never end), "lie" (every output has one more byte), "fail".
#include <cstdlib>
#include <string>
#include <thread>

#include "tests/support/synthetic.h"
#include "worker/cli/program.h"

namespace bakewell {
namespace {

std::unique_ptr<TaskExecutor> Make(int) {
  auto executor = std::make_unique<test::SyntheticExecutor>();
  const char* set = std::getenv("BAKEWELL_TEST_FAULT");
  const std::string fault = set == nullptr ? "" : set;
  if (fault == "hang") {
    executor->before = [](const TaskSpec&) {
      std::this_thread::sleep_for(std::chrono::hours(1));
      return absl::OkStatus();
    };
  }
  if (fault == "fail") executor->before = [](const TaskSpec&) { return absl::UnavailableError("it fails"); };
  if (fault == "lie") {
    executor->after = [](MadeOutputs& made) {
      for (MadeOutput& output : made) output.bytes += '!';
    };
  }
  return executor;
}

}  // namespace
}  // namespace bakewell

int main(int argc, char** argv) { return bakewell::RunWorkerProgram(argc, argv, bakewell::Make); }
