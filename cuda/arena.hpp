// Memory of one batch of pings: pieces are allocated one by one and released all at once. It is on the device, on the host, or on
// both with the same layout, so that one copy sends many small tables. Pieces do not move before clear(). Several threads may
// allocate at once.
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
  /// includes the gaps between pieces; without this, compute-sanitizer's initcheck would report that it reads memory that was
  /// never written.
  Arena(Machine& machine, Where where, std::size_t chunk_bytes, int clear_lane = not_cleared)
      : machine_(machine), where_(where), chunk_bytes_(chunk_bytes), clear_lane_(clear_lane) {}
  ~Arena();
  Arena(const Arena&) = delete;
  Arena& operator=(const Arena&) = delete;

  template <class T>
  struct Slice {
    T* device = nullptr;  // null on Where::host
    T* host = nullptr;    // null on Where::device
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
  /// The device's copy of `values`, which upload() will send. Where::both only.
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

  void upload(int lane);    // all pieces; Where::both only
  void download(int lane);  // the same
  void clear();
  void give_back();  // releases the memory; no queued work may still use it
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
