#include "daemon/engine/choose_engine.hpp"

#include <stdexcept>

#include "core/paper/paper_engine.hpp"
#include "cuda/cuda_engine.hpp"

namespace sonar {
namespace {

/// Canonical pings on the device, the comparison modes by an engine of the CPU that is made when the first one asks.
class DeviceAndModes final : public PingEngine {
 public:
  DeviceAndModes(std::unique_ptr<PingEngine> device, std::shared_ptr<const Scene> scene, Parallel& pool,
                 const EngineOptions& options)
      : device_(std::move(device)), scene_(std::move(scene)), pool_(pool), options_(options) {}

  std::vector<Ping> run(std::span<const PingRequest> requests) override {
    std::vector<Ping> pings;
    each_.clear();
    while (!requests.empty()) {
      const bool canonical = is_canonical(requests.front());
      std::size_t n = 1;
      while (n < requests.size() && is_canonical(requests[n]) == canonical) ++n;
      last_ = canonical ? device_.get() : &modes();
      for (Ping& ping : last_->run(requests.first(n))) pings.push_back(std::move(ping));
      for (const PingStatistics& s : last_->statistics_of_each()) each_.push_back(s);
      requests = requests.subspan(n);
    }
    return pings;
  }
  std::string description() const override { return device_->description(); }
  PingStatistics statistics() const override { return last_ ? last_->statistics() : PingStatistics{}; }
  std::vector<PingStatistics> statistics_of_each() const override { return each_; }

 private:
  static bool is_canonical(const PingRequest& request) { return request.switches.mode == Mode::canonical; }
  PingEngine& modes() {
    if (!modes_) modes_ = make_engine(scene_, pool_, options_);
    return *modes_;
  }

  std::unique_ptr<PingEngine> device_, modes_;
  PingEngine* last_ = nullptr;
  std::vector<PingStatistics> each_;  // of the last run
  std::shared_ptr<const Scene> scene_;
  Parallel& pool_;
  EngineOptions options_;
};

}  // namespace

std::unique_ptr<PingEngine> choose_engine(EngineDevice device, std::shared_ptr<const Scene> scene, Parallel& pool,
                                          const EngineOptions& options, std::function<void(const std::string&)> say) {
  if (device == EngineDevice::cpu) return make_engine(std::move(scene), pool, options);
  cuda::DeviceEngineOptions device_options;
  device_options.say = say;
  device_options.cpu_after_failure = device == EngineDevice::automatic;
  auto engine = make_cuda_engine(scene, pool, options, device_options);
  if (engine) return std::make_unique<DeviceAndModes>(*std::move(engine), std::move(scene), pool, options);
  if (device == EngineDevice::cuda) throw std::runtime_error(engine.error().text + "; use --engine cpu or auto");
  if (say) say("engine auto: " + engine.error().text);
  return make_engine(std::move(scene), pool, options);
}

}  // namespace sonar
