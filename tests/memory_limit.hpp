// States whether tests can limit the memory of a process.
#pragma once

#include <sys/resource.h>

#include <algorithm>

#include "tests/is_sanitized.hpp"

namespace sonar::test {

/// Returns true if the system enforces a limit of addresses. Sanitizers need terabytes of addresses, and an emulated processor
/// (tests/tools/arm64.sh) ignores the limit.
inline bool memory_is_limited() {
  rlimit before{}, now{};
  if (is_sanitized || ::getrlimit(RLIMIT_AS, &before) != 0) return false;
  const rlimit other{std::min<rlim_t>(before.rlim_max, rlim_t{1} << 46), before.rlim_max};
  const bool limited = ::setrlimit(RLIMIT_AS, &other) == 0 && ::getrlimit(RLIMIT_AS, &now) == 0 && now.rlim_cur == other.rlim_cur;
  ::setrlimit(RLIMIT_AS, &before);
  return limited;
}

}  // namespace sonar::test
