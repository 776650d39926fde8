#include "protocol/ping/messages.hpp"

#include <algorithm>

namespace sonar::ping {
namespace {

std::uint16_t sum_of(BytesView bytes) {
  std::uint32_t sum = 0;
  for (const std::byte b : bytes) sum += std::to_integer<std::uint32_t>(b);
  return static_cast<std::uint16_t>(sum);
}

}  // namespace

Bytes framed(Id id, std::uint8_t source, BytesView payload) {
  Bytes out;
  out.reserve(header_size + payload.size() + sum_size);
  wire::append(out, Header{.length = static_cast<std::uint16_t>(payload.size()), .id = id, .source = source});
  out.insert(out.end(), payload.begin(), payload.end());
  const std::uint16_t sum = sum_of(out);
  wire::Writer write(out);
  write("checksum", sum);
  return out;
}

void reseal(BytesView before, Bytes& frames) {
  for (BytesView left = before; left.size() >= header_size + sum_size;) {
    const std::size_t at = before.size() - left.size();
    Header header;
    wire::Reader reader(left);
    fields(reader, header);
    const std::size_t summed = header_size + header.length;
    if (header.start != Header{}.start || left.size() < summed + sum_size) return;
    const BytesView now = BytesView(frames).subspan(at, summed);
    if (const std::uint16_t sum = sum_of(now); !std::equal(now.begin(), now.end(), left.begin())) {
      frames[at + summed] = static_cast<std::byte>(sum & 0xFF);
      frames[at + summed + 1] = static_cast<std::byte>(sum >> 8);
    }
    left = left.subspan(summed + sum_size);
  }
}

Bytes ack(Id id, std::uint8_t source) {
  Bytes payload;
  wire::Writer write(payload);
  write("acked_id", id);
  return framed(Id::ack, source, payload);
}

Bytes nack(Id id, std::uint8_t source, std::string_view why) {
  Bytes payload;
  wire::Writer write(payload);
  write("nacked_id", id);
  for (const char c : why) payload.push_back(static_cast<std::byte>(c));
  return framed(Id::nack, source, payload);
}

std::optional<Frame> Framer::next() {
  std::size_t begin = 0;
  std::optional<Frame> found;
  while (!found && begin < buffer_.size()) {
    const BytesView left = BytesView(buffer_).subspan(begin);
    if (left[0] != std::byte{'B'} || (left.size() > 1 && left[1] != std::byte{'R'})) {
      ++begin;
      continue;
    }
    if (left.size() < header_size) {
      if (!all_is_there_) break;
      ++begin;
      continue;
    }
    Frame frame;
    wire::Reader reader(left);
    fields(reader, frame.header);
    if (frame.header.length > longest_) {
      ++begin;
      continue;
    }
    const std::size_t summed = header_size + frame.header.length;
    if (left.size() < summed + sum_size) {
      if (!all_is_there_) break;
      ++begin;
      continue;
    }
    const BytesView payload = reader.block("payload", frame.header.length);
    frame.payload.assign(payload.begin(), payload.end());
    std::uint16_t sum = 0;
    reader("checksum", sum);
    frame.sum_is_right = sum == sum_of(left.first(summed));
    begin += frame.sum_is_right ? summed + sum_size : 1;
    found = std::move(frame);
  }
  buffer_.erase(buffer_.begin(), buffer_.begin() + static_cast<std::ptrdiff_t>(begin));
  return found;
}

bool holds_frame(BytesView datagram) {
  Framer framer(longest_request, true);
  framer.append(datagram);
  while (const auto frame = framer.next())
    if (frame->sum_is_right && !is_of_device(frame->header.id)) return true;
  return false;
}

}  // namespace sonar::ping
