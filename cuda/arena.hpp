// Memory of one batch of pings. Pieces are allocated one by one and released all at once. The memory is on the device, on the
// host, or on both with the same layout, so that one copy transfers many small tables. Pieces do not move before clear().
// Several threads may allocate at the same time.
#pragma once

#include <cstddef>
#include <cstring>
#include <mutex>
#include <span>
#include <type_traits>
#include <vector>

#include "cuda/machine.hpp"

namespace sonar::cuda {

class Arena {
 public:
  enum class Where { device, host, both };
  static constexpr int not_cleared = -1;
  /// `clear_lane`: lane on which both copies of new memory are set to zero; only with Where::both. A copy of whole chunks
  /// includes the gaps between pieces. If these gaps were not set, compute-sanitizer's initcheck would report reads of memory
  /// that was never written.
  Arena(Machine& machine, Where where, std::size_t chunk_bytes, int clear_lane = not_cleared)
      : machine_(machine), where_(where), chunk_bytes_(chunk_bytes), clear_lane_(clear_lane) {}
  ~Arena();
  Arena(const Arena&) = delete;
  Arena& operator=(const Arena&) = delete;

  template <class T>
  struct Slice {
    T* device = nullptr;  // null with Where::host
    T* host = nullptr;    // null with Where::device
    std::size_t count = 0;
  };
  /// Allocates without initialising; null for a count of 0.
  template <class T>
  Slice<T> allocate(std::size_t count) {
    static_assert(std::is_trivially_copyable_v<T>);
    if (count == 0) return {};
    const Place at = allocate_bytes(count * sizeof(T));
    return {static_cast<T*>(at.device), static_cast<T*>(at.host), count};
  }
  /// Returns the device's copy of `values`, which upload() will transfer. It works only with Where::both.
  template <class T>
  T* put(std::span<const T> values) {
    const Slice<T> slice = allocate<T>(values.size());
    if (!values.empty()) std::memcpy(static_cast<void*>(slice.host), values.data(), values.size_bytes());
    return slice.device;
  }
  template <class T, class Allocator>
  T* put(const std::vector<T, Allocator>& values) {
    return put(std::span<const T>(values));
  }

  void upload(int lane);    // all pieces; only with Where::both
  void download(int lane);  // all pieces; only with Where::both
  void clear();
  void release();  // frees the memory; no queued work may use it any more
  std::size_t taken_bytes() const;

 private:
  struct Chunk {
    std::byte* device = nullptr;
    std::byte* host = nullptr;
    std::size_t size = 0, used = 0;
  };
  struct Place {
    void* device;
    void* host;
  };
  Place allocate_bytes(std::size_t bytes);

  Machine& machine_;
  Where where_;
  std::size_t chunk_bytes_;
  int clear_lane_;
  std::mutex allocating_;
  std::vector<Chunk> chunks_;
};

}  // namespace sonar::cuda
