#include "worker/task/executor.h"

#include <absl/strings/str_cat.h>

namespace bakewell {

absl::StatusOr<Blob> FindInput(const TaskInputs& inputs, std::string_view name) {
  for (const auto& [input_name, blob] : inputs) {
    if (input_name == name) return blob;
  }
  return absl::InvalidArgumentError(absl::StrCat("the task has no input '", std::string(name), "'"));
}

}  // namespace bakewell
