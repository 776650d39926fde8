// Reads a fuzzer's bytes as a script of small numbers and pieces; after the end every number is zero. Targets report failures
// with `require`.
#pragma once

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <span>

namespace sonar::fuzz {

inline void require(bool statement) {
  if (!statement) std::abort();
}

class Script {
 public:
  Script(const std::uint8_t* data, std::size_t size) : rest_(data, size) {}

  bool ended() const { return rest_.empty(); }
  std::uint8_t byte() {
    if (rest_.empty()) return 0;
    const std::uint8_t first = rest_.front();
    rest_ = rest_.subspan(1);
    return first;
  }
  std::uint32_t word() {  // little-endian
    std::uint32_t value = 0;
    for (int i = 0; i < 4; ++i) value |= std::uint32_t{byte()} << (8 * i);
    return value;
  }
  float real() { return std::bit_cast<float>(word()); }
  std::span<const std::uint8_t> piece(std::size_t longest) {
    const auto taken = rest_.first(std::min(longest, rest_.size()));
    rest_ = rest_.subspan(taken.size());
    return taken;
  }

 private:
  std::span<const std::uint8_t> rest_;
};

}  // namespace sonar::fuzz
