#include "daemon/commands/replay/played_pings.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace sonar {
namespace {

constexpr double same_direction_rad = 1e-4;  // the smallest step of a scanning head is about 10 times as large

double between(double a_rad, double b_rad) { return std::abs(std::remainder(a_rad - b_rad, 2 * std::numbers::pi)); }

}  // namespace

Result<void> PlayedPings::open(const std::string& file) {
  rewind();
  if (!ahead_) return failure(ErrorKind::bad_data, file + " holds no ping");
  if (!ahead_->part.head_rad) return {};
  for (std::size_t bytes = 0; ahead_; ahead_ = read()) {
    bytes += ahead_->bytes.size();
    if (bytes > most_scan_bytes)
      return failure(ErrorKind::bad_data, file + " holds more than " + std::to_string(most_scan_bytes >> 20) +
                                              " MB of scan lines: replay a shorter recording");
    const double head_rad = ahead_->part.head_rad.value_or(0);
    lines_.push_back({head_rad, {ahead_->at, {{ahead_->part.port, std::move(ahead_->bytes)}}}});
  }
  return {};
}

void PlayedPings::rewind() {
  reader_.rewind();
  splitter_ = nullptr;
  if (codec_.framing != nullptr)
    splitter_ = std::make_unique<recording::MessageSplitter>(recording::Origin::device, *codec_.framing);
  ahead_ = read();
}

/// Returns the next message that holds a ping or a part of one. A recorder may join or divide the packets of the sonar.
std::optional<PlayedPings::Part> PlayedPings::read() {
  while (true) {
    auto message = splitter_ ? splitter_->next() : std::nullopt;
    if (!message) {
      message = reader_.next();
      if (!message) return std::nullopt;
      if (message->from != recording::Origin::device) continue;
      if (splitter_ && message->by == recording::Carrier::stream) {
        splitter_->append(message->at, message->bytes);
        continue;
      }
    }
    if (const auto part = codec_.ping_part(message->bytes)) return Part{message->at, *part, std::move(message->bytes)};
  }
}

/// Reads the messages of a ping and returns the one with the most content. The messages of a ping come in order of content,
/// either growing or shrinking; a message that breaks the order begins the next ping.
recording::Bytes PlayedPings::take_richest() {
  recording::Bytes richest = std::move(ahead_->bytes);
  ahead_ = read();
  if (!ahead_ || codec_.is_richer(ahead_->bytes, richest)) {
    for (; ahead_ && codec_.is_richer(ahead_->bytes, richest); ahead_ = read()) richest = std::move(ahead_->bytes);
    return richest;
  }
  recording::Bytes last = richest;
  for (; ahead_ && codec_.is_richer(last, ahead_->bytes); ahead_ = read()) last = std::move(ahead_->bytes);
  return richest;
}

std::optional<PlayedPing> PlayedPings::next() {
  if (!ahead_) return std::nullopt;
  PlayedPing ping{ahead_->at, {}};
  if (codec_.is_richer != nullptr) {
    const std::uint16_t port = ahead_->part.port;
    ping.parts.emplace_back(port, take_richest());
    return ping;
  }
  const auto is_new_port = [&ping](std::uint16_t port) {
    return std::none_of(ping.parts.begin(), ping.parts.end(), [port](const auto& part) { return part.first == port; });
  };
  for (; ahead_ && is_new_port(ahead_->part.port); ahead_ = read())
    ping.parts.emplace_back(ahead_->part.port, std::move(ahead_->bytes));
  return ping;
}

const PlayedPing& PlayedPings::nearest(double head_rad) {
  double least = 4;
  for (const Line& line : lines_) least = std::min(least, between(line.head_rad, head_rad));
  const auto is_nearest = [&](const Line& line) { return between(line.head_rad, head_rad) <= least + same_direction_rad; };
  auto found = std::find_if(lines_.begin() + static_cast<std::ptrdiff_t>(after_), lines_.end(), is_nearest);
  if (found == lines_.end()) found = std::find_if(lines_.begin(), lines_.end(), is_nearest);
  after_ = static_cast<std::size_t>(found - lines_.begin()) + 1;
  return found->ping;
}

}  // namespace sonar
