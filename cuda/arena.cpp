#include "cuda/arena.hpp"

#include <algorithm>

namespace sonar::cuda {
namespace {

// Alignment in bytes: a multiple of the lines of the device's memory, and sufficient for any vector load.
constexpr std::size_t slice_alignment = 256;

}  // namespace

Arena::~Arena() { release(); }

void Arena::release() {
  for (const Chunk& c : chunks_) {
    if (c.device) machine_.release(c.device);
    if (c.host) machine_.release_host(c.host);
  }
  chunks_.clear();
}

Arena::Place Arena::allocate_bytes(std::size_t bytes) {
  const std::lock_guard lock(allocating_);
  const bool apart = machine_.pieces_apart();
  const std::size_t wanted = apart ? bytes : (bytes + slice_alignment - 1) / slice_alignment * slice_alignment;
  // Finds the first chunk with room; there are few chunks.
  auto it = std::find_if(chunks_.begin(), chunks_.end(), [&](const Chunk& c) { return c.size - c.used >= wanted; });
  if (it == chunks_.end()) {
    chunks_.push_back({});
    Chunk& c = chunks_.back();  // the chunk is owned from here on, so that it is released even if the second allocation fails
    const std::size_t size = apart ? wanted : std::max(chunk_bytes_, wanted);
    if (where_ != Where::host) c.device = static_cast<std::byte*>(machine_.allocate(size));
    if (where_ != Where::device) c.host = static_cast<std::byte*>(machine_.allocate_host(size));
    c.size = size;
    if (clear_lane_ != not_cleared) {
      std::memset(c.host, 0, size);
      machine_.upload(clear_lane_, c.device, c.host, size);
    }
    it = chunks_.end() - 1;
  }
  const Place at{it->device ? it->device + it->used : nullptr, it->host ? it->host + it->used : nullptr};
  it->used += wanted;
  return at;
}

void Arena::upload(int lane) {
  // Copies only the used parts, with one copy per chunk.
  for (const Chunk& c : chunks_)
    if (c.used > 0) machine_.upload(lane, c.device, c.host, c.used);
}

void Arena::download(int lane) {
  for (const Chunk& c : chunks_)
    if (c.used > 0) machine_.download(lane, c.host, c.device, c.used);
}

void Arena::clear() {
  if (machine_.pieces_apart()) return release();
  // The memory is kept, because the next batch needs about as much.
  for (Chunk& c : chunks_) c.used = 0;
}

std::size_t Arena::taken_bytes() const {
  std::size_t bytes = 0;
  for (const Chunk& c : chunks_) bytes += c.used;
  return bytes;
}

}  // namespace sonar::cuda
