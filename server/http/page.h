#pragma once

namespace bakewell::http {

// dashboard.html, embedded by CMake.
inline constexpr char kDashboardPage[] =
#include "server/http/dashboard.inc"
    ;

}  // namespace bakewell::http
