#pragma once

namespace bakewell::test {

// What the sanitizers cost, more or less: limits of time are multiplied by it.
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
inline constexpr int kSlowness = 5;
#else
inline constexpr int kSlowness = 1;
#endif

}  // namespace bakewell::test
