// The tiles of surface cells that are stored on the device. Each tile is sent once, when it is first in view. The stored tiles
// are copies of the CPU's bytes (core/scene/cells), so positions and speckle are the same. A hash of the weights shows when the
// CPU has reused the memory of a tile for another tile.
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
  /// `budget_bytes`: limit of the device's memory. The tiles of a single ping may exceed it.
  CellStore(Machine& machine, std::size_t budget_bytes);

  /// Finds the address on the device of each tile's cells, in the order of `tiles`. Copies of missing tiles are queued on
  /// `lane`; `staging` contains their bytes and must not change until they have been copied. Returns false if there is no room:
  /// call clear() when no unfinished ping needs the stored tiles, then call again. Several threads may call it at the same
  /// time, also with the same `staging`.
  bool find(std::span<const TileInView> tiles, int lane, Arena& staging, std::vector<const std::int16_t*>& cells, Parallel& pool);
  void clear();
  void release();  // also frees the memory

  std::size_t bytes() const { return memory_.taken_bytes(); }

 private:
  struct Held {
    const std::int16_t* data = nullptr;  // the tile's address on the CPU; null = a free entry
    std::uint64_t weights_hash = 0;      // differs between tiles, except by chance
    std::int32_t object = 0, axis = 0, level = 0, count = 0;
    Vec3d centre_m;
    const std::int16_t* device = nullptr;
  };
  /// A hash table of tiles by their addresses on the CPU. A look-up reads few cache lines, because a ping needs thousands of
  /// look-ups.
  class Table {
   public:
    const Held& at(const std::int16_t* data) const { return slots_[slot_of(data)]; }  // a free entry if the tile is missing
    void put(const Held& held);
    void clear();
    bool empty() const { return used_ == 0; }
    void prefetch(const std::int16_t* data) const { __builtin_prefetch(&slots_[first_slot(data)]); }

   private:
    std::size_t first_slot(const std::int16_t* data) const;
    std::size_t slot_of(const std::int16_t* data) const;
    std::vector<Held> slots_ = std::vector<Held>(1024);  // a power of two; at most half of the entries are in use
    std::size_t used_ = 0;
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
