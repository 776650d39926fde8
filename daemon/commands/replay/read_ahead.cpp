#include "daemon/commands/replay/read_ahead.hpp"

#include <chrono>
#include <utility>

namespace sonar {
namespace {

using Steady = std::chrono::steady_clock;

// Messages are read in batches, so that fast replays seldom change threads. Batches are short, so that a slow disk delays only
// messages that are not read yet.
constexpr std::size_t most_messages = 256, most_bytes = std::size_t{4} << 20;
constexpr std::chrono::milliseconds longest{5};

}  // namespace

void ReadAhead::rewind() {
  ahead_.clear();
  ended_ = false;
  from_the_front_ = true;
}

asio::awaitable<std::optional<recording::RecordedMessage>> ReadAhead::next() {
  if (ahead_.empty() && !ended_) co_await asio::co_spawn(thread_, read(), asio::use_awaitable);
  if (ahead_.empty()) co_return std::nullopt;
  recording::RecordedMessage message = std::move(ahead_.front());
  ahead_.pop_front();
  co_return message;
}

/// Reads a batch in `thread_`, while next() waits.
asio::awaitable<void> ReadAhead::read() {
  if (std::exchange(from_the_front_, false)) reader_.rewind();
  const auto until = Steady::now() + longest;
  std::size_t bytes = 0;
  do {
    auto message = reader_.next();
    ended_ = !message;
    if (ended_) break;
    bytes += message->bytes.size();
    ahead_.push_back(*std::move(message));
  } while (ahead_.size() < most_messages && bytes < most_bytes && Steady::now() < until);
  co_return;
}

}  // namespace sonar
