#include "cuda/device_engine.hpp"

#include <algorithm>
#include <cmath>
#include <deque>
#include <optional>
#include <set>
#include <stdexcept>

#include "core/pipeline/cpu/simulate.hpp"
#include "core/pipeline/interleaved_pings.hpp"
#include "core/pipeline/water_line.hpp"
#include "core/sonar/range_image.hpp"
#include "cuda/prepare_ping.hpp"
#include "cuda/steps.hpp"

namespace sonar::cuda {
namespace {

// The device holds tables for at most this many sets of settings.
constexpr std::size_t most_plans = 8;
constexpr int keeping_lane = 2;  // lane for data that stay on the device: plans and cells; rooms have lanes 0 and 1

/// True if neither ping has to wait long for the other in one batch: no multipath, and about the same size.
bool are_alike(const PingRequest& a, const PingRequest& b) {
  const auto values = [](const PingSettings& s) {
    return static_cast<double>(s.beam_count) * s.range_bin_count * s.samples_per_row;
  };
  const auto [less, more] = std::minmax({values(a.settings), values(b.settings)});
  return !a.switches.multipath && !b.switches.multipath && more <= 2 * less;
}

/// Reduces the budgets until they fit on the device. The rest of its memory is for kernels, other programs and the scene.
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
        batch_(static_cast<std::size_t>(device_options_.batch > 0 ? device_options_.batch : std::clamp(pool.threads(), 8, 32))),
        rooms_{BatchRoom(*machine_, 0, batch_), BatchRoom(*machine_, 1, batch_)},
        work_(options.now_s) {}
  ~DeviceEngine() override {
    for (int lane = 0; lane < Machine::lanes; ++lane) try_to_wait(lane);  // memory may be released only when no work uses it
  }

  std::vector<Ping> run(std::span<const PingRequest> requests) override {
    submit(requests);
    return take_pings(calls_.size() - 1);
  }
  void submit(std::span<const PingRequest> requests) override {
    Call& call = calls_.emplace_back();
    call.pictures.assign(requests.begin(), requests.end());
    for (const PingRequest& picture : requests)
      if (call.invalid = why_invalid(picture); !call.invalid.empty()) return;
    for (const PingRequest& picture : requests)
      for (PingRequest& ping : pings_of(picture)) call.pings.push_back(std::move(ping));
    std::vector<PingRequest> changed;
    for (const PingRequest& request : in_water(call.pings, *scene_, changed)) wanted_.push_back({request});
    try {
      on_device([this] { begin_open(); });
    } catch (...) {  // collect() tries again, and throws if it fails, too
    }
  }
  std::vector<Ping> collect() override { return take_pings(0); }

  std::string description() const override {
    return (failed_ ? "cpu, after a failure of " : "cuda, ") + machine_->name() + ", " + kernels_.name + ", " +
           std::to_string(pool_.threads()) + (pool_.threads() == 1 ? " thread" : " threads");
  }
  std::size_t most_together(const PingRequest& a, const PingRequest& b) const override {
    // The number of pings that are prepared in parallel. With this limit, a ping waits for the others' steps on the device, but
    // not for their preparation.
    const std::size_t most = std::min(batch_, static_cast<std::size_t>(pool_.threads()));
    return !failed_ && are_alike(a, b) && why_by_cpu(a).empty() && why_by_cpu(b).empty() ? most : 1;
  }
  PingStatistics statistics() const override { return statistics_; }
  std::vector<PingStatistics> statistics_of_each() const override { return each_; }

 private:
  using State = WantedPing::State;
  struct Call {
    std::vector<PingRequest> pictures, pings;  // the requested pictures; the pings that form them
    std::string invalid;                       // reason if a request is invalid; no ping of the call is then computed
  };

