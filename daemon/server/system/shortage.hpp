// Errors when memory is short, or when a user or service may start no more threads.
#pragma once

#include <exception>
#include <string_view>
#include <system_error>

#include <boost/system/system_error.hpp>

namespace sonar {

inline constexpr const char* not_enough_memory =
    "not enough memory; use a smaller scene, or raise the limits of memory (ulimit -v, LimitAS=, MemoryMax=)";
inline constexpr const char* not_enough_threads =
    "cannot start a thread: allow this user or service more threads (ulimit -u, TasksMax=) or more memory (ulimit -v, LimitAS=), "
    "whichever is limited";

/// Returns whether an exception that std::thread, Boost or Embree threw means that no more threads can be started. A reached
/// limit of threads and missing memory for a stack give the same error code.
inline bool is_short_of_threads(const std::exception& e) {
  if (std::string_view(e.what()).find("pthread_create") != std::string_view::npos) return true;  // from Embree
  if (const auto* error = dynamic_cast<const std::system_error*>(&e))
    return error->code() == std::errc::resource_unavailable_try_again;
  const auto* error = dynamic_cast<const boost::system::system_error*>(&e);
  return error != nullptr && error->code() == boost::system::errc::resource_unavailable_try_again;
}

}  // namespace sonar
