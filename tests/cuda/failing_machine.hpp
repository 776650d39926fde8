// A device that is lost at a given call and stays lost, with host loops inside: for tests of what happens then.
#pragma once

#include <stdexcept>
#include <utility>

#include "cuda/machine.hpp"

namespace sonar::test {

class FailingMachine final : public cuda::Machine {
 public:
  /// When set, it has no transforms, and this is why.
  std::string no_transforms;
  /// `calls` is counted up, and outlives this; the call that finds it at `last` fails, as do all that follow.
  FailingMachine(int& calls, int last) : calls_(calls), last_(last) {}

  std::string name() const override { return "a device that fails"; }
  void* allocate(std::size_t bytes) override { return called(), inner_->allocate(bytes); }
  void release(void* device) override { inner_->release(device); }
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
    if (calls_++ >= last_) throw std::runtime_error("the device is lost");
  }
  int& calls_;
  int last_;
  std::unique_ptr<cuda::Machine> inner_ = cuda::make_host_loops();
};

}  // namespace sonar::test
