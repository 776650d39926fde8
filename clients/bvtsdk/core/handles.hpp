// Handles: what a host holds instead of pointers. A handle is a small number cast to the pointer's type, so that a host that
// cuts it to 32 bits (Python's ctypes by default) loses nothing, and a stale or foreign one is told from a live one.
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

/// 20 bits of place and 11 of generation: up to 1 048 575 objects live at once, all numbers below 2^31.
class Handles {
 public:
  /// Null when there is no place left.
  void* add(std::shared_ptr<Object> object);
  /// Null when the handle is null, stale, foreign, or stands for something else.
  template <class T>
  std::shared_ptr<T> find(const void* handle) {
    return std::dynamic_pointer_cast<T>(find_any(handle));
  }
  /// Makes the handle stale and gives what it stood for; null as above.
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
