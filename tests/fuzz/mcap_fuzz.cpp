// Fuzzes MCAP files: every message is read, and replay paces the sonar's messages by their times.
#include "daemon/commands/replay/replay_pace.hpp"
#include "protocol/recording/mcap/mcap_session.hpp"
#include "tests/fuzz/recording_fuzz.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace sonar;
  const recording::Bytes bytes = fuzz::bytes_from(data, size);
  if (auto reader = recording::mcap::Reader::open(recording::source_from("input", bytes)))
    while (const auto message = reader->next())
      if (!reader->channels().contains(message->channel) || message->data.size() > size) std::abort();
  auto reader = recording::read_mcap(recording::source_from("input", bytes));
  if (!reader) return 0;
  const auto pace =
      std::make_unique<ReplayPace>(1, std::nullopt);  // not on the stack, because GCC 12 would report it as uninitialized
  ReplayPace::Steady::time_point now{}, last{};
  while (const auto message = (*reader)->next()) {
    if (message->bytes.size() > size) std::abort();
    now = pace->due(message->at, now);
    if (now < last || now - last > ReplayPace::longest_gap) std::abort();
    last = now;
  }
  return 0;
}
