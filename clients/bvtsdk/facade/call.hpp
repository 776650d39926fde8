// Common steps of the facades' C functions: find the object of the handle, lock it, write out-parameters even on failure, and
// catch every exception.
#pragma once

#include <cstring>
#include <new>

#include "clients/bvtsdk/core/codes.hpp"
#include "clients/bvtsdk/core/log.hpp"
#include "clients/bvtsdk/core/sonar.hpp"

namespace sonar::bvt::facade {

template <class F>
int guarded(F work) noexcept {
  try {
    return work();
  } catch (const std::bad_alloc&) {
    return memory_alloc;
  } catch (...) {
    return failed;
  }
}

/// Runs `work(object)` with the object locked, and returns its result code; invalid_ptr if the handle is not that of a T.
template <class T, class F>
int on(const void* handle, F work) noexcept {
  return guarded([&]() -> int {
    const std::shared_ptr<T> object = handles().find<T>(handle);
    if (!object) return invalid_ptr;
    const std::lock_guard lock(object->mutex);
    return work(*object);
  });
}

/// A getter of the 4.x interface: sets *out to work(object), or to 0 for a bad handle.
template <class T, class V, class F>
int get(const void* handle, V* out, F work) noexcept {
  if (!out) return invalid_ptr;
  *out = V{};
  return on<T>(handle, [&](T& object) -> int {
    *out = static_cast<V>(work(object));
    return success;
  });
}

/// A getter that can fail: returns the code of work(object, value). On failure *out is 0.
template <class T, class V, class F>
int try_get(const void* handle, V* out, F work) noexcept {
  if (!out) return invalid_ptr;
  *out = V{};
  V value{};
  const int code = on<T>(handle, [&](T& object) -> int { return work(object, value); });
  if (code == success) *out = value;
  return code;
}

/// A getter of the 3.x interface, which has no error codes: returns work(object), or `otherwise` for a bad handle.
template <class T, class V, class F>
V value(const void* handle, V otherwise, F work) noexcept {
  V result = otherwise;
  on<T>(handle, [&](T& object) -> int {
    result = static_cast<V>(work(object));
    return success;
  });
  return result;
}

/// Registers a new object and gives its handle to the calling program. H is one of the interface's handle types.
template <class H>
int give(std::shared_ptr<Object> object, H* out) {
  void* handle = handles().add(std::move(object));
  *out = static_cast<H>(handle);
  return handle ? success : memory_alloc;
}

/// Creates an N, fills it with work(object, fresh), and writes its handle to *out; *out is null on failure.
template <class T, class N, class H, class F>
int make(const void* handle, H* out, F work) noexcept {
  if (!out) return invalid_ptr;
  *out = nullptr;
  return on<T>(handle, [&](T& object) -> int {
    const auto fresh = std::make_shared<N>();
    const int code = work(object, *fresh);
    return code == success ? give(fresh, out) : code;
  });
}

/// Creates an N and returns its handle; null if memory or handles run out.
template <class N, class H>
H create() noexcept {
  H handle = nullptr;
  guarded([&] { return give(std::make_shared<N>(), &handle); });
  return handle;
}

/// Makes the handle invalid; null and stale handles are ignored. The object is freed when the last thread that uses it has
/// finished.
template <class T>
void destroy(const void* handle) noexcept {
  guarded([&]() -> int {
    handles().remove<T>(handle);
    return success;
  });
}

/// Copies a text and its NUL into the caller's buffer. If it does not fit, the buffer is "" and the result is buffer_too_small.
inline int copy_text(const std::string& text, char* buffer, int size) {
  if (!buffer || size <= 0) return bad_parameter;
  buffer[0] = '\0';
  if (text.size() >= static_cast<std::size_t>(size)) return buffer_too_small;
  std::memcpy(buffer, text.c_str(), text.size() + 1);
  return success;
}

/// Copies the text that work(object) returns, as copy_text does. The buffer is "" if the handle is bad.
template <class T, class F>
int get_text(const void* handle, char* buffer, int size, F work) noexcept {
  if (buffer && size > 0) buffer[0] = '\0';
  return on<T>(handle, [&](T& object) -> int { return copy_text(work(object), buffer, size); });
}

/// Copies all values into the caller's buffer. If they do not fit, copies none and returns buffer_too_small.
template <class V, class N>
int copy_values(const std::vector<V>& values, V* buffer, N size) {
  if (!buffer) return invalid_ptr;
  if (size < N{} || static_cast<std::size_t>(size) < values.size()) return buffer_too_small;
  if (!values.empty()) std::memcpy(buffer, values.data(), values.size() * sizeof(V));
  return success;
}

inline std::string text_or_empty(const char* text) { return text ? text : ""; }

inline bool inside(const ImageGeometry& image, int row, int col) {
  return row >= 0 && col >= 0 && row < image.height && col < image.width;
}
inline std::size_t place(const ImageGeometry& image, int row, int col) {
  return static_cast<std::size_t>(row) * static_cast<std::size_t>(image.width) + static_cast<std::size_t>(col);
}

}  // namespace sonar::bvt::facade
