// Fuzzes the bytes of a client to a whole Dialogue. The first byte gives the length of the pieces; the rest is the stream.
// Fails if a setting exceeds the model's limits, or if the replies are much longer than the requests.
#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "protocol/vendor.hpp"

namespace {

using namespace sonar;

const protocol::DeviceState& device() {
  static const protocol::DeviceState state = [] {
    const auto profile = protocol::find_profile("oculus-m1200d");
    protocol::DeviceState made;
    made.id = 7001;
    made.model = profile->model;
    made.options = protocol::check_options(*profile->vendor, {}).value();
    return made;
  }();
  return state;
}

void require(bool statement) {
  if (!statement) std::abort();
}

void check(const PingSettings& s) {
  require(s.mode == 0 || s.mode == 1);
  require(s.range_m >= static_cast<double>(0.1f) && s.range_m <= 40 && s.range_bin_count >= 1 && s.range_bin_count <= 720);
  require(s.gain_db >= 0 && s.gain_db < 96.01f && s.rate_hz >= 0 && s.rate_hz <= 40);
  require(s.device_sound_speed_mps >= 1300 && s.device_sound_speed_mps <= 1700);
  require(std::isfinite(s.device_absorption_db_per_m) && s.format.gamma > 0 && s.format.gamma <= 1);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  const std::size_t piece = data[0] + std::size_t{1};
  std::vector<std::byte> stream;
  for (std::size_t i = 1; i < size; ++i) stream.push_back(static_cast<std::byte>(data[i]));
  const auto dialogue = protocol::vendors().front()->converse({}, device(), Time{});
  std::size_t answered = 0;
  for (std::size_t at = 0; at < stream.size(); at += piece) {
    const auto part = protocol::BytesView(stream).subspan(at, std::min(piece, stream.size() - at));
    const protocol::Reaction reaction = dialogue->on_bytes(part, Time{});
    for (const protocol::Event& event : reaction.events)
      if (const auto* change = std::get_if<protocol::ChangeSettings>(&event)) check(change->settings);
    for (const protocol::Bytes& reply : reaction.replies) answered += reply.size();
  }
  require(answered <= size);
  return 0;
}
