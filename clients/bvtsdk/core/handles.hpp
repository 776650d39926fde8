// Handles that a host holds instead of pointers. A handle is a small number cast to the pointer type, so that truncation to 32
// bits (Python's ctypes by default) loses nothing, and stale or foreign handles are detected.
#pragma once

#include <cstdint>
#include <deque>
#include <memory>
#include <mutex>
#include <vector>

namespace sonar::bvt {

/// Whatever a handle may stand for. `mutex` is held by the facades while a call works on the object.
struct Object {
  virtual ~Object() = default;
  std::mutex mutex;
};

/// 20 bits of index and 11 of generation: up to 1 048 575 objects at once, all numbers below 2^31.
class Handles {
 public:
  /// Null when the table is full.
  void* add(std::shared_ptr<Object> object);
  /// Null when the handle is null, stale, foreign, or stands for something else.
  template <class T>
  std::shared_ptr<T> find(const void* handle) {
    return std::dynamic_pointer_cast<T>(find_any(handle));
  }
  /// Invalidates the handle and returns its object; null as above.
  template <class T>
  std::shared_ptr<T> remove(const void* handle) {
    return find<T>(handle) ? std::dynamic_pointer_cast<T>(remove_any(handle)) : nullptr;
  }
  std::size_t live();

 private:
  struct Place {
    std::shared_ptr<Object> object;
    std::uint32_t generation = 1;
  };
  Place* place_of(const void* handle);
  std::shared_ptr<Object> find_any(const void* handle);
  std::shared_ptr<Object> remove_any(const void* handle);

  std::mutex mutex_;
  std::vector<Place> places_;
  std::deque<std::uint32_t> free_;  // first freed, first used again, so that stale handles are noticed for long
  std::size_t live_ = 0;
};

/// The one table of this library. Never destroyed: hosts destroy handles from destructors of their globals.
Handles& handles();

}  // namespace sonar::bvt
