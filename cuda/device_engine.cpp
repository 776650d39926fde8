#include "cuda/device_engine.hpp"

#include <algorithm>
#include <cmath>
#include <new>
#include <optional>
#include <set>
#include <stdexcept>

#include "core/pipeline/check_request.hpp"
#include "core/pipeline/simulate.hpp"
#include "core/pipeline/truth.hpp"
#include "core/pipeline/water_line.hpp"
#include "cuda/prepare_ping.hpp"
#include "cuda/steps.hpp"

namespace sonar::cuda {
namespace {

// Sets of settings with tables on the device.
constexpr std::size_t most_plans = 8;
constexpr int keeping_lane = 2;  // of what stays on the device: plans and cells; rooms have 0 and 1

/// Where the benchmark's table has a step.
constexpr Stage stage_of(Step step) {
  if (step <= Step::first_hits) return Stage::trace;
  if (step <= Step::place) return Stage::scatter;
  if (step <= Step::unfold) return Stage::synthesize;
  if (step <= Step::finish_columns) return Stage::noise;
  return step == Step::receive ? Stage::receive : Stage::form_beams;
}

/// The options, with budgets that the device has room for. The rest is the kernels' own, other programs' and the scene's.
DeviceEngineOptions fitted(DeviceEngineOptions options, std::size_t free_bytes) {
  options.cell_bytes = std::min(options.cell_bytes, free_bytes / 5 * 2);
  options.work_bytes = std::min(options.work_bytes, free_bytes / 5);
  return options;
}

class DeviceEngine final : public PingEngine {
 public:
  DeviceEngine(std::shared_ptr<const Scene> scene, Parallel& pool, const EngineOptions& options, std::unique_ptr<Machine> machine,
               DeviceEngineOptions device_options)
      : machine_(std::move(machine)),
        device_options_(fitted(std::move(device_options), machine_->free_bytes())),
        options_(options),
        scene_(scene),
        pool_(pool),
        kernels_(simd::kernels_for(options.simd)),
        rays_(scene, pool.threads()),
        preparer_(*machine_, scene, rays_, kernels_, pool, device_options_.cell_bytes, options.now_s),
        batch_(static_cast<std::size_t>(std::max(1, device_options_.batch))),
        rooms_{BatchRoom(*machine_, 0, batch_), BatchRoom(*machine_, 1, batch_)},
        work_(options.now_s) {}
  ~DeviceEngine() override {
    for (int lane = 0; lane < Machine::lanes; ++lane) try_to_wait(lane);  // memory goes when nothing uses it any more
  }

  std::vector<Ping> run(std::span<const PingRequest> asked) override {
    std::vector<PingRequest> room;
    const std::span<const PingRequest> requests = in_water(asked, *scene_, room);
    for (const PingRequest& request : requests)
      if (const std::string why = why_invalid(request); !why.empty()) throw std::invalid_argument(why);
    std::vector<Ping> pings = computed(requests);
    tell_as_asked(asked, pings);
    return pings;
  }

  std::string description() const override {
    return (failed_ ? "cpu, after a failure of " : "cuda, ") + machine_->name() + ", " + kernels_.name + ", " +
           std::to_string(pool_.threads()) + (pool_.threads() == 1 ? " thread" : " threads");
  }
  PingStatistics statistics() const override { return statistics_; }
  std::vector<PingStatistics> statistics_of_each() const override { return each_; }

 private:
  std::vector<Ping> computed(std::span<const PingRequest> requests) {
    std::vector<Ping> pings(requests.size());
    each_.assign(requests.size(), {});
    done_.assign(requests.size(), false);
    if (!failed_) try {
        while (!tried_on_device(requests, pings)) {
        }
        return pings;
      } catch (const std::bad_alloc&) {  // of the computer's memory: what was begun is forgotten, the next ping begins anew
        for (int lane = 0; lane < Machine::lanes; ++lane) try_to_wait(lane);
        for (BatchRoom& room : rooms_) empty(room);
        preparer_.forget_cells();
        throw;
      } catch (const std::runtime_error& e) {
        failed_ = std::string("the CUDA engine stopped: ") + e.what();
        for (BatchRoom& room : rooms_) empty(room);
        if (device_options_.cpu_after_failure) say(*failed_ + "; from here on the CPU computes");
      }
    // After a failure the device is not used again.
    if (!device_options_.cpu_after_failure) throw EngineUnavailable(*failed_ + "; use --engine cpu or auto");
    for (std::size_t i = 0; i < requests.size(); ++i) {
      pings[i] = by_cpu(requests[i]);
      each_[i] = statistics_;
    }
    return pings;
  }

