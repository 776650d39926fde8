// Determines how much more memory this process may use before the system ends it. The value follows from the free memory of the
// computer and of the control groups of the process. A load that needs more is refused before it affects other programs.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

#include "core/base/result.hpp"

namespace sonar {

/// Returns the minimum of the system's free memory (/proc/meminfo: available and swap) and of the unused memory of each control
/// group (version 2 or 1) that contains this process. File cache that the kernel can reclaim counts as free. Returns nullopt if
/// no value is known.
std::optional<std::uint64_t> memory_left_bytes();

/// Error `unavailable` if `bytes`, the estimated peak memory of `what`, is more than nine tenths of memory_left_bytes().
Result<void> check_memory_for(const std::string& what, std::uint64_t bytes);

/// Makes this process the first one that the kernel ends when memory runs out.
void offer_for_out_of_memory();
/// Returns the address space that this process uses, as RLIMIT_AS counts it.
std::optional<std::uint64_t> address_space_bytes();

/// Returns the folder that contains proc/ and sys/: "/". Tests set another folder, before other threads start.
std::filesystem::path& memory_root();

}  // namespace sonar