  /// Removes the first or the last call and returns its pictures.
  std::vector<Ping> take_pings(std::size_t which) {
    const Call call = std::move(calls_[which]);
    calls_.erase(calls_.begin() + static_cast<std::ptrdiff_t>(which));
    if (!call.invalid.empty()) throw std::invalid_argument(call.invalid);
    const auto begin = which == 0 ? wanted_.begin() : wanted_.end() - static_cast<std::ptrdiff_t>(call.pings.size());
    const auto end = begin + static_cast<std::ptrdiff_t>(call.pings.size());
    std::vector<Ping> pings;
    std::vector<PingStatistics> statistics;
    pings.reserve(call.pings.size());
    each_.clear();
    try {
      complete(begin, end);
      for (auto it = begin; it != end; ++it) {
        pings.push_back(std::move(it->ping));
        statistics.push_back(it->statistics);
      }
    } catch (...) {  // no work is under way: on_device() has waited for it, or the device has failed
      wanted_.erase(begin, end);
      throw;
    }
    wanted_.erase(begin, end);
    std::vector<Ping> pictures;
    std::size_t first = 0;
    for (const PingRequest& picture : call.pictures) {
      const auto count = static_cast<std::size_t>(pings_in(picture));
      pictures.push_back(interleaved(picture, std::span(pings).subspan(first, count)));
      PingStatistics& of_picture = each_.emplace_back();
      for (std::size_t p = first; p < first + count; ++p) add(of_picture, statistics[p]);
      first += count;
    }
    if (!each_.empty()) statistics_ = each_.back();
    return pictures;
  }

  void complete(std::deque<WantedPing>::iterator begin, std::deque<WantedPing>::iterator end) {
    const auto is_open = [&] { return std::any_of(begin, end, [](const WantedPing& w) { return w.state != State::done; }); };
    on_device([&] {
      begin_open();  // needed only after lack of memory, otherwise all pings have been launched
      for (const std::size_t older : {which_, 1 - which_})
        if (is_open()) finish(rooms_[older]);
    });
    if (!failed_) return;
    // After a failure the device is not used again, and the CPU computes all pings of the call, also those already finished.
    if (!device_options_.cpu_after_failure) throw EngineUnavailable(*failed_ + "; use --engine cpu or auto");
    for (auto it = begin; it != end; ++it) compute_by_cpu(*it);
  }

  /// Does the work. If memory is full, repeats it with smaller batches. After an error, unfinished pings are open again.
  template <class Work>
  void on_device(const Work& work) {
    if (!failed_) try {
        while (!has_room_for(work)) {
        }
      } catch (const std::runtime_error& e) {
        failed_ = std::string("the CUDA engine stopped: ") + e.what();
        for (BatchRoom& room : rooms_) empty(room);
        if (device_options_.cpu_after_failure) say(*failed_ + "; from here on the CPU computes");
      } catch (...) {  // host memory is full, or the program has a fault: drops unfinished work
        for (int lane = 0; lane < Machine::lanes; ++lane) try_to_wait(lane);
        for (BatchRoom& room : rooms_) empty(room);
        preparer_.forget_cells();
        plans_.clear();  // a plan may have been sent incompletely
        throw;
      }
  }

  /// Does the work. Returns false if the device's memory was full. The memory has then been released, and unfinished work may be
  /// tried again.
  template <class Work>
  bool has_room_for(const Work& work) {
    try {
      work();
      all_released_ = false;
      return true;
    } catch (const DeviceMemoryFull&) {
      for (int lane = 0; lane < Machine::lanes; ++lane) machine_->wait(lane);
      if (one_room_ && all_released_) throw;
      all_released_ = true;
      one_room_ = batch_ == 1;
      batch_ = std::max<std::size_t>(1, batch_ / 2);
      for (BatchRoom& room : rooms_) {
        empty(room);
        for (Arena* arena : room.arenas()) arena->release();
      }
      preparer_.release();
      plans_.clear();
      say("CUDA: the device's memory is full; from here on " +
          (one_room_ ? "one ping at a time" : "batches of at most " + std::to_string(batch_)));
      return false;
    }
  }

