#pragma once

#include <absl/status/status.h>
#include <absl/status/statusor.h>

// Returns from the enclosing function when `expression` (an absl::Status) is not OK.
#define BAKEWELL_RETURN_IF_ERROR(expression)                                                        \
  do {                                                                                              \
    if (absl::Status bakewell_status = (expression); !bakewell_status.ok()) return bakewell_status; \
  } while (false)

#define BAKEWELL_JOIN_INNER(a, b) a##b
#define BAKEWELL_JOIN(a, b) BAKEWELL_JOIN_INNER(a, b)

// BAKEWELL_ASSIGN_OR_RETURN(const Scene scene, LoadScene(path)): the value, or returns its status.
#define BAKEWELL_ASSIGN_OR_RETURN(declaration, expression) \
  BAKEWELL_ASSIGN_OR_RETURN_INNER(BAKEWELL_JOIN(bakewell_or_, __LINE__), declaration, expression)
#define BAKEWELL_ASSIGN_OR_RETURN_INNER(temporary, declaration, expression) \
  auto temporary = (expression);                                            \
  if (!temporary.ok()) return temporary.status();                           \
  declaration = *std::move(temporary)
