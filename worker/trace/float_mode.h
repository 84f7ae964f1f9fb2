#pragma once

#include <xmmintrin.h>

namespace bakewell {

// While it lives, this thread flushes denormals to zero (as Embree asks for). One at the top of every task, so that the
// same task gives the same bytes on every thread.
class FlushDenormals {
 public:
  FlushDenormals() : saved_(_mm_getcsr()) { _mm_setcsr(saved_ | 0x8040U); }  // FTZ and DAZ
  ~FlushDenormals() { _mm_setcsr(saved_); }
  FlushDenormals(const FlushDenormals&) = delete;
  FlushDenormals& operator=(const FlushDenormals&) = delete;

 private:
  unsigned int saved_;
};

}  // namespace bakewell