  /// Launches all open pings. Two rooms alternate: while the device computes the batch of one room, the CPU prepares the other,
  /// or the caller uses the pings of an earlier call.
  void begin_open() {
    for (std::size_t i = 0; i < wanted_.size();) {
      if (wanted_[i].state != State::open) {
        ++i;
        continue;
      }
      if (const std::string why = why_by_cpu(wanted_[i].request); !why.empty()) {
        if (reported_.insert(why).second) say("CUDA: " + why);
        compute_by_cpu(wanted_[i++]);
        continue;
      }
      BatchRoom& room = rooms_[which_];
      if (room.launched) finish(room);
      std::vector<AskedPing> asked = some_from(i, room);
      i += asked.size();
      for (bool forgotten = false;;) {
        std::vector<AskedPing> left = preparer_.add(asked, *cells_, keeping_lane, room);
        if (left.empty()) break;
        if (forgotten && left.size() == asked.size()) throw std::runtime_error("the tiles of one ping do not fit an empty store");
        launch(room);
        for (BatchRoom& r : rooms_) finish(r);
        preparer_.forget_cells();
        forgotten = true;
        asked = std::move(left);
      }
      work_a_ping_ = room.work.taken_bytes() / room.pings.size();
      // A batch is full if its number of pings or its memory [bytes] reaches the limit.
      if (room.pings.size() < batch_ && room.work.taken_bytes() < device_options_.work_bytes) continue;
      launch_next();
    }
    launch_next();
  }
  void launch_next() {
    BatchRoom& room = rooms_[which_];
    if (room.launched || room.pings.empty()) return;
    launch(room);
    if (!one_room_) which_ = 1 - which_;
  }

  /// Returns the next requests, from `first` on, that can be prepared together and whose number and memory fit in the room. As
  /// long as the memory of a ping is not known, returns only one.
  std::vector<AskedPing> some_from(std::size_t first, const BatchRoom& room) {
    place(wanted_[first].request);
    std::vector<AskedPing> some{{&wanted_[first], plan_for(wanted_[first].request)}};
    const std::size_t bytes = device_options_.work_bytes - std::min(device_options_.work_bytes, room.work.taken_bytes());
    const std::size_t most = std::min(batch_ - room.pings.size(), work_a_ping_ > 0 ? bytes / work_a_ping_ : 1);
    for (std::size_t i = first + 1; i < wanted_.size() && some.size() < most; ++i) {
      const PingRequest& request = wanted_[i].request;
      if (wanted_[i].state != State::open || !why_by_cpu(request).empty()) break;
      if (!cells_->serves(request.seed, fields_of(request))) break;
      AskedPing next{&wanted_[i], plan_for(request)};
      if (!std::all_of(some.begin(), some.end(), [&](const AskedPing& a) { return PingPreparer::may_go_together(a, next); }))
        break;
      some.push_back(std::move(next));
    }
    return some;
  }

  /// The reason why the CPU must compute this ping; empty if the device can compute it.
  std::string why_by_cpu(const PingRequest& request) const {
    if (const std::string why = why_not_on_device(request); !why.empty()) return why + " are computed by the CPU";
    const std::string without = why_not_on_device(request, false);
    const std::string missing =
        without.empty() ? "" : machine_->why_no_transforms();  // only if needed, because the call loads a library
    return missing.empty() ? "" : without + " are computed by the CPU (" + missing + ")";
  }
  static CellFields fields_of(const PingRequest& request) { return {request.switches.texture, request.switches.grain}; }
  /// Sets the poses of the request, for device and CPU, and makes cells for its seed.
  void place(const PingRequest& request) {
    if (!cells_ || !cells_->serves(request.seed, fields_of(request)))
      // Cells depend on the seed, texture and grain. Therefore other values need other cells.
      cells_ = std::make_unique<SurfaceCells>(scene_, request.seed, options_.cell_cache_bytes, fields_of(request));
    if (!scene_->bodies_in_world.empty())
      rays_.place(request.bodies_in_world.empty() ? scene_->bodies_in_world : request.bodies_in_world);
  }
  void compute_by_cpu(WantedPing& wanted) {
    place(wanted.request);
    wanted.ping = simulate(rays_, *cells_, wanted.request, kernels_, work_, pool_);
    wanted.statistics = work_.statistics();
    wanted.state = State::done;
  }

