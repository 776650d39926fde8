#include "protocol/ping/messages.hpp"

#include <algorithm>
#include <utility>

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

// The lengths are read from `before`, because a fault may have changed them. Only frames that differ get a new sum, so that a sum
// that a fault made wrong is not corrected.
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

void Framer::append(BytesView received) {
  last_size_ = 0;
  if (begin_ > buffer_.size() / 2) {  // erases rarely, so that the work stays proportional to the bytes
    const auto searched = static_cast<std::ptrdiff_t>(begin_);
    buffer_.erase(buffer_.begin(), buffer_.begin() + searched);
    sums_.erase(sums_.begin(), sums_.begin() + searched);
    erased_ += std::exchange(begin_, 0);
  }
  buffer_.insert(buffer_.end(), received.begin(), received.end());
  for (const std::byte b : received) sums_.push_back(static_cast<std::uint16_t>(sums_.back() + std::to_integer<unsigned>(b)));
}

void Framer::drop_rest() {
  erased_ += buffer_.size();
  buffer_.clear();
  sums_.assign(1, 0);
  begin_ = last_size_ = 0;
}

std::optional<Frame> Framer::next() {
  last_size_ = 0;
  for (; begin_ < buffer_.size(); ++begin_) {
    const BytesView left = BytesView(buffer_).subspan(begin_);
    if (left[0] != std::byte{'B'} || (left.size() > 1 && left[1] != std::byte{'R'})) continue;  // a last 'B' may begin a frame
    Frame frame;
    if (left.size() >= header_size) {
      wire::Reader reader(left);
      fields(reader, frame.header);
      if (frame.header.length > longest_) continue;
    }
    const std::size_t summed = header_size + frame.header.length;
    if (left.size() < summed + sum_size) {
      if (!all_is_there_) return std::nullopt;
      continue;
    }
    std::uint16_t stated = 0;
    wire::Reader rest(left.subspan(summed));
    rest("checksum", stated);
    // The sum of the frame is the difference of two sums from the start of the buffer, so no byte is added twice.
    frame.sum_is_right = stated == static_cast<std::uint16_t>(sums_[begin_ + summed] - sums_[begin_]);
    if (frame.sum_is_right) {
      const BytesView payload = left.subspan(header_size, frame.header.length);
      frame.payload.assign(payload.begin(), payload.end());
      last_size_ = summed + sum_size;
    }
    // After a wrong sum the length may be wrong too, so the search continues at the next byte.
    begin_ += std::max<std::size_t>(last_size_, 1);
    return frame;
  }
  return std::nullopt;
}

std::optional<Frame> whole_frame(BytesView message) {
  Framer framer(longest_payload, true);
  framer.append(message);
  auto frame = framer.next();
  return frame && frame->sum_is_right ? std::move(frame) : std::nullopt;
}

// A datagram that only resembles the protocol must not transfer the dialogue from its host to another.
bool holds_frame(BytesView datagram) {
  Framer framer(longest_request, true);
  framer.append(datagram);
  while (const auto frame = framer.next())
    if (frame->sum_is_right && !is_of_device(frame->header.id)) return true;
  return false;
}

}  // namespace sonar::ping
