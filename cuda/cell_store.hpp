// The tiles of surface cells that the device holds: each is sent once, when a ping first sees it, and stays. They are the CPU's
// own bytes (core/scene/cells), so position and speckle are the same by construction; a tile that the CPU has forgotten and made
// again is recognised by what it is.
#pragma once

#include <cstdint>
#include <shared_mutex>
#include <span>
#include <vector>

#include "core/base/parallel.hpp"
#include "core/scene/cells/surface_cells.hpp"
#include "cuda/arena.hpp"

namespace sonar::cuda {

class CellStore {
 public:
  /// `budget_bytes`: of the device's memory; what one ping sees is kept whatever it takes.
  CellStore(Machine& machine, std::size_t budget_bytes);

  /// Where each tile's cells lie on the device, in the order of `tiles`. What was not there is queued on `lane`; it travels by
  /// way of `staging`, which must stay until that is done. False: they do not fit in beside those that are held; clear() first,
  /// when no ping under way needs them. Several threads may call it at once, each with staging that is its own or locks itself.
  bool find(std::span<const TileInView> tiles, int lane, Arena& staging, std::vector<const std::int16_t*>& cells, Parallel& pool);
  void clear();
  void give_back();  // its memory too

  std::size_t bytes() const { return memory_.taken_bytes(); }

 private:
  struct Held {
    const std::int16_t* data = nullptr;  // where the CPU has the tile; null = a free place
    std::uint64_t weights_hash = 0;      // by chance only do other tiles have the same
    std::int32_t object = 0, axis = 0, level = 0, count = 0;
    Vec3d centre_m;
    const std::int16_t* device = nullptr;
  };
  /// By where the CPU has them: a pair of cache lines a tile, since a ping looks up thousands.
  class Table {
   public:
    const Held& at(const std::int16_t* data) const { return places_[place_of(data)]; }  // free where there is none
    void put(const Held& held);
    void clear();
    bool empty() const { return taken_ == 0; }
    void prefetch(const std::int16_t* data) const { __builtin_prefetch(&places_[first_place(data)]); }

   private:
    std::size_t first_place(const std::int16_t* data) const;
    std::size_t place_of(const std::int16_t* data) const;
    std::vector<Held> places_ = std::vector<Held>(1024);  // a power of two, at most half of them taken
    std::size_t taken_ = 0;
  };
  const Held* held(const CellTile& tile) const;
  std::size_t send_from(std::span<const TileInView> tiles, std::size_t from, int lane, Arena& staging,
                        std::vector<const std::int16_t*>& cells);

  Machine& machine_;
  std::size_t budget_bytes_;
  Arena memory_;
  std::shared_mutex changing_;  // guards tiles_ and memory_
  Table tiles_;
};

}  // namespace sonar::cuda
