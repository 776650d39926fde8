#include "cuda/cell_store.hpp"

#include <algorithm>
#include <utility>

namespace sonar::cuda {
namespace {

constexpr std::size_t chunk_bytes = 16u << 20;
constexpr std::size_t tiles_at_once = 256;  // number of tiles that one worker looks up
constexpr std::size_t ahead = 8;            // distance of prefetches, in tiles
constexpr std::size_t most_values_a_copy = (2u << 20) / sizeof(std::int16_t);

std::size_t values(const CellTile& t) { return static_cast<std::size_t>(t.stride) * CellTile::columns; }

}  // namespace

std::size_t CellStore::Table::first_slot(const std::int16_t* data) const {
  // The upper bits of a product with 2^64 divided by the golden ratio are spread evenly.
  const std::uint64_t spread = reinterpret_cast<std::uintptr_t>(data) * 0x9E3779B97F4A7C15u;
  return static_cast<std::size_t>(spread >> 32) & (slots_.size() - 1);
}

std::size_t CellStore::Table::slot_of(const std::int16_t* data) const {
  std::size_t i = first_slot(data);
  while (slots_[i].data && slots_[i].data != data) i = (i + 1) & (slots_.size() - 1);
  return i;
}

void CellStore::Table::put(const Held& held) {
  if (2 * used_ >= slots_.size()) {
    const std::vector<Held> before = std::exchange(slots_, std::vector<Held>(2 * slots_.size()));
    for (const Held& h : before)
      if (h.data) slots_[slot_of(h.data)] = h;
  }
  Held& slot = slots_[slot_of(held.data)];
  used_ += slot.data ? 0 : 1;
  slot = held;
}

void CellStore::Table::clear() { *this = Table(); }

CellStore::CellStore(Machine& machine, std::size_t budget_bytes)
    : machine_(machine), budget_bytes_(budget_bytes), memory_(machine, Arena::Where::device, chunk_bytes) {}

const CellStore::Held* CellStore::held(const CellTile& t) const {
  const Held& h = tiles_.at(t.data.get());
  if (!h.data) return nullptr;
  // Another tile may use the memory of a dropped tile. The other fields distinguish the two.
  const bool same = h.weights_hash == t.weights_hash && h.object == t.object && h.axis == t.axis && h.level == t.level &&
                    h.count == t.count && h.centre_m.x == t.centre_m.x && h.centre_m.y == t.centre_m.y &&
                    h.centre_m.z == t.centre_m.z;
  return same ? &h : nullptr;
}

void CellStore::clear() {
  // No tile is in use, because the caller has waited for the device.
  tiles_.clear();
  memory_.clear();
}

void CellStore::release() {
  clear();
  memory_.release();
}

bool CellStore::find(std::span<const TileInView> tiles, int lane, Arena& staging, std::vector<const std::int16_t*>& cells,
                     Parallel& pool) {
  cells.assign(tiles.size(), nullptr);
  // Number of 16-bit values that are not on the device. Tiles are sent once.
  const auto missing = [&] {
    std::size_t more = 0;
    for (std::size_t i = 0; i < tiles.size(); ++i)
      if (!cells[i]) more += values(*tiles[i].tile);
    return more;
  };
  {
    // Look-ups run in parallel, because the map does not change meanwhile.
    const std::shared_lock lock(changing_);
    pool.for_each((tiles.size() + tiles_at_once - 1) / tiles_at_once, [&](std::size_t part, int) {
      const std::size_t end = std::min(tiles.size(), (part + 1) * tiles_at_once);
      for (std::size_t i = part * tiles_at_once; i < end; ++i) {
        // Prefetches tiles and entries, which lie anywhere in memory.
        if (i + 2 * ahead < end) __builtin_prefetch(&tiles[i + 2 * ahead].tile->data);
        if (i + ahead < end) tiles_.prefetch(tiles[i + ahead].tile->data.get());
        if (const Held* h = held(*tiles[i].tile)) cells[i] = h->device;
      }
    });
  }
  if (missing() == 0) return true;
  const std::unique_lock lock(changing_);
  for (std::size_t i = 0; i < tiles.size(); ++i)  // another ping may have sent tiles meanwhile
    if (const Held* h = cells[i] ? nullptr : held(*tiles[i].tile)) cells[i] = h->device;
  // An empty store accepts any ping, even beyond its budget.
  if (!tiles_.empty() && bytes() + missing() * sizeof(std::int16_t) > budget_bytes_) return false;
  for (std::size_t i = 0; i < tiles.size();) i = send_from(tiles, i, lane, staging, cells);
  return true;
}

/// Sends the next missing tiles in one copy of limited size, because allocation of large pieces of memory for fast copies is
/// slow. Returns the index after the last tile sent.
std::size_t CellStore::send_from(std::span<const TileInView> tiles, std::size_t from, int lane, Arena& staging,
                                 std::vector<const std::int16_t*>& cells) {
  const std::size_t most = machine_.pieces_apart() ? 1 : most_values_a_copy;
  std::vector<std::size_t> sent;
  std::size_t more = 0, end = from;
  for (; end < tiles.size() && more < most; ++end) {
    if (cells[end]) continue;
    sent.push_back(end);
    more += values(*tiles[end].tile);
  }
  if (sent.empty()) return end;
  const auto host = staging.allocate<std::int16_t>(more);
  const auto device = memory_.allocate<std::int16_t>(more);
  std::size_t at = 0;
  for (const std::size_t i : sent) {
    const CellTile& t = *tiles[i].tile;
    std::memcpy(host.host + at, t.data.get(), values(t) * sizeof(std::int16_t));
    cells[i] = device.device + at;
    at += values(t);
  }
  machine_.upload(lane, device.device, host.host, more * sizeof(std::int16_t));
  for (const std::size_t i : sent) {  // other pings may use the tiles as soon as the copy is queued
    const CellTile& t = *tiles[i].tile;
    tiles_.put({t.data.get(), t.weights_hash, t.object, t.axis, t.level, t.count, t.centre_m, cells[i]});
  }
  return end;
}

}  // namespace sonar::cuda
