// SHA-256 of a byte stream. With `--digest`, equal digests mean that two runs sent the same bytes.
// Source: FIPS 180-4, sections 4.1.2, 5 and 6.2; its examples are the test.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

namespace sonar {

class Sha256 {
 public:
  void add(std::span<const std::byte> bytes);
  /// Returns the lower-case hexadecimal digest of all bytes so far; more may follow.
  std::string hex() const;
  std::uint64_t size() const { return size_; }

 private:
  void block(const std::byte* bytes);
  std::array<std::uint32_t, 8> state_{0x6a09e667, 0xbb67ae85, 0x3c6ef372, 0xa54ff53a,
                                      0x510e527f, 0x9b05688c, 0x1f83d9ab, 0x5be0cd19};
  std::array<std::byte, 64> pending_{};
  std::uint64_t size_ = 0;
};
std::string sha256_of(std::string_view text);

}  // namespace sonar
