// Reads a recording ahead on a separate thread, so that a slow disk does not delay the event loop.
#pragma once

#include <deque>
#include <optional>

#include "daemon/server/system/asio.hpp"
#include "protocol/recorded/recorded_message.hpp"

namespace sonar {

/// Only one coroutine may call next(). The reader must outlive the object, and only the object may use the reader after the first
/// next().
class ReadAhead {
 public:
  explicit ReadAhead(recording::RecordingReader& reader) : reader_(reader) {}

  /// Returns the next message; nullopt at the end.
  asio::awaitable<std::optional<recording::RecordedMessage>> next();
  /// Starts again at the first message.
  void rewind();
  /// Returns damage() of the reader; valid after next() has returned nullopt.
  std::optional<Error> damage() const { return reader_.damage(); }
  bool knows_times() const { return reader_.knows_times(); }

 private:
  asio::awaitable<void> read();

  recording::RecordingReader& reader_;
  std::deque<recording::RecordedMessage> ahead_;
  bool ended_ = false, from_the_front_ = false;
  asio::thread_pool thread_{1};
};

}  // namespace sonar
