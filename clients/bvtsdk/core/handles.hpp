// Handles that programs get instead of pointers. A handle is a number below 2^31 cast to the pointer type, so that a truncation
// to 32 bits (by Python's ctypes) does not change it. Stale and foreign handles are detected.
#pragma once

#include <cstdint>
#include <deque>
#include <memory>
#include <mutex>
#include <vector>

namespace sonar::bvt {

/// Base of all objects that have handles. The facades hold `mutex` while a call works on the object.
struct Object {
  virtual ~Object() = default;
  std::mutex mutex;
};

/// The table of handles. A handle has 20 bits of index and 11 bits of generation: up to 1 048 575 objects at a time.
class Handles {
 public:
  /// Adds an object and returns its handle; null if the table is full.
  void* add(std::shared_ptr<Object> object);
  /// Returns the object of a handle; null if the handle is null, stale, foreign, or of another type.
  template <class T>
  std::shared_ptr<T> find(const void* handle) {
    return std::dynamic_pointer_cast<T>(find_any(handle));
  }
  /// Invalidates the handle and returns its object; null where find() returns null.
  template <class T>
  std::shared_ptr<T> remove(const void* handle) {
    return find<T>(handle) ? std::dynamic_pointer_cast<T>(remove_any(handle)) : nullptr;
  }
  std::size_t live();

 private:
  struct Slot {
    std::shared_ptr<Object> object;
    std::uint32_t generation = 1;
  };
  Slot* slot_of(const void* handle);
  std::shared_ptr<Object> find_any(const void* handle);
  std::shared_ptr<Object> remove_any(const void* handle);

  std::mutex mutex_;
  std::vector<Slot> slots_;
  std::deque<std::uint32_t>
      free_;  // indices are reused in the order in which they were freed, so that stale handles are detected for a long time
  std::size_t live_ = 0;
};

/// The only table of this library. It is never destroyed, because programs destroy handles in destructors of global objects.
Handles& handles();

}  // namespace sonar::bvt
