// P0: the demo of every product as `sonard --profile NAME` serves it, with its own scene and settings and a usual driver.
#include <algorithm>
#include <cstdio>
#include <future>
#include <mutex>
#include <string>

#include "clients/sonarctl/ping_stream.hpp"
#include "control.pb.h"
#include "daemon/commands/options/command_line.hpp"
#include "daemon/config/load_config.hpp"
#include "daemon/config/scene_file.hpp"
#include "tests/bench/findings.hpp"
#include "tests/bench/service.hpp"

namespace sonar::bench {
namespace {

using nlohmann::json;

constexpr std::chrono::seconds patience{20};
constexpr double warm_up_s = 1, measured_s = 3;  // upper limits

/// The times at which each ping of an engine got its pose and was computed, on the clock of the daemon.
class Course {
 public:
  void add(Time fired, Time computed) {
    const std::lock_guard lock(mutex_);
    pings_.emplace_back(fired, computed);
  }
  /// Returns the pose time of the ping whose last byte arrived at `at`: the last ping computed by then. A ping is sent before the
  /// next one is computed.
  std::optional<Time> fired_of(Time at) const {
    const std::lock_guard lock(mutex_);
    const auto later = std::partition_point(pings_.begin(), pings_.end(), [at](const auto& p) { return p.second <= at; });
    return later == pings_.begin() ? std::nullopt : std::optional(std::prev(later)->first);
  }

 private:
  mutable std::mutex mutex_;
  std::vector<std::pair<Time, Time>> pings_;
};

/// An engine that stores the times of its pings in a Course.
class Watched final : public PingEngine {
 public:
  Watched(std::unique_ptr<PingEngine> engine, Course& course, const Clock& clock)
      : engine_(std::move(engine)), course_(course), clock_(clock) {}
  std::vector<Ping> run(std::span<const PingRequest> requests) override {
    std::vector<Ping> pings = engine_->run(requests);
    for (const PingRequest& request : requests) course_.add(request.fired_at, clock_.now());
    return pings;
  }
  std::size_t most_together(const PingRequest& a, const PingRequest& b) const override { return engine_->most_together(a, b); }
  void set_interruption(Interruption* interruption) override { engine_->set_interruption(interruption); }
  std::string description() const override { return engine_->description(); }

