#include "daemon/emulator/faults/alter_message.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <functional>
#include <limits>

#include "core/base/enum_names.hpp"

namespace sonar {
namespace {

using protocol::Bytes;
using protocol::Field;
using protocol::FieldName;
using protocol::Part;
using protocol::Region;
using protocol::Vendor;

constexpr std::size_t most_message_bytes = 16u << 20;

// Fields with a fixed offset are little-endian in every make that has them.
std::uint64_t read_integer(const Bytes& bytes, const Field& field) {
  std::uint64_t value = 0;
  for (std::size_t i = 0; i < std::min<std::size_t>(field.size, 8); ++i)
    value |= std::to_integer<std::uint64_t>(bytes[field.offset + i]) << (8 * i);
  return value;
}
void write_integer(Bytes& bytes, std::size_t offset, std::size_t size, std::uint64_t value) {
  for (std::size_t i = 0; i < std::min<std::size_t>(size, 8); ++i) bytes[offset + i] = static_cast<std::byte>(value >> (8 * i));
}
void write_number(Bytes& bytes, const Field& field, double value) {
  const std::uint64_t bits =
      field.size == 4 ? std::bit_cast<std::uint32_t>(static_cast<float>(value)) : std::bit_cast<std::uint64_t>(value);
  write_integer(bytes, field.offset, field.size, bits);
}

double number_of_word(const std::string& word) {
  if (word == "nan") return std::numeric_limits<double>::quiet_NaN();
  if (word == "inf") return std::numeric_limits<double>::infinity();
  if (word == "-inf") return -std::numeric_limits<double>::infinity();
  if (word == "huge") return 1e308;
  if (word == "absolute-zero") return -273.16;
  if (word == "negative") return -1;
  return 0;
}

std::optional<Field> field_of(const Fault& fault, const Vendor& vendor, Part part, const Bytes& bytes) {
  FieldName name = *fault.kind->field;
  if (const auto other = enum_from<FieldName>(fault.word("field"), protocol::field_names)) name = *other;
  return vendor.field(part, name, bytes);
}

void write_field(const Fault& fault, Bytes& bytes, const Field& field) {
  if (field.type == Field::Type::number)
    write_number(bytes, field, fault.words.contains("value") ? number_of_word(fault.word("value")) : fault.number("value"));
  else  // each word of the field gets the value
    for (std::size_t at = 0; at < field.size; at += 4)
      write_integer(bytes, field.offset + at, std::min<std::size_t>(4, field.size - at),
                    static_cast<std::uint64_t>(fault.number("value")));
}

std::function<std::int64_t(std::int64_t)> always(std::int64_t value) {
  return [value](std::int64_t) { return value; };
}

void add_to(Bytes& bytes, const std::optional<Field>& field, std::int64_t by) {
  if (field) write_integer(bytes, field->offset, field->size, read_integer(bytes, *field) + static_cast<std::uint64_t>(by));
}

/// Makes `count` bytes of the kind `fill`.
Bytes filling(const std::string& fill, std::size_t count, const Bytes& message, const FaultDraws& draws) {
  constexpr std::string_view text = "sonar: debug 0x00 ok\r\n";
  Bytes out(count, fill == "FF" ? std::byte{0xFF} : std::byte{0});
  for (std::size_t i = 0; i < count; ++i) {
    if (fill == "random") out[i] = static_cast<std::byte>(draws.bits(static_cast<std::uint32_t>(i)));
    if (fill == "S") out[i] = std::byte{0x53};
    if (fill == "SO" || fill == "magic")
      out[i] = message.empty() ? std::byte{0} : message[i % std::min<std::size_t>(2, message.size())];
    if (fill == "ascii") out[i] = static_cast<std::byte>(text[i % text.size()]);
  }
  return out;
}

void put_before(Bytes& message, const Bytes& front) { message.insert(message.begin(), front.begin(), front.end()); }

std::size_t at_fraction(const Fault& fault, const Bytes& bytes) {
  return static_cast<std::size_t>(std::llround(fault.number("fraction") * static_cast<double>(bytes.size())));
}

/// Inserts a message with a valid header of this make, another type and random contents.
Touch insert_message(const Fault& fault, const MessageContext& c, Bytes& bytes) {
  const auto header = c.vendor.region(Region::header, bytes);
  const auto type = c.vendor.field(Part::ping, FieldName::message_type, bytes);
  const auto size = c.vendor.field(Part::ping, FieldName::payload_size, bytes);
  if (!header || !type || !size) return {false};
  const auto count = static_cast<std::size_t>(fault.number("bytes"));
  const auto begin = bytes.begin() + static_cast<std::ptrdiff_t>(header->first);
  Bytes front(begin, begin + static_cast<std::ptrdiff_t>(header->second));
  write_integer(front, type->offset, type->size, static_cast<std::uint64_t>(fault.number("type")));
  write_integer(front, size->offset, size->size, count);
  const Bytes body = filling("random", count, bytes, c.draws);
  front.insert(front.end(), body.begin(), body.end());
  put_before(bytes, front);
  return {};
}

/// Removes the last row; with `declared`, all length fields are changed accordingly.
Touch cut_row(const Fault& fault, const MessageContext& c, Bytes& bytes) {
  const auto image = c.vendor.field(Part::ping, FieldName::image_size, bytes);
  const auto rows = c.vendor.field(Part::ping, FieldName::rows, bytes);
  if (!image || !rows || read_integer(bytes, *rows) == 0) return {false};
  const std::uint64_t row = read_integer(bytes, *image) / read_integer(bytes, *rows);
  if (row == 0 || row >= bytes.size()) return {false};
  bytes.resize(bytes.size() - row);
  if (fault.word("lengths") != "declared") return {true, bytes.size()};
  for (const FieldName name : {FieldName::image_size, FieldName::message_size, FieldName::payload_size})
    add_to(bytes, c.vendor.field(Part::ping, name, bytes), -static_cast<std::int64_t>(row));
  add_to(bytes, rows, -1);
  return {};
}

Touch renumber(const Fault& fault, const MessageContext& c, Bytes& bytes) {
  const std::int64_t since = std::int64_t{c.number} - c.first_number;
  const auto other = [&](std::int64_t number) {
    // D07: numbers approach the overflow of 32 bits. D09: numbers jump. D10: the first number repeats. D08: numbers begin again
    // at 0.
    const std::string_view code = fault.kind->code;
    if (code == "D07") return (std::int64_t{1} << 32) - static_cast<std::int64_t>(fault.number("before")) + since;
    if (code == "D09") return number + static_cast<std::int64_t>(fault.number("by"));
    return code == "D10" ? number - since : since;
  };
  const auto field = c.vendor.field(Part::ping, FieldName::ping_id, bytes);
  if (!field) return {c.vendor.change_integer(Part::ping, FieldName::ping_id, other, bytes)};
  write_integer(bytes, field->offset, field->size,
                static_cast<std::uint64_t>(other(static_cast<std::int64_t>(read_integer(bytes, *field)))));
  return {};
}

Touch flip(const Fault& fault, const MessageContext& c, Bytes& bytes) {
  const auto region = c.vendor.region(*enum_from<Region>(fault.word("region"), protocol::region_names), bytes);
  if (!region || region->second == 0) return {false};
  for (std::uint32_t i = 0; i < static_cast<std::uint32_t>(fault.number("bits")); ++i) {
    const std::size_t bit = c.draws.below(8 * region->second, i);
    bytes[region->first + bit / 8] ^= std::byte{1} << (bit % 8);
  }
  return {};
}

/// Changes the bearings, which are 16-bit numbers.
Touch change_bearings(const Fault& fault, const MessageContext& c, Bytes& bytes) {
  const auto region = c.vendor.region(Region::bearings, bytes);
  if (!region || region->second < 2) return {false};
  const std::size_t count = region->second / 2;
  const auto at = [&](std::size_t i) { return Field{Field::Type::integer, region->first + 2 * i, 2}; };
  const std::string& how = fault.word("how");
  std::vector<std::uint64_t> values(count);
  for (std::size_t i = 0; i < count; ++i) values[i] = read_integer(bytes, at(i));
  if (how == "zero") std::fill(values.begin(), values.end(), 0);
  if (how == "reversed") std::reverse(values.begin(), values.end());
  if (how == "shuffled")
    for (std::size_t i = count - 1; i > 0; --i) std::swap(values[i], values[c.draws.below(i + 1, static_cast<std::uint32_t>(i))]);
  if (how == "changing")
    for (std::size_t i = 0; i < count; ++i) values[i] += c.draws.below(200, 0);
  for (std::size_t i = 0; i < count; ++i) write_integer(bytes, at(i).offset, 2, values[i]);
  return {};
}

Touch slice(MessageEdit& m, std::size_t every, double pause_s) {
  for (std::size_t at = every; at < m.bytes.size(); at += every)
    m.pauses.push_back({at, std::chrono::nanoseconds(std::llround(pause_s * 1e9))});
  return {true, std::min(every, m.bytes.size())};
}

/// Divides the message into pieces of about 20 ms at the rate of the link.
Touch thin(const Fault& fault, MessageEdit& m) {
  const double bytes_per_s = fault.number("mbit-per-s") * 125000;
  const auto piece = std::clamp<std::size_t>(static_cast<std::size_t>(bytes_per_s * 0.02), 64, 65536);
  return slice(m, piece, static_cast<double>(piece) / bytes_per_s);
}

Touch end_inside(const Fault& fault, MessageEdit& m) {
  m.bytes.resize(at_fraction(fault, m.bytes));
  m.end = fault.word("how") == "reset" ? Outbox::Shape::End::reset : Outbox::Shape::End::fin;
  std::erase_if(m.pauses, [&](const Outbox::Shape::Pause& p) { return p.before > m.bytes.size(); });
  return {true, m.bytes.size()};
}

/// Replaces the end of the image with that of the previous message, as if the device had sent a buffer before filling it.
Touch splice(const Fault& fault, const MessageContext& c, Bytes& bytes) {
  const auto image = c.vendor.region(Region::image, bytes);
  if (!image || c.before == nullptr || c.before->size() != bytes.size()) return {false};
  const auto from = static_cast<std::ptrdiff_t>(
      image->first + static_cast<std::size_t>(fault.number("fraction") * static_cast<double>(image->second)));
  const auto end = static_cast<std::ptrdiff_t>(image->first + image->second);
  std::copy(c.before->begin() + from, c.before->begin() + end, bytes.begin() + from);
  return {};
}

/// Makes a valid, empty message: the header states a payload of 0 bytes.
Touch only_header(const MessageContext& c, Bytes& bytes) {
  const auto header = c.vendor.region(Region::header, bytes);
  const auto size = c.vendor.field(Part::ping, FieldName::payload_size, bytes);
  if (!header || !size) return {false};
  write_integer(bytes, size->offset, size->size, 0);
  bytes.resize(header->first + header->second);
  return {};
}

Touch set_field(const Fault& fault, const MessageContext& c, Bytes& bytes) {
  const auto field = field_of(fault, c.vendor, Part::ping, bytes);
  if (!field) return {false};
  write_field(fault, bytes, *field);
  return {};
}

text::Ipv4 address_from(const std::string& word) {
  if (word == "loopback") return {127, 0, 0, 1};
  if (word == "link-local") return {169, 254, 77, 77};
  return {};
}

void write_address(Bytes& bytes, const std::optional<Field>& field, const text::Ipv4& address) {
  if (!field || field->size != 4) return;
  for (std::size_t i = 0; i < 4; ++i) bytes[field->offset + i] = static_cast<std::byte>(address[i]);
}

/// Makes the status of a second device, with another id, hardware address and, if requested, network address. With the address
/// `foreign` only the network address differs.
Bytes second_device(const Fault& fault, const Vendor& vendor, Bytes bytes) {
  const auto of = [&](FieldName name) { return vendor.field(Part::beacon, name, bytes); };
  const std::string& address = fault.word("address");
  if (address == "foreign") {
    write_address(bytes, of(FieldName::address), address_from("link-local"));
    return bytes;
  }
  if (const auto id = of(FieldName::device_id))
    add_to(bytes, id, 1);
  else
    vendor.change_integer(
        Part::beacon, FieldName::device_id, [](auto n) { return n + 1; }, bytes);
  add_to(bytes, of(FieldName::source_id), 1);
  if (const auto mac = of(FieldName::mac)) bytes[mac->offset + mac->size - 1] ^= std::byte{1};
  if (const auto field = of(FieldName::address); field && address == "next") bytes[field->offset + 3] ^= std::byte{1};
  return bytes;
}

/// Changes the times and pieces in which the bytes are written.
Touch alter_pace(const Fault& fault, MessageEdit& m) {
  const Bytes& bytes = m.bytes;
  using E = FaultEffect;
  switch (fault.kind->effect) {
    case E::slices:
      return slice(m, static_cast<std::size_t>(fault.number("bytes")), 0);
    case E::split_header: {
      const auto at = std::min(static_cast<std::size_t>(fault.number("offset")), bytes.size());
      m.pauses.push_back({at, std::chrono::nanoseconds(std::llround(fault.number("ms") * 1e6))});
      return {true, at};
    }
    case E::pause: {
      const std::size_t at = at_fraction(fault, bytes);
      m.pauses.push_back({at, std::chrono::nanoseconds(std::llround(fault.number("seconds") * 1e9))});
      return {true, at};
    }
    case E::thin_link:
      return thin(fault, m);
    case E::end:
      return end_inside(fault, m);
    default:
      return {false};
  }
}

Touch alter_content(const Fault& fault, const MessageContext& c, MessageEdit& m) {
  Bytes& bytes = m.bytes;
  using E = FaultEffect;
  switch (fault.kind->effect) {
    case E::insert:
      put_before(bytes, filling(fault.word("fill"), static_cast<std::size_t>(fault.number("bytes")), bytes, c.draws));
      return {};
    case E::false_sync: {
      Bytes front = filling(fault.word("fill"), static_cast<std::size_t>(fault.number("bytes")), bytes, c.draws);
      // Inserts the two bytes of the magic number without a message after them.
      std::copy_n(bytes.begin(), std::min<std::size_t>(2, bytes.size()), front.begin());
      put_before(bytes, front);
      return {};
    }
    case E::insert_message:
      return insert_message(fault, c, bytes);
    case E::set_field:
      return set_field(fault, c, bytes);
    case E::add_to_field: {
      const auto field = field_of(fault, c.vendor, Part::ping, bytes);
      const auto by = static_cast<std::int64_t>(fault.number("add"));
      if (!field)
        return {c.vendor.change_integer(
            Part::ping, *fault.kind->field, [by](auto n) { return n + by; }, bytes)};
      add_to(bytes, field, by);
      return {};
    }
    case E::cut_row:
      return cut_row(fault, c, bytes);
    case E::duplicate: {
      const Bytes once = bytes;
      if (2 * once.size() > most_message_bytes) return {false};
      bytes.insert(bytes.end(), once.begin(), once.end());
      return {true, once.size()};
    }
    case E::drop:
      m.dropped = true;
      return {true, 0};
    case E::flip:
      return flip(fault, c, bytes);
    case E::splice:
      return splice(fault, c, bytes);
    case E::header_only:
      return only_header(c, bytes);
    case E::join_late:
      bytes.erase(bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(at_fraction(fault, bytes)));
      return {true, 0};
    case E::bearings:
      return change_bearings(fault, c, bytes);
    case E::renumber:
      return renumber(fault, c, bytes);
    default:
      return alter_pace(fault, m);
  }
}

}  // namespace

Touch alter_message(const Fault& fault, const MessageContext& c, MessageEdit& m) {
  using E = FaultEffect;
  const E effect = fault.kind->effect;
  // These effects change fields, so checksums are corrected. Other effects damage the message as a link would.
  const bool of_fields = effect == E::set_field || effect == E::add_to_field || effect == E::renumber;
  const Bytes before = of_fields ? m.bytes : Bytes{};
  const Touch touch = alter_content(fault, c, m);
  if (of_fields && touch.acted) c.vendor.reseal(before, m.bytes);
  return touch;
}

/// Changes the first datagram, removes all datagrams, or adds one.
void alter_beacons(const Fault& fault, const Vendor& vendor, const FaultDraws& draws, std::vector<Bytes>& datagrams) {
  if (datagrams.empty()) return;
  Bytes& bytes = datagrams.front();
  using E = FaultEffect;
  switch (fault.kind->effect) {
    case E::no_beacon:
      datagrams.clear();
      return;
    case E::beacon_size:
      bytes.resize(static_cast<std::size_t>(std::max(0.0, static_cast<double>(bytes.size()) + fault.number("add"))));
      return;
    case E::heat:
      if (const auto field = field_of(fault, vendor, Part::beacon, bytes))
        write_integer(bytes, field->offset, field->size,
                      read_integer(bytes, *field) | static_cast<std::uint64_t>(fault.number("status")));
      else
        vendor.change_integer(Part::beacon, *fault.kind->field, always(static_cast<std::int64_t>(fault.number("status"))), bytes);
      return;
    case E::beacon_field: {
      const auto field = field_of(fault, vendor, Part::beacon, bytes);
      if (!field) return;
      if (fault.numbers.contains("value")) return write_field(fault, bytes, *field);
      const std::uint64_t cleared = read_integer(bytes, *field) & ~static_cast<std::uint64_t>(fault.number("clear-bits"));
      return write_integer(bytes, field->offset, field->size, cleared | static_cast<std::uint64_t>(fault.number("set-bits")));
    }
    case E::beacon_address: {
      const text::Ipv4 address = address_from(fault.word("address"));
      if (const auto field = field_of(fault, vendor, Part::beacon, bytes)) return write_address(bytes, field, address);
      vendor.change_integer(Part::beacon, *fault.kind->field, always(text::number_from_ipv4(address)), bytes);
      return;
    }
    case E::second_beacon:
      datagrams.push_back(second_device(fault, vendor, bytes));
      return;
    case E::foreign_datagrams:
      datagrams.push_back(filling("random", static_cast<std::size_t>(fault.number("bytes")), bytes, draws));
      return;
    default:
      return;
  }
}

}  // namespace sonar
