// Limits of the program that imports meshes. It ends at each of them, with a sentence as its answer.
#pragma once

#include <cstdint>

#include "core/scene/files/mesh_exchange.hpp"

namespace sonar {

/// Memory for an import: this, and so much for each byte of its files, but at most nine tenths of what is left.
constexpr std::uint64_t import_memory_bytes = std::uint64_t{512} << 20, import_memory_of_a_byte = 64;
/// Processor time: this, and so much for each million bytes. By the clock it is twenty times that: the processor may be busy.
constexpr std::uint64_t import_seconds = 30, import_seconds_of_a_million = 2;

/// Once, first of all. The answer goes to `descriptor`.
void begin_import_limits(const ImportRequest& request, int descriptor);
/// The files hold so many bytes. Once at least, before they are read.
void limit_import(std::uintmax_t bytes);
/// The importer is done; our own code checks the memory that it needs.
void release_import_memory();

}  // namespace sonar
