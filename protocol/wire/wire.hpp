// A message is described once, by a function fields(visit, message). The visitors here write, read, count and find its fields, so
// no protocol has packed structs or casts of buffers, and no byte beyond the span is ever read.
#pragma once

#include <array>
#include <bit>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

namespace sonar::wire {

using Bytes = std::vector<std::byte>;
using BytesView = std::span<const std::byte>;

enum class Endian { little, big };

/// One description serves writing (const message) and reading: `fields(auto& visit, wire::Like<Header> auto& m)`.
template <class M, class Message>
concept Like = std::same_as<std::remove_const_t<M>, Message>;

template <class T>
concept Scalar = (std::is_arithmetic_v<T> && !std::same_as<T, bool> && sizeof(T) <= 8) || std::is_enum_v<T>;

template <std::size_t size>
using UnsignedOf =
    std::conditional_t<size == 1, std::uint8_t,
                       std::conditional_t<size == 2, std::uint16_t, std::conditional_t<size == 4, std::uint32_t, std::uint64_t>>>;

template <Scalar T>
constexpr std::uint64_t bits_from(T value) {
  return std::bit_cast<UnsignedOf<sizeof(T)>>(value);
}
template <Scalar T>
constexpr T from_bits(std::uint64_t bits) {
  return std::bit_cast<T>(static_cast<UnsignedOf<sizeof(T)>>(bits));
}

/// Returns by how many bits a value of `size` bytes is shifted right to get its byte `index` (in wire order).
constexpr unsigned shift_of(std::size_t index, std::size_t size, Endian endian) {
  return static_cast<unsigned>(8 * (endian == Endian::little ? index : size - 1 - index));
}

/// Base of all visitors: it visits arrays and nested messages recursively, and the derived class handles scalars.
template <class Self>
class Visitor {
 public:
  template <class T>
  constexpr void operator()(std::string_view name, T& value) {
    visit(name, value);
  }
  /// `meaning`: a value of an enum that all makes share, with which locate() finds fields.
  template <class T, class Meaning>
  constexpr void operator()(std::string_view name, T& value, Meaning meaning) {
    self().means(meaning);
    visit(name, value);
  }

 private:
  template <class T>
  constexpr void visit(std::string_view name, T& value) {
    if constexpr (Scalar<std::remove_const_t<T>>) {
      self().scalar(name, value);
    } else {
      self().nested(name, value);
    }
  }
  template <class T, std::size_t n>
  constexpr void visit(std::string_view name, std::array<T, n>& value) {
    self().array(name, value);
  }
  template <class T, std::size_t n>
  constexpr void visit(std::string_view name, const std::array<T, n>& value) {
    self().array(name, value);
  }
  constexpr Self& self() { return static_cast<Self&>(*this); }

 protected:
  template <class Meaning>
  constexpr void means(Meaning) {}
  template <class A>
  constexpr void array(std::string_view name, A& values) {
    for (auto& value : values) visit(name, value);
  }
  template <class M>
  constexpr void nested(std::string_view, M& message) {
    fields(self(), message);
  }
};

/// Appends fields to a byte vector, which must outlive the writer.
class Writer : public Visitor<Writer> {
 public:
  explicit Writer(Bytes& out, Endian endian = Endian::little) : out_(out), endian_(endian) {}

 private:
  friend class Visitor<Writer>;
  template <Scalar T>
  void scalar(std::string_view, const T& value) {
    const std::uint64_t bits = bits_from(value);
    for (std::size_t i = 0; i < sizeof(T); ++i)
      out_.push_back(static_cast<std::byte>((bits >> shift_of(i, sizeof(T), endian_)) & 0xFFu));
  }
  Bytes& out_;
  Endian endian_;
};

/// Reads fields from a span. It stores the first failure; fields from there on keep their values.
class Reader : public Visitor<Reader> {
 public:
  struct Failure {
    std::string_view field;
    std::size_t offset = 0, needed = 0, left = 0;
  };

  explicit Reader(BytesView in, Endian endian = Endian::little) : in_(in), endian_(endian) {}

  bool ok() const { return !failed_; }
  const Failure& failure() const { return failure_; }
  std::string failure_text() const {
    return std::string("field '").append(failure_.field) + "' at byte " + std::to_string(failure_.offset) + " needs " +
           std::to_string(failure_.needed) + " bytes, " + std::to_string(failure_.left) + " are left";
  }
  std::size_t position() const { return position_; }
  std::size_t remaining() const { return in_.size() - position_; }