  /// False: the device's memory was full. What it took has been given back, and what is not done may be tried again.
  bool tried_on_device(std::span<const PingRequest> requests, std::vector<Ping>& pings) {
    try {
      run_on_device(requests, pings);
      return true;
    } catch (const DeviceMemoryFull&) {
      for (int lane = 0; lane < Machine::lanes; ++lane) machine_->wait(lane);
      if (one_room_ && all_given_back_) throw;
      all_given_back_ = true;
      one_room_ = batch_ == 1;
      batch_ = std::max<std::size_t>(1, batch_ / 2);
      for (BatchRoom& room : rooms_) {
        empty(room);
        for (Arena* arena : room.arenas()) arena->give_back();
      }
      preparer_.give_back();
      plans_.clear();
      say("CUDA: the device's memory is full; from here on " +
          (one_room_ ? "one ping at a time" : "batches of at most " + std::to_string(batch_)));
      return false;
    }
  }

  void run_on_device(std::span<const PingRequest> requests, std::vector<Ping>& pings) {
    std::size_t which = 0;
    for (std::size_t i = 0; i < requests.size();) {
      if (done_[i]) {
        ++i;
        continue;
      }
      if (const std::string why = why_by_cpu(requests[i]); !why.empty()) {
        if (told_.insert(why).second) say("CUDA: " + why);
        pings[i] = by_cpu(requests[i]);
        each_[i] = statistics_;
        done_[i++] = true;
        continue;
      }
      // Two rooms take turns: the CPU prepares one batch while the device computes the other.
      BatchRoom& room = rooms_[which];
      std::vector<AskedPing> asked = some_from(requests, i, room);
      i += asked.size();
      for (bool forgotten = false;;) {
        std::vector<AskedPing> left = preparer_.add(asked, *cells_, keeping_lane, room);
        if (left.empty()) break;
        if (forgotten && left.size() == asked.size()) throw std::runtime_error("the tiles of one ping do not fit an empty store");
        launch(room);
        for (BatchRoom& r : rooms_) finish(r, pings);
        preparer_.forget_cells();
        forgotten = true;
        asked = std::move(left);
      }
      work_a_ping_ = room.work.taken_bytes() / room.pings.size();
      // A batch is full by number, or by memory [bytes].
      if (room.pings.size() < batch_ && room.work.taken_bytes() < device_options_.work_bytes) continue;
      launch(room);
      if (!one_room_) which = 1 - which;
      finish(rooms_[which], pings);  // the other one: it has had the time it took to prepare this one
    }
    launch(rooms_[which]);
    finish(rooms_[1 - which], pings);
    finish(rooms_[which], pings);
    all_given_back_ = false;
  }

  /// The next requests, from `first` on, that can be prepared together, as many as the room has place for: by number, and by
  /// memory as far as it is known what a ping takes.
  std::vector<AskedPing> some_from(std::span<const PingRequest> requests, std::size_t first, const BatchRoom& room) {
    place(requests[first]);
    std::vector<AskedPing> some{{&requests[first], first, plan_for(requests[first])}};
    const std::size_t bytes = device_options_.work_bytes - std::min(device_options_.work_bytes, room.work.taken_bytes());
    const std::size_t most = std::min(batch_ - room.pings.size(), work_a_ping_ > 0 ? bytes / work_a_ping_ : 1);
    for (std::size_t i = first + 1; i < requests.size() && some.size() < most; ++i) {
      const PingRequest& request = requests[i];
      if (done_[i] || !why_by_cpu(request).empty() || !cells_->serves(request.seed, fields_of(request))) break;
      AskedPing next{&request, i, plan_for(request)};
      if (!std::all_of(some.begin(), some.end(), [&](const AskedPing& a) { return PingPreparer::may_go_together(a, next); }))
        break;
      some.push_back(std::move(next));
    }
    return some;
  }

