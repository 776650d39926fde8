// How much memory this process may still take before the system ends it: what is free in the computer, and in the limits of the
// control groups of the process. A load that needs more is refused before it harms anything else.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

#include "core/base/result.hpp"

namespace sonar {

/// The least of /proc/meminfo (available and swap) and every control group above us, version 2 or 1, less what is used of it;
/// file cache that can be given back counts as free. nullopt if none of them is known.
std::optional<std::uint64_t> memory_left_bytes();

/// Error `unavailable` if `what` needs more than nine tenths of what is left. `bytes` is an estimate of its peak.
Result<void> check_memory_for(const std::string& what, std::uint64_t bytes);

/// If the system must end a process for want of memory, it ends this one.
void offer_for_out_of_memory();
/// Addresses that this process has in use, as RLIMIT_AS counts them.
std::optional<std::uint64_t> address_space_bytes();

/// Where proc/ and sys/ lie: "/", and another folder in tests, which set it before other threads start.
std::filesystem::path& memory_root();

}  // namespace sonar
