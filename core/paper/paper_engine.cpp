#include "core/paper/paper_engine.hpp"

#include <algorithm>
#include <deque>
#include <functional>
#include <stdexcept>
#include <utility>

#include "core/paper/paper_ping.hpp"
#include "core/pipeline/water_line.hpp"

namespace sonar {
namespace {

/// Computes pings in the modes paper and raster.
class ComparisonEngine {
 public:
  ComparisonEngine(std::shared_ptr<const Scene> scene, Parallel& pool, const EngineOptions& options, paper::FrequencySum sum)
      : rays_(scene, pool.threads()), scene_(std::move(scene)), pool_(pool), options_(options), sum_(sum) {}

  Ping run(const PingRequest& requested) {
    // At the sea surface, a ping is computed at a pose that differs from the requested one. The result states the requested
    // pose.
    std::vector<PingRequest> changed;
    const PingRequest& request = in_water({&requested, 1}, *scene_, changed).front();
    if (const std::string why = why_invalid(request); !why.empty()) throw std::invalid_argument(why);
    if (!scene_->bodies_in_world.empty())
      rays_.place(request.bodies_in_world.empty() ? scene_->bodies_in_world : request.bodies_in_world);
    // The tables are kept until model or settings change, because making them takes longer than a ping.
    if (!prepared_ || !prepared_->serves(request)) prepared_ = std::make_unique<paper::Prepared>(request, sum_);
    statistics_ = {};
    Ping ping = paper::simulate(rays_, request, *prepared_, simd::kernels_for(options_.simd), pool_, options_.now_s, statistics_);
    restore_requested_pose({&requested, 1}, {&ping, 1});
    return ping;
  }
  const PingStatistics& statistics() const { return statistics_; }

 private:
  RayScene rays_;
  std::shared_ptr<const Scene> scene_;
  Parallel& pool_;
  EngineOptions options_;
  paper::FrequencySum sum_;
  std::unique_ptr<paper::Prepared> prepared_;
  PingStatistics statistics_;
};

/// Sends each ping to the engine of its mode.
class ModeRouter final : public PingEngine {
 public:
  ModeRouter(std::unique_ptr<PingEngine> canonical, std::shared_ptr<const Scene> scene, Parallel& pool,
             const EngineOptions& options, paper::FrequencySum sum)
      : canonical_(std::move(canonical)), make_comparison_([=, scene = std::move(scene), &pool] {
          return std::make_unique<ComparisonEngine>(scene, pool, options, sum);
        }) {}

  std::vector<Ping> run(std::span<const PingRequest> requests) override {
    std::vector<Ping> pings;
    pings.reserve(requests.size());
    std::vector<PingStatistics> each;  // statistics of each ping, in order
    while (!requests.empty()) {
      if (!is_canonical(requests.front())) {
        if (!comparison_) comparison_ = make_comparison_();
        last_was_canonical_ = false;
        pings.push_back(comparison_->run(requests.front()));
        each.push_back(comparison_->statistics());
        requests = requests.subspan(1);
        continue;
      }
      std::size_t n = 1;  // number of successive canonical requests: engines compute them as a batch
      while (n < requests.size() && is_canonical(requests[n])) ++n;
      for (Ping& ping : canonical_->run(requests.first(n))) pings.push_back(std::move(ping));
      for (const PingStatistics& s : canonical_->statistics_of_each()) each.push_back(s);
      requests = requests.subspan(n);
      last_was_canonical_ = true;
    }
    each_ = std::move(each);
    return pings;
  }

  void submit(std::span<const PingRequest> requests) override {
    passed_on_.push_back(std::all_of(requests.begin(), requests.end(), is_canonical));
    passed_on_.back() ? canonical_->submit(requests) : PingEngine::submit(requests);
  }
  std::vector<Ping> collect() override {
    const bool passed_on = passed_on_.front();
    passed_on_.pop_front();
    if (!passed_on) return PingEngine::collect();
    std::vector<Ping> pings = canonical_->collect();
    each_ = canonical_->statistics_of_each();
    last_was_canonical_ = true;
    return pings;
  }
  std::size_t most_together(const PingRequest& a, const PingRequest& b) const override {
    return is_canonical(a) && is_canonical(b) ? canonical_->most_together(a, b) : 1;
  }
  void set_interruption(Interruption* interruption) override { canonical_->set_interruption(interruption); }
  std::string description() const override { return canonical_->description(); }
  PingStatistics statistics() const override {
    return last_was_canonical_ ? canonical_->statistics() : comparison_->statistics();
  }
  std::vector<PingStatistics> statistics_of_each() const override { return each_; }

 private:
  static bool is_canonical(const PingRequest& request) { return request.switches.mode == Mode::canonical; }

  std::unique_ptr<PingEngine> canonical_;
  std::function<std::unique_ptr<ComparisonEngine>()> make_comparison_;
  std::unique_ptr<ComparisonEngine> comparison_;  // made for the first ping of its modes, because it has its own ray scene
  std::deque<bool> passed_on_;                    // for each submitted ping: true if it went to the canonical engine
  std::vector<PingStatistics> each_;              // statistics of each ping of the last run
  bool last_was_canonical_ = true;
};

}  // namespace

std::unique_ptr<PingEngine> with_comparison_modes(std::unique_ptr<PingEngine> canonical, std::shared_ptr<const Scene> scene,
                                                  Parallel& pool, const EngineOptions& options, paper::FrequencySum sum) {
  return std::make_unique<ModeRouter>(std::move(canonical), std::move(scene), pool, options, sum);
}

std::unique_ptr<PingEngine> make_engine(std::shared_ptr<const Scene> scene, Parallel& pool, const EngineOptions& options,
                                        paper::FrequencySum sum) {
  auto canonical = make_cpu_engine(scene, pool, options);
  return with_comparison_modes(std::move(canonical), std::move(scene), pool, options, sum);
}

}  // namespace sonar
