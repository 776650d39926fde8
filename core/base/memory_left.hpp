// Determines how much more memory this process may use before the system ends it: the free memory of the computer and of the
// control groups of the process. A load that needs more is refused before it affects other programs.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

#include "core/base/result.hpp"

namespace sonar {

/// The smallest of the free memory by /proc/meminfo (available and swap) and of the unused memory of every control group that
/// contains this process (version 2 or 1). File cache that the kernel can reclaim counts as free. nullopt if none is known.
std::optional<std::uint64_t> memory_left_bytes();

/// Error `unavailable` if `what` needs more than nine tenths of what is left. `bytes` is an estimate of its peak.
Result<void> check_memory_for(const std::string& what, std::uint64_t bytes);

/// Makes this process the first that the system ends when memory runs out.
void offer_for_out_of_memory();
/// Address space that this process uses, as RLIMIT_AS counts it.
std::optional<std::uint64_t> address_space_bytes();

/// The folder that has proc/ and sys/: "/". Tests set another folder, before other threads start.
std::filesystem::path& memory_root();

}  // namespace sonar