  std::shared_ptr<PlanTables> plan_for(const PingRequest& request) {
    const auto it = std::find_if(plans_.begin(), plans_.end(), [&](const auto& p) { return p->serves(request); });
    if (it != plans_.end()) {
      std::rotate(plans_.begin(), it, it + 1);  // last used first
      return plans_.front();
    }
    // Drops the least recently used plan. Running batches have their own reference to it.
    if (plans_.size() >= most_plans) plans_.pop_back();
    plans_.insert(plans_.begin(), std::make_shared<PlanTables>(*machine_, keeping_lane, request));
    return plans_.front();
  }

  void launch(BatchRoom& room) {
    if (room.pings.empty()) return;
    // The room's lane waits for the copies of plans and cells that were queued before.
    machine_->order(room.lane, keeping_lane);
    Launch launch;
    launch.views = room.upload();
    launch.pings = static_cast<std::int32_t>(room.views.size());
    launch.timed = options_.now_s != nullptr ? 1 : 0;
    // A launch has the size of the largest ping of the batch. For smaller pings the other threads are idle.
    for (int step = 0; step < step_count; ++step)
      for (const PingView& view : room.views)
        launch.largest[step] = std::max(launch.largest[step], step_size(static_cast<Step>(step), view));
    room.launched = true;
    run_steps(room, launch);
    room.results.download(room.lane);
  }

  /// Launches all steps at once, or in three parts if transforms are between them.
  void run_steps(const BatchRoom& room, Launch launch) {
    const auto run_to = [&](int to) {
      launch.to = to;
      machine_->run(room.lane, launch);
      launch.from = to;
    };
    // Eq. 25: the transform of the grids comes before fold, the inverse transform before unfold.
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

  void finish(BatchRoom& room) {
    if (room.pings.empty()) return;
    machine_->wait(room.lane);
    if (options_.now_s) share_times(machine_->step_seconds(room.lane), room);
    pool_.for_each(room.pings.size(), [&](std::size_t i, int) { take_results(room.pings[i], room.views[i]); });
    empty(room);
  }
  /// Empties a room. Its arenas keep their memory.
  static void empty(BatchRoom& room) {
    for (const BatchRoom::Ping& ping : room.pings)
      if (ping.wanted->state == State::under_way) ping.wanted->state = State::open;
    room.launched = false;
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
    } catch (const std::exception&) {  // the device has failed, so its work is not needed
    }
  }

  std::unique_ptr<Machine> machine_;  // destroyed last
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
  std::size_t work_a_ping_ = 0;  // bytes per ping in the last batch
  BatchRoom rooms_[2];
  std::size_t which_ = 0;          // the room that is filled next; if both are launched, the older one
  std::deque<Call> calls_;         // calls that were not collected, in order
  std::deque<WantedPing> wanted_;  // pings of these calls
  Workspace work_;                 // workspace of the CPU
  std::set<std::string> reported_;
  PingStatistics statistics_;
  std::vector<PingStatistics> each_;  // statistics of the last call that was collected
  bool one_room_ = false;      // true if memory was full with batches of one ping: none is prepared while the device is busy
  bool all_released_ = false;  // true if all memory was released and no work has succeeded since
  std::optional<std::string> failed_;  // reason of the device's failure
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
  if (range_image_of(request) != nullptr) return "range images";
  if (request.switches.keep_labels) return "pings with labels";
  if (request.switches.expected_power || transforms) return "";
  if (w.shape == Waveform::Shape::measured) return "pings with a measured pulse";
  if (w.exact) return "pings with an exact pulse";
  return "";
}

}  // namespace sonar::cuda
