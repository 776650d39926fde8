// Reads and writes little-endian fields of byte buffers, for frames, pings and recordings.
// Bytes from outside are always checked: after the first failure, a Reader returns only zeros, and ok() is false.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <memory>
#include <string>
#include <type_traits>
#include <vector>

namespace sonar::bvt {

using Bytes = std::vector<std::uint8_t>;

/// A view of bytes whose owner is another object.
struct BytesView {
  const std::uint8_t* data = nullptr;
  std::size_t size = 0;
  BytesView() = default;
  BytesView(const std::uint8_t* d, std::size_t n) : data(d), size(n) {}
  BytesView(const Bytes& b) : data(b.data()), size(b.size()) {}  // implicit, as with any view
};

namespace detail {
template <std::size_t n>
struct UnsignedOf;
template <>
struct UnsignedOf<1> {
  using type = std::uint8_t;
};
template <>
struct UnsignedOf<2> {
  using type = std::uint16_t;
};
template <>
struct UnsignedOf<4> {
  using type = std::uint32_t;
};
template <>
struct UnsignedOf<8> {
  using type = std::uint64_t;
};
}  // namespace detail

/// Appends an integer or an IEEE float.
template <class T>
void put(Bytes& out, T value) {
  static_assert(std::is_arithmetic_v<T>);
  typename detail::UnsignedOf<sizeof(T)>::type bits;
  std::memcpy(&bits, &value, sizeof bits);
  for (std::size_t i = 0; i < sizeof bits; ++i) out.push_back(static_cast<std::uint8_t>(bits >> (8 * i)));
}

/// Appends a 16-bit length and that number of bytes of UTF-8; longer texts are truncated.
inline void put_text(Bytes& out, const std::string& text) {
  const std::size_t length = text.size() < 65535 ? text.size() : 65535;
  put(out, static_cast<std::uint16_t>(length));
  out.insert(out.end(), text.begin(), text.begin() + static_cast<std::ptrdiff_t>(length));
}

class Reader {
 public:
  explicit Reader(BytesView bytes) : bytes_(bytes) {}

  template <class T>
  T read() {
    static_assert(std::is_arithmetic_v<T>);
    using Bits = typename detail::UnsignedOf<sizeof(T)>::type;
    Bits bits = 0;
    const BytesView field = block(sizeof(T));
    for (std::size_t i = 0; i < field.size; ++i)
      bits = static_cast<Bits>(bits | static_cast<Bits>(Bits{field.data[i]} << (8 * i)));
    T value;
    std::memcpy(&value, &bits, sizeof value);
    return value;
  }
  std::string text() {
    const BytesView field = block(read<std::uint16_t>());
    return std::string(field.data, field.data + field.size);
  }
  /// Returns the next `size` bytes unchanged; empty if fewer are left.
  BytesView block(std::size_t size) {
    if (size > left()) ok_ = false;
    if (!ok_) return {};
    at_ += size;
    return {bytes_.data + (at_ - size), size};
  }
  BytesView rest() { return block(left()); }

  void fail() { ok_ = false; }
  std::size_t left() const { return bytes_.size - at_; }
  bool ok() const { return ok_; }

 private:
  BytesView bytes_;
  std::size_t at_ = 0;
  bool ok_ = true;
};

// A pointer to a C stream that closes the stream when it is destroyed.

struct CloseFile {
  void operator()(std::FILE* file) const { std::fclose(file); }
};
using File = std::unique_ptr<std::FILE, CloseFile>;

}  // namespace sonar::bvt