  /// Empty when the device does it.
  std::string why_by_cpu(const PingRequest& request) const {
    if (const std::string why = why_not_on_device(request); !why.empty()) return why + " are computed by the CPU";
    const std::string without = why_not_on_device(request, false);
    const std::string missing = without.empty() ? "" : machine_->why_no_transforms();  // not asked about without need
    return missing.empty() ? "" : without + " are computed by the CPU (" + missing + ")";
  }
  static CellFields fields_of(const PingRequest& request) { return {request.switches.texture, request.switches.grain}; }
  /// What device and CPU share: the scene as this request finds it.
  void place(const PingRequest& request) {
    if (!cells_ || !cells_->serves(request.seed, fields_of(request)))
      // Weights of cells are drawn from the seed: another seed needs other tiles.
      cells_ = std::make_unique<SurfaceCells>(scene_, request.seed, options_.cell_cache_bytes, fields_of(request));
    if (!scene_->bodies_in_world.empty())
      rays_.place(request.bodies_in_world.empty() ? scene_->bodies_in_world : request.bodies_in_world);
  }
  Ping by_cpu(const PingRequest& request) {
    place(request);
    Ping ping = simulate(rays_, *cells_, request, kernels_, work_, pool_);
    statistics_ = work_.statistics();
    return ping;
  }

  std::shared_ptr<PlanTables> plan_for(const PingRequest& request) {
    const auto it = std::find_if(plans_.begin(), plans_.end(), [&](const auto& p) { return p->serves(request); });
    if (it != plans_.end()) {
      std::rotate(plans_.begin(), it, it + 1);  // newest first
      return plans_.front();
    }
    // The least recently used goes; batches under way hold their own reference.
    if (plans_.size() >= most_plans) plans_.pop_back();
    plans_.insert(plans_.begin(), std::make_shared<PlanTables>(*machine_, keeping_lane, request));
    return plans_.front();
  }

  void launch(BatchRoom& room) {
    if (room.pings.empty()) return;
    // Plans and cells that were sent before are there when this lane begins.
    machine_->order(room.lane, keeping_lane);
    Launch launch;
    launch.views = room.upload();
    launch.pings = static_cast<std::int32_t>(room.views.size());
    launch.timed = options_.now_s != nullptr ? 1 : 0;
    // A launch covers the largest ping of the batch; smaller ones leave the rest idle.
    for (int step = 0; step < step_count; ++step)
      for (const PingView& view : room.views)
        launch.largest[step] = std::max(launch.largest[step], step_size(static_cast<Step>(step), view));
    run_steps(room, launch);
    room.results.download(room.lane);
  }

  /// In one slice, or in three where transforms stand between.
  void run_steps(const BatchRoom& room, Launch launch) {
    const auto run_to = [&](int to) {
      launch.to = to;
      machine_->run(room.lane, launch);
      launch.from = to;
    };
    // (25): transform of the grids before fold, inverse transform before unfold.
    if (launch.largest[static_cast<int>(Step::spread)] > 0) {
      for (const bool inverse : {false, true}) {
        run_to(static_cast<int>(inverse ? Step::unfold : Step::fold));
        for (const PingView& view : room.views) {
          const SpectralView& s = view.spectral;
          if (s.grids)
            machine_->transform(room.lane, inverse ? s.folded : s.grids, inverse ? s.period : s.points, view.sea.columns,
                                inverse);
        }
      }
    }
    run_to(step_count);
  }

