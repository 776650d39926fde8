// Decides which launches get a captured graph, and which graph is used for a launch. The code needs no device, so it can be
// tested. cuda_module.cu captures and launches.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "cuda/device_types.hpp"

namespace sonar::cuda {

inline constexpr std::uint32_t threads_a_block = 128;

/// Number of blocks for the indices of a step. It is rounded up by at most an eighth, or to 8 or 16. So pings with slightly
/// different numbers of cells or points have the same launch; threads beyond the step_size of a ping return at once. The number
/// is never so large that an index could overflow.
inline std::uint32_t blocks_for(std::uint32_t largest) {
  constexpr std::uint64_t most = (std::uint64_t{1} << 32) / threads_a_block;
  const std::uint64_t blocks = (std::uint64_t{largest} + threads_a_block - 1) / threads_a_block;
  std::uint64_t unit = 1;
  while (unit * 16 <= blocks) unit *= 2;  // blocks are 8 to 16 units
  if (blocks <= 16) unit = 8;
  const std::uint64_t rounded = (blocks + unit - 1) / unit * unit;
  return static_cast<std::uint32_t>(rounded < most ? rounded : most);
}

/// The values on which the graph of a launch depends.
struct GraphKey {
  const PingView* views = nullptr;
  std::int32_t pings = 0, from = 0, to = 0;
  std::uint32_t blocks[step_count] = {};

  GraphKey() = default;
  explicit GraphKey(const Launch& l) : views(l.views), pings(l.pings), from(l.from), to(l.to) {
    for (int step = from; step < to; ++step) blocks[step] = blocks_for(l.largest[step]);
  }
  bool operator==(const GraphKey& other) const {
    bool same = views == other.views && pings == other.pings && from == other.from && to == other.to;
    for (int step = 0; step < step_count; ++step) same = same && blocks[step] == other.blocks[step];
    return same;
  }
};

/// The last launches on one lane, newest first, with the graphs of launches that occurred twice. A capture takes longer than a
/// graph saves in one launch. `Graph` is a pointer.
template <class Graph>
class GraphShelf {
 public:
  static constexpr std::size_t room = 6;
  struct Entry {
    GraphKey key;
    Graph graph = nullptr;
    int seen = 0;
  };
  /// Finds or adds the launch's entry, which becomes the newest. `dropped` gets the graph of the replaced entry, or null.
  Entry& look_up(const GraphKey& key, Graph& dropped) {
    dropped = nullptr;
    std::size_t i = 0;
    while (i < entries_.size() && !(entries_[i].key == key)) ++i;
    if (i == entries_.size()) {
      if (i == room) {
        dropped = entries_.back().graph;
        entries_.pop_back();
      }
      entries_.push_back({key, nullptr, 0});
      i = entries_.size() - 1;
    }
    const Entry found = entries_[i];
    for (; i > 0; --i) entries_[i] = entries_[i - 1];
    entries_[0] = found;
    ++entries_[0].seen;
    return entries_[0];
  }
  std::vector<Entry>& entries() { return entries_; }

 private:
  std::vector<Entry> entries_;
};

}  // namespace sonar::cuda
