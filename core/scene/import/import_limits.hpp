// Limits of the program that imports meshes. If one is exceeded, the program ends with an error as its answer.
#pragma once

#include <cstdint>

#include "core/scene/files/mesh_exchange.hpp"

namespace sonar {

/// Memory of an import: a fixed part and a part for each byte of its files, but at most nine tenths of the memory left.
constexpr std::uint64_t import_memory_bytes = std::uint64_t{512} << 20, import_memory_of_a_byte = 64;
/// Processor time: a fixed part and a part for each million bytes. The limit of elapsed time is twenty times as long, because
/// the computer may be busy.
constexpr std::uint64_t import_seconds = 30, import_seconds_of_a_million = 2;

/// Prepares the limits. Call it once, before all other work. Errors are written to `descriptor`.
void begin_import_limits(const ImportRequest& request, int descriptor);
/// Sets the limits for files of `bytes` bytes. Call it at least once before reading them.
void limit_import(std::uintmax_t bytes);
/// Lifts the limit of memory, when the importer has finished. Later code checks whether it has enough memory.
void release_import_memory();

}  // namespace sonar
