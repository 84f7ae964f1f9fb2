#pragma once

#include <sstream>
#include <string>

namespace bakewell {

// Prints "file:line: expression (lhs vs rhs)" to stderr and aborts: a bug of ours, never reached by input.
[[noreturn]] void CheckFailed(const char* file, int line, const std::string& what);

}  // namespace bakewell

// An invariant of our own code. Input errors are absl::Status, never a check.
#define BAKEWELL_CHECK(condition) ((condition) ? void(0) : ::bakewell::CheckFailed(__FILE__, __LINE__, #condition))

// As BAKEWELL_CHECK, and prints both operands.
#define BAKEWELL_CHECK_OP(lhs, op, rhs)                                                             \
  do {                                                                                              \
    const auto& bakewell_lhs = (lhs);                                                               \
    const auto& bakewell_rhs = (rhs);                                                               \
    if (!(bakewell_lhs op bakewell_rhs)) {                                                          \
      std::ostringstream bakewell_text;                                                             \
      bakewell_text << #lhs " " #op " " #rhs " (" << bakewell_lhs << " vs " << bakewell_rhs << ")"; \
      ::bakewell::CheckFailed(__FILE__, __LINE__, bakewell_text.str());                             \
    }                                                                                               \
  } while (false)
