#include "core/paper/paper_engine.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>

#include "core/base/random.hpp"
#include "core/paper/paper_ping.hpp"
#include "core/pipeline/water_line.hpp"

namespace sonar {
namespace {

class Engine final : public PingEngine {
 public:
  Engine(std::shared_ptr<const Scene> scene, Parallel& pool, const EngineOptions& options, paper::FrequencySum sum)
      : scene_(scene), pool_(pool), options_(options), sum_(sum), canonical_(make_cpu_engine(std::move(scene), pool, options)) {}

  std::vector<Ping> run(std::span<const PingRequest> requests) override {
    std::vector<Ping> pings;
    pings.reserve(requests.size());
    std::vector<PingStatistics> each;  // a ping that is let in has its own
    while (!requests.empty()) {
      if (requests.front().switches.mode != Mode::canonical) {
        pings.push_back(compare(requests.front()));
        each.push_back(statistics_);
        requests = requests.subspan(1);
        continue;
      }
      std::size_t n = 1;  // the longest run of canonical requests, so that an engine that likes batches gets them
      while (n < requests.size() && requests[n].switches.mode == Mode::canonical) ++n;
      for (Ping& ping : canonical_->run(requests.first(n))) pings.push_back(std::move(ping));
      for (const PingStatistics& s : canonical_->statistics_of_each()) each.push_back(s);
      requests = requests.subspan(n);
      last_was_canonical_ = true;
    }
    each_ = std::move(each);
    return pings;
  }

  void let_in(Interruption* who) override { canonical_->let_in(who); }
  std::string description() const override { return canonical_->description(); }
  PingStatistics statistics() const override { return last_was_canonical_ ? canonical_->statistics() : statistics_; }
  std::vector<PingStatistics> statistics_of_each() const override { return each_; }

 private:
  Ping compare(const PingRequest& asked) {
    std::vector<PingRequest> room;
    const PingRequest& request = in_water({&asked, 1}, *scene_, room).front();
    if (const std::string why = why_invalid(request); !why.empty()) throw std::invalid_argument(why);
    if (!rays_) rays_ = std::make_unique<RayScene>(scene_, pool_.threads());
    if (!scene_->bodies_in_world.empty())
      rays_->place(request.bodies_in_world.empty() ? scene_->bodies_in_world : request.bodies_in_world);
    if (!prepared_ || !prepared_->serves(request)) prepared_ = std::make_unique<paper::Prepared>(request, sum_);
    statistics_ = {};
    last_was_canonical_ = false;
    Ping ping =
        paper::simulate(*rays_, request, *prepared_, simd::kernels_for(options_.simd), pool_, options_.now_s, statistics_);
    tell_as_asked({&asked, 1}, {&ping, 1});
    return ping;
  }

  std::shared_ptr<const Scene> scene_;
  Parallel& pool_;
  EngineOptions options_;
  paper::FrequencySum sum_;
  std::unique_ptr<PingEngine> canonical_;
  std::unique_ptr<RayScene> rays_;
  std::unique_ptr<paper::Prepared> prepared_;
  PingStatistics statistics_;
  std::vector<PingStatistics> each_;  // of the last run
  bool last_was_canonical_ = true;
};

}  // namespace

std::unique_ptr<PingEngine> make_engine(std::shared_ptr<const Scene> scene, Parallel& pool, const EngineOptions& options,
                                        paper::FrequencySum sum) {
  return std::make_unique<Engine>(std::move(scene), pool, options, sum);
}

}  // namespace sonar