 private:
  std::unique_ptr<PingEngine> engine_;
  Course& course_;
  const Clock& clock_;
};

/// Returns the configuration of `sonard --profile`, on an address of this process and without further listeners.
Result<Config> demo_of(const std::string& profile, const BenchOptions& options) {
  auto found = find_config("", true);
  if (!found) return tl::make_unexpected(found.error());
  RunCommand command;
  command.demo = true, command.profile = profile, command.bind = own_address();
  Config& config = found->config;
  if (const auto r = override_config(config, command); !r) return tl::make_unexpected(r.error());
  config.engine = options.engine;
  config.seed = options.seed;
  config.poses.protobuf.enabled = config.poses.json.enabled = false;
  config.control.stream.enabled = config.control.http.enabled = false;
  return std::move(config);
}

v1::SonarStatus status_of(Service& service, const Clock& clock) {
  std::promise<v1::SonarStatus> status;
  service.app().post([&] { status.set_value(service.app().devices().front().status(clock.now())); });
  return status.get_future().get();
}

/// Measures a demo with a driver. Without `rate_hz` the rate is that of a usual driver.
Result<json> serve(const protocol::Make& make, const std::string& profile, std::optional<double> rate_hz,
                   const ScenePointer& scene, const BenchOptions& options) {
  auto config = demo_of(profile, options);
  if (!config) return tl::make_unexpected(config.error());
  Course course;
  const Clock clock(false);
  auto service = Service::start(*std::move(config), scene, options, [&](std::unique_ptr<PingEngine> engine) {
    return std::make_unique<Watched>(std::move(engine), course, clock);
  });
  if (!service) return tl::make_unexpected(service.error());
  clients::Wanted wanted;
  wanted.settings.rate_hz = rate_hz;
  auto stream = clients::PingStream::open({own_address(), 0}, &make, wanted, patience);
  if (!stream) return tl::make_unexpected(stream.error());

  std::vector<double> latency_ms;
  const auto read = [&](int pings, double period_s) -> Result<void> {
    for (const double end = now_s() + period_s; pings > 0 && now_s() < end;) {
      const auto item = stream->next(patience);
      if (item.what != clients::Wait::data)
        return failure(ErrorKind::unavailable, "the demo of " + profile + " sent no ping: " + item.error);
      const Time arrived = clock.now();
      if (!item.ping) continue;
      --pings;
      if (const auto fired = course.fired_of(arrived)) latency_ms.push_back(1e3 * seconds(arrived - *fired));
    }
    return {};
  };
  if (const auto warm = read(options.pings / 10 + 1, warm_up_s); !warm) return tl::make_unexpected(warm.error());
  latency_ms.clear();
  const v1::SonarStatus before = status_of(**service, clock);
  const double begin_s = now_s(), used_s = processor_s() - this_thread_s();
  if (const auto measured = read(options.pings, measured_s); !measured) return tl::make_unexpected(measured.error());
  const double took_s = now_s() - begin_s, processor_ms = 1e3 * (processor_s() - this_thread_s() - used_s);
  const v1::SonarStatus after = status_of(**service, clock);
  const auto made = after.figures().pings() - before.figures().pings();
  const auto skipped = after.figures().skipped_ticks() - before.figures().skipped_ticks();
  return json{{"make", std::string(make.title)},
              {"profile", profile},
              {"threads", options.threads.back()},
              {"rate_hz", after.rate_hz()},
              {"on_request", after.on_request()},
              {"beams", after.beams()},
              {"rows", after.rows()},
              {"range_m", after.range_m()},
              {"pings", made},
              {"pings_per_second", static_cast<double>(made) / took_s},
              {"latency", Times(latency_ms)},
              {"processor_ms", made > 0 ? processor_ms / static_cast<double>(made) : 0},
              {"skipped_ticks", skipped}};
}

void print(const json& f) {
  const std::string rate = f["on_request"] ? "on request" : std::to_string(std::lround(f["rate_hz"].get<double>())) + " Hz";
  std::printf(
      "P0   %-18s %-10s %3d beams x %4d rows: pose to last byte median %6.2f ms, p95 %6.2f; %6.2f processor ms; "
      "%5.1f pings/s, %d ticks skipped\n",
      f["profile"].get<std::string>().c_str(), rate.c_str(), f["beams"].get<int>(), f["rows"].get<int>(),
      f["latency"]["median_ms"].get<double>(), f["latency"]["p95_ms"].get<double>(), f["processor_ms"].get<double>(),
      f["pings_per_second"].get<double>(), f["skipped_ticks"].get<int>());
  std::fflush(stdout);
}

}  // namespace

Result<json> find_demos(const BenchOptions& options) {
  const auto config = find_config("", true);
  if (!config) return tl::make_unexpected(config.error());
  const auto scene = load_scene(config->config.scene, config->config.origin);
  if (!scene) return tl::make_unexpected(scene.error());
  json found = json::array();
  for (const protocol::Make& make : protocol::makes())
    for (const auto& model : make.device->models()) {
      const bool is_demo =
          make.demo_profile.empty() ? model == make.device->models().front() : model->profile == make.demo_profile;
      auto usual = serve(make, model->profile, std::nullopt, *scene, options);
      if (!usual) return tl::make_unexpected(usual.error());
      (*usual)["demo"] = is_demo;
      print(*usual);
      found.push_back(*usual);
      if (!is_demo || (*usual)["on_request"]) continue;
      // If its drivers can set the rate, the demo also runs at the product's highest rate.
      auto fastest = serve(make, model->profile, model->max_rate_hz, *scene, options);
      if (!fastest && fastest.error().kind == ErrorKind::usage) continue;
      if (!fastest) return tl::make_unexpected(fastest.error());
      (*fastest)["demo"] = true;
      print(*fastest);
      found.push_back(*std::move(fastest));
    }
  return found;
}

}  // namespace sonar::bench