  void finish(BatchRoom& room, std::vector<Ping>& pings) {
    if (room.pings.empty()) return;
    machine_->wait(room.lane);
    if (options_.now_s) share_times(room);
    pool_.for_each(room.pings.size(), [&](std::size_t i, int) {
      const std::size_t index = room.pings[i].index;
      pings[index] = ping_from(room.pings[i], room.views[i]);
      each_[index] = room.pings[i].statistics;
    });
    for (const BatchRoom::Ping& ping : room.pings) done_[ping.index] = true;
    statistics_ = room.pings.back().statistics;
    empty(room);
  }
  /// Every ping of a batch took as long as the others.
  void share_times(BatchRoom& room) {
    const StepSeconds seconds = machine_->step_seconds(room.lane);
    const auto pings = static_cast<double>(room.pings.size());
    for (BatchRoom::Ping& ping : room.pings) {
      ping.statistics.seconds[static_cast<std::size_t>(Stage::synthesize)] += seconds.transforms / pings;
      for (int step = 0; step < step_count; ++step)
        ping.statistics.seconds[static_cast<std::size_t>(stage_of(static_cast<Step>(step)))] += seconds.of[step] / pings;
    }
  }
  static Ping ping_from(BatchRoom::Ping& from, const PingView& view) {
    Ping ping = std::move(from.ping);
    const auto copy = [](void* to, const void* host, std::size_t bytes) {
      if (bytes > 0) std::memcpy(to, host, bytes);
    };
    copy(ping.samples.data(), from.codes.host, ping.samples.size());
    copy(ping.pressure_upa.data(), from.pressure.host, ping.pressure_upa.size() * sizeof(float));
    copy(ping.beam_signal_upa.data(), from.beams.host, ping.beam_signal_upa.size() * sizeof(std::complex<float>));
    if (ping.request.switches.keep_truth) {
      std::vector<BeamTruth> by_column(static_cast<std::size_t>(view.sea.columns));
      if (view.first_hits)
        for (std::size_t k = 0; k < by_column.size(); ++k)
          if (from.truth.host[k].object != no_object) by_column[k] = {from.truth.host[k].range_m, from.truth.host[k].object};
      ping.truth = truth_of_beams(from.plan->plan(), by_column);
    }
    // Rays and echoes are counted on the device; base rays are known beforehand.
    if (view.has_scene != 0) {
      from.statistics.rays +=
          from.counters.host[0] + static_cast<std::size_t>(view.sea.columns) * static_cast<std::size_t>(view.sea.elevations);
      from.statistics.echoes += from.counters.host[1];
    }
    return ping;
  }
  /// Arenas keep their memory.
  static void empty(BatchRoom& room) {
    room.views.clear();
    room.pings.clear();
    for (Arena* arena : room.arenas()) arena->clear();
  }

  void say(const std::string& what) const {
    if (device_options_.say) device_options_.say(what);
  }
  void try_to_wait(int lane) const {
    try {
      machine_->wait(lane);
    } catch (const std::runtime_error&) {  // it has failed, and what it had to do with it
    }
  }

  std::unique_ptr<Machine> machine_;  // goes last
  DeviceEngineOptions device_options_;
  EngineOptions options_;
  std::shared_ptr<const Scene> scene_;
  Parallel& pool_;
  const simd::Kernels& kernels_;
  RayScene rays_;
  std::unique_ptr<SurfaceCells> cells_;
  std::vector<std::shared_ptr<PlanTables>> plans_;
  PingPreparer preparer_;
  std::size_t batch_;            // pings that are launched together
  std::size_t work_a_ping_ = 0;  // bytes, of the last batch
  BatchRoom rooms_[2];
  Workspace work_;  // of the CPU
  std::set<std::string> told_;
  PingStatistics statistics_;
  std::vector<PingStatistics> each_;   // of the last run
  std::vector<bool> done_;             // which of its pings
  bool one_room_ = false;              // for lack of memory: nothing is prepared while the device computes
  bool all_given_back_ = false;        // since the last run that had memory enough
  std::optional<std::string> failed_;  // why
};

}  // namespace

std::unique_ptr<PingEngine> make_device_engine(std::shared_ptr<const Scene> scene, Parallel& pool, const EngineOptions& options,
                                               std::unique_ptr<Machine> machine, DeviceEngineOptions device_options) {
  return std::make_unique<DeviceEngine>(std::move(scene), pool, options, std::move(machine), std::move(device_options));
}

std::string why_not_on_device(const PingRequest& request, bool transforms) {
  const Waveform& w = request.model->modes[static_cast<std::size_t>(request.settings.mode)].waveform;
  if (request.switches.mode != Mode::canonical) return "pings of the comparison modes";
  if (request.switches.fixed_fan > 0) return "pings of a fixed fan";
  if (request.switches.expected_power || transforms) return "";
  if (w.shape == Waveform::Shape::measured) return "pings with a measured pulse";
  if (w.exact) return "pings with an exact pulse";
  return "";
}

}  // namespace sonar::cuda