  /// Returns the next `count` bytes; if fewer are left, or after a failure, returns an empty view.
  BytesView block(std::string_view name, std::size_t count) {
    if (!has(name, count)) return {};
    const BytesView taken = in_.subspan(position_, count);
    position_ += count;
    return taken;
  }

 private:
  friend class Visitor<Reader>;
  template <Scalar T>
  void scalar(std::string_view name, T& value) {
    if (!has(name, sizeof(T))) return;
    std::uint64_t bits = 0;
    for (std::size_t i = 0; i < sizeof(T); ++i)
      bits |= std::to_integer<std::uint64_t>(in_[position_ + i]) << shift_of(i, sizeof(T), endian_);
    position_ += sizeof(T);
    value = from_bits<T>(bits);
  }
  bool has(std::string_view name, std::size_t count) {
    if (failed_) return false;
    if (count <= remaining()) return true;
    failed_ = true;
    failure_ = {name, position_, count, remaining()};
    return false;
  }

  BytesView in_;
  Endian endian_;
  std::size_t position_ = 0;
  bool failed_ = false;
  Failure failure_;
};

/// Counts the bytes of the fields.
class Counter : public Visitor<Counter> {
 public:
  std::size_t bytes = 0;

 private:
  friend class Visitor<Counter>;
  template <Scalar T>
  constexpr void scalar(std::string_view, const T&) {
    bytes += sizeof(T);
  }
};

/// The position and type of a field in a little-endian message. `bytes`: an array of bytes, or joined fields.
struct Field {
  enum class Type { integer, number, bytes } type{};
  std::size_t offset = 0, size = 0;
  bool operator==(const Field&) const = default;
};

/// Finds the field with a meaning: the last such field, joined with the adjacent fields before it that have the same meaning. An
/// array of bytes is one field; of another array the first element is the field.
template <class Meaning>
class Locator : public Visitor<Locator<Meaning>> {
 public:
  explicit constexpr Locator(Meaning wanted) : wanted_(wanted) {}
  std::optional<Field> found;

 private:
  friend class Visitor<Locator>;
  constexpr void means(Meaning meaning) { is_wanted_ = meaning == wanted_; }
  constexpr void find(Field::Type type, std::size_t size) {
    if (!std::exchange(is_wanted_, false)) return;
    const Field before = found.value_or(Field{});  // GCC 14 gives a false warning about *found here
    if (found && before.offset + before.size == offset_)
      found = Field{Field::Type::bytes, before.offset, before.size + size};
    else
      found = Field{type, offset_, size};
  }
  template <Scalar T>
  constexpr void scalar(std::string_view, const T&) {
    find(std::is_floating_point_v<T> ? Field::Type::number : Field::Type::integer, sizeof(T));
    offset_ += sizeof(T);
  }
  template <class A>
  constexpr void array(std::string_view name, A& values) {
    if constexpr (sizeof(typename std::remove_const_t<A>::value_type) == 1) find(Field::Type::bytes, values.size());
    Visitor<Locator>::array(name, values);
  }
  Meaning wanted_;
  bool is_wanted_ = false;  // true: the next field has the meaning
  std::size_t offset_ = 0;
};

/// Returns the size in bytes of an encoded message, which is a constant.
template <class M>
constexpr std::size_t wire_size() {
  Counter counter;
  const M message{};
  fields(counter, message);
  return counter.bytes;
}

/// Finds the field with a meaning (Locator) in bytes in which the message begins at `at`. Returns nullopt if no field has the
/// meaning, or if `bytes` are not empty and end before the end of the field.
template <class M, class Meaning>
constexpr std::optional<Field> locate(Meaning meaning, BytesView bytes = {}, std::size_t at = 0) {
  Locator<Meaning> locator(meaning);
  const M layout{};
  fields(locator, layout);
  std::optional<Field> found = locator.found;
  if (found) found->offset += at;
  return found && !bytes.empty() && found->offset + found->size > bytes.size() ? std::nullopt : found;
}

template <class M>
void append(Bytes& out, const M& message, Endian endian = Endian::little) {
  Writer writer(out, endian);
  fields(writer, message);
}
template <class M>
Bytes bytes_of(const M& message, Endian endian = Endian::little) {
  Bytes out;
  out.reserve(wire_size<M>());
  append(out, message, endian);
  return out;
}

}  // namespace sonar::wire
