#include "clients/bvtsdk/core/handles.hpp"

#include <cstring>

namespace sonar::bvt {
namespace {

constexpr std::uint32_t index_bits = 20, most_indices = (1u << index_bits) - 1, generations = 1u << 11;
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

// A handle is generation << 20 | (index + 1): never null, since the generation starts at 1.
void* Handles::add(std::shared_ptr<Object> object) {
  const std::lock_guard lock(mutex_);
  std::uint32_t index;
  const bool full = slots_.size() >= most_indices;
  if (free_.size() > (full ? 0 : rest)) {
    index = free_.front();
    free_.pop_front();
  } else if (!full) {
    index = static_cast<std::uint32_t>(slots_.size());
    slots_.emplace_back();
  } else {
    return nullptr;
  }
  slots_[index].object = std::move(object);
  ++live_;
  return handle_of(static_cast<std::uintptr_t>(slots_[index].generation) << index_bits | (index + 1));
}

Handles::Slot* Handles::slot_of(const void* handle) {
  const std::uintptr_t number = number_of(handle), index = number & most_indices;
  if (index == 0 || index > slots_.size()) return nullptr;
  Slot& p = slots_[index - 1];
  return p.object && p.generation == number >> index_bits ? &p : nullptr;
}

std::shared_ptr<Object> Handles::find_any(const void* handle) {
  const std::lock_guard lock(mutex_);
  const Slot* p = slot_of(handle);
  return p ? p->object : nullptr;
}

std::shared_ptr<Object> Handles::remove_any(const void* handle) {
  const std::lock_guard lock(mutex_);
  Slot* p = slot_of(handle);
  if (!p) return nullptr;
  std::shared_ptr<Object> object = std::move(p->object);
  p->object.reset();
  p->generation = p->generation + 1 == generations ? 1 : p->generation + 1;
  free_.push_back(static_cast<std::uint32_t>(p - slots_.data()));
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
