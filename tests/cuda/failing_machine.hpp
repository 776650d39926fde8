// A device for tests of errors: host loops, the device code on the CPU, in which a given call and all later calls fail.
#pragma once

#include <atomic>
#include <limits>
#include <map>
#include <mutex>
#include <stdexcept>
#include <utility>

#include "cuda/machine.hpp"

namespace sonar::test {

class FailingMachine final : public cuda::Machine {
 public:
  /// If set, the device has no transforms, for this reason.
  std::string no_transforms;
  /// Memory of the device [bytes]. An allocation beyond what is left throws DeviceMemoryFull. free_bytes() always returns
  /// `tells_bytes`.
  std::size_t room_bytes = std::numeric_limits<std::size_t>::max(), tells_bytes = room_bytes;
  /// Simulates an error of the program instead of a lost device: only the call `last` throws std::logic_error.
  bool has_fault = false;
  /// `calls` counts all calls but releases and queries, and must outlive this object. The calls from number `last` on, counted
  /// from 0, fail.
  FailingMachine(int& calls, int last) : calls_(calls), last_(last) {}

  std::string name() const override { return "a device that fails"; }
  std::size_t free_bytes() const override { return tells_bytes; }
  void* allocate(std::size_t bytes) override {
    called();
    const std::lock_guard lock(taking_);
    if (bytes > room_bytes - taken_) throw cuda::DeviceMemoryFull("out of memory");
    void* const at = inner_->allocate(bytes);
    taken_ += sizes_[at] = bytes;
    return at;
  }
  void release(void* device) override {
    const std::lock_guard lock(taking_);
    taken_ -= sizes_.at(device);
    sizes_.erase(device);
    inner_->release(device);
  }
  void* allocate_host(std::size_t bytes) override { return called(), inner_->allocate_host(bytes); }
  void release_host(void* host) override { inner_->release_host(host); }
  void upload(int lane, void* to, const void* from, std::size_t n) override { called(), inner_->upload(lane, to, from, n); }
  void download(int lane, void* to, const void* from, std::size_t n) override { called(), inner_->download(lane, to, from, n); }
  void run(int lane, const cuda::Launch& launch) override { called(), inner_->run(lane, launch); }
  std::string why_no_transforms() const override { return no_transforms.empty() ? inner_->why_no_transforms() : no_transforms; }
  void transform(int lane, double* values, int size, int rows, bool inverse) override {
    called(), inner_->transform(lane, values, size, rows, inverse);
  }
  cuda::StepSeconds step_seconds(int lane) override { return called(), inner_->step_seconds(lane); }
  void order(int lane, int earlier) override { called(), inner_->order(lane, earlier); }
  void wait(int lane) override { called(), inner_->wait(lane); }

 private:
  void called() {
    const int call = std::atomic_ref(calls_)++;
    if (has_fault && call == last_) throw std::logic_error("a fault of the program");
    if (!has_fault && call >= last_) throw std::runtime_error("the device is lost");
  }
  int& calls_;
  int last_;
  std::mutex taking_;
  std::size_t taken_ = 0;
  std::map<void*, std::size_t> sizes_;
  std::unique_ptr<cuda::Machine> inner_ = cuda::make_host_loops();
};

}  // namespace sonar::test
