#include "clients/bvtsdk/core/handles.hpp"

#include <cstring>

namespace sonar::bvt {
namespace {

constexpr std::uint32_t place_bits = 20, places_at_most = (1u << place_bits) - 1, generations = 1u << 11;
constexpr std::size_t rest = 1024;  // number of freed indices that wait before one is reused

std::uintptr_t number_of(const void* handle) {
  std::uintptr_t number;
  std::memcpy(&number, &handle, sizeof number);
  return number;
}

void* handle_of(std::uintptr_t number) {
  void* handle;
  std::memcpy(&handle, &number, sizeof handle);
  return handle;
}

}  // namespace

// A handle is generation << 20 | (place + 1): never null, since the generation starts at 1.
void* Handles::add(std::shared_ptr<Object> object) {
  const std::lock_guard lock(mutex_);
  std::uint32_t place;
  const bool full = places_.size() >= places_at_most;
  if (free_.size() > (full ? 0 : rest)) {
    place = free_.front();
    free_.pop_front();
  } else if (!full) {
    place = static_cast<std::uint32_t>(places_.size());
    places_.emplace_back();
  } else {
    return nullptr;
  }
  places_[place].object = std::move(object);
  ++live_;
  return handle_of(static_cast<std::uintptr_t>(places_[place].generation) << place_bits | (place + 1));
}

Handles::Place* Handles::place_of(const void* handle) {
  const std::uintptr_t number = number_of(handle), place = number & places_at_most;
  if (place == 0 || place > places_.size()) return nullptr;
  Place& p = places_[place - 1];
  return p.object && p.generation == number >> place_bits ? &p : nullptr;
}

std::shared_ptr<Object> Handles::find_any(const void* handle) {
  const std::lock_guard lock(mutex_);
  const Place* p = place_of(handle);
  return p ? p->object : nullptr;
}

std::shared_ptr<Object> Handles::remove_any(const void* handle) {
  const std::lock_guard lock(mutex_);
  Place* p = place_of(handle);
  if (!p) return nullptr;
  std::shared_ptr<Object> object = std::move(p->object);
  p->object.reset();
  p->generation = p->generation + 1 == generations ? 1 : p->generation + 1;
  free_.push_back(static_cast<std::uint32_t>(p - places_.data()));
  --live_;
  return object;
}

std::size_t Handles::live() {
  const std::lock_guard lock(mutex_);
  return live_;
}

Handles& handles() {
  static Handles& table = *new Handles;
  return table;
}

}  // namespace sonar::bvt
