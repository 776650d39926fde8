// The part of a device ping that the CPU computes: the tiles in view and their values for this ping, point echoes, multipath
// echoes, and a few hundred values of the water and the receiver. The results are stored in a PingView. Only multipath is slow:
// core/pipeline/multipath sums its echoes, which are sent as columns.
#pragma once

#include <array>
#include <memory>
#include <span>
#include <vector>

#include "core/pipeline/interference.hpp"
#include "core/pipeline/multipath/multipath.hpp"
#include "core/pipeline/ping_engine.hpp"
#include "core/pipeline/ping_scalars.hpp"
#include "core/pipeline/specular/specular.hpp"
#include "cuda/arena.hpp"
#include "cuda/cell_store.hpp"
#include "cuda/flat_scene.hpp"
#include "cuda/plan_tables.hpp"

namespace sonar::cuda {

/// A requested ping, from its request until its result has been returned.
struct WantedPing {
  enum class State { open, under_way, done };
  PingRequest request;
  Ping ping = {};
  PingStatistics statistics = {};
  State state = State::open;
};

/// The memory, lane and pings of one batch.
struct BatchRoom {
  BatchRoom(Machine& machine, int which_lane, std::size_t most_pings);

  struct Ping {
    sonar::Ping ping;  // has the right sizes, but no values yet
    WantedPing* wanted;
    std::shared_ptr<const PlanTables> plan;
    Arena::Slice<std::uint8_t> codes;
    Arena::Slice<float> pressure, beams;
    Arena::Slice<FirstHit> truth;
    Arena::Slice<std::uint32_t> counters;
    PingStatistics statistics;
  };
  int lane;
  Arena tables, work, results, cells;
  std::vector<PingView> views;
  std::vector<Ping> pings;
  bool launched = false;

  /// All arenas that a batch uses.
  std::array<Arena*, 4> arenas() { return {&tables, &work, &results, &cells}; }
  /// Queues copies of views and tables. The views have the same addresses as in the previous batch. Therefore a captured graph
  /// (cuda_module.cu) can be reused.
  const PingView* upload();

 private:
  Arena view_memory_;
  Arena::Slice<PingView> view_table_;
};

/// A ping to be added to a batch.
struct AskedPing {
  WantedPing* wanted;
  std::shared_ptr<PlanTables> plan;
};

/// Scene and cells of an engine on the device, and buffers that are kept between pings.
class PingPreparer {
 public:
  PingPreparer(Machine& machine, std::shared_ptr<const Scene> scene, const RayScene& rays, const simd::Kernels& kernels,
               Parallel& pool, std::size_t cell_bytes, double (*now_s)());

  /// Adds the pings to the room. Several pings, all of which may_go_together(), use one thread each; a single ping uses all
  /// threads. Bodies must have been placed; `cells` must serve the requests. `lane` is the lane of the tables and cells that
  /// stay on the device. Returns the pings for whose tiles there is no room. For these, finish the running batches, call
  /// forget_cells(), and add them again.
  std::vector<AskedPing> add(std::span<const AskedPing> pings, SurfaceCells& cells, int lane, BatchRoom& room);
  /// True if the pings can be prepared together, because neither changes values of the other: poses of bodies, gain of a plan,
  /// mirrors.
  static bool may_go_together(const AskedPing& a, const AskedPing& b);
  void forget_cells() { store_.clear(); }
  /// Like forget_cells(), but also releases the memory.
  void release() { store_.release(); }

 private:
  /// A ping while its view is being filled.
  struct Making {
    const AskedPing& asked;
    BatchRoom& room;
    const PingPlan& plan;
    PingScalars scalars;
    std::span<const Pose> bodies;
    std::vector<LawTable> laws = {};
    std::vector<float> turned_away = {};
    CellView looks_at = {};
    const CellsInView* seen = nullptr;  // points into PingPreparer::found_
    PingView view{};
    BatchRoom::Ping ping{};
    bool fits = true;

    const PingRequest& request() const { return asked.wanted->request; }
    double& seconds(Stage s) { return ping.statistics.seconds[static_cast<std::size_t>(s)]; }
    std::size_t columns() const { return static_cast<std::size_t>(plan.columns.count); }
    std::size_t samples() const { return static_cast<std::size_t>(plan.samples); }
    std::size_t beams() const { return static_cast<std::size_t>(plan.settings.beam_count); }
  };
  struct Worker {  // buffers of one thread, kept from ping to ping
    SpecularEchoes specular_echoes;
    std::vector<PreparedTile> tiles;
    std::vector<const std::int16_t*> tile_cells;
  };
  Making begin(const AskedPing& asked, int lane, BatchRoom& room);
  void look(std::span<Making> all, SurfaceCells& cells);
  void complete(Making& m, const PingContext& context, int lane, Worker& worker);
  void place_fan(Making& m);
  void find_points(Making& m, const PingContext& context, Worker& worker);
  void add_points(Making& m, std::span<const PointEcho> points, std::span<const ReceivedPulse> pulses);
  bool find_tiles(Making& m, const PingContext& context, int lane, Worker& worker);
  static TileView view_of(const PreparedTile& prepared, const std::int16_t* cells, const float* law);
  void lay_out_tiles(Making& m, const Worker& worker, Parallel& pool);
  void add_water(Making& m);
  void add_receiver(Making& m);
  void allocate_results(Making& m);
  double now() const { return now_s_ ? now_s_() : 0; }

  std::shared_ptr<const Scene> scene_;
  const RayScene& rays_;
  const simd::Kernels& kernels_;
  Parallel& pool_;
  Parallel one_thread_;
  double (*now_s_)();  // null = times are not measured
  FlatScene flat_;
  Arena scene_memory_;
  TracerView tracer_;
  CellStore store_;
  MultipathWork multipath_;
  std::vector<CellsInView> found_;  // cells of the pings that add() is adding
  std::vector<Worker> workers_;     // by number of the thread
};

// Completes pings from the results that a batch has copied from the device.

/// Adds the times of a batch's steps to the statistics of its pings, in equal shares.
void share_times(const StepSeconds& seconds, BatchRoom& room);
/// Completes a ping from its downloaded results.
void take_results(BatchRoom::Ping& from, const PingView& view);

}  // namespace sonar::cuda
