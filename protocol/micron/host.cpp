#include <algorithm>
#include <cmath>
#include <iterator>
#include <tuple>
#include <utility>

#include "core/text/format.hpp"
#include "protocol/limits.hpp"
#include "protocol/line_pictures.hpp"
#include "protocol/micron/micron.hpp"
#include "protocol/micron/settings.hpp"

namespace sonar::micron {
namespace {

using protocol::HostActions;
using protocol::HostPing;

constexpr double usual_range_m = 10, sound_mps = 1500;      // bins are intervals of time; drivers assume 1500 m/s
constexpr auto patience = std::chrono::milliseconds(500);   // time after which a request without a scan line is repeated
constexpr std::string_view setting = "parameters";          // the name of the only changed setting
constexpr auto learning = std::chrono::milliseconds(2500);  // longest wait for the parameters that the head has

/// Makes the parameters for a scan of the half circle ahead in steps of a grad.
HeadCommand command_of(const protocol::SettingsOverride& wanted) {
  HeadCommand c;
  c.control &= static_cast<std::uint16_t>(~control::continuous);
  c.left = ahead - turn / 4;
  c.right = ahead + turn / 4;
  const double range_m = wanted.range_m.value_or(usual_range_m);
  // Rounding must not extend the bins beyond the farthest range, because the sonar would ignore the command.
  c.interval = static_cast<std::uint16_t>(
      std::clamp<long>(std::lround(2 * range_m / sound_mps / c.bins / bin_unit_s), 1, longest_interval(c.bins)));
  c.range_dm = static_cast<std::uint16_t>(std::clamp(std::lround(10 * range_m), 1L, 16383L));
  if (wanted.gain_percent)
    c.gain = static_cast<std::uint8_t>(std::clamp(std::lround(most_gain * *wanted.gain_percent / 100), 0L, 255L));
  c.gain2 = c.gain;
  return c;
}

/// Returns the parameters with which a scan line was made.
HeadCommand command_of(const HeadData& line) {
  HeadCommand c;
  c.control = line.control;
  c.device_type = line.device_type;
  c.range_dm = line.range_dm;
  c.left = line.left;
  c.right = line.right;
  c.ad_span = line.ad_span;
  c.ad_low = line.ad_low;
  c.gain = c.gain2 = line.gain;
  c.slope.fill(line.slope);
  c.step = line.step;
  c.interval = line.interval;
  c.bins = static_cast<std::uint16_t>((line.control & control::eight_bits) != 0 ? line.size : 2 * line.size);
  return c;
}

/// True if two commands have equal values of what drivers choose. A scan line does not state all parameters.
bool is_alike(const HeadCommand& a, const HeadCommand& b) {
  const auto chosen = [](const HeadCommand& c) {
    return std::tuple(c.range_dm, c.left, c.right, c.gain, c.step, c.interval, c.bins);
  };
  return chosen(a) == chosen(b);
}

/// The head keeps the parameters of the last driver. If it has parameters, the host first requests a line, which states them. It
/// restores them when it leaves.
class MicronHost final : public protocol::Host {
 public:
  /// `changed`: by a host that has lost the sonar.
  MicronHost(std::optional<HeadCommand> command, const protocol::ChangedSettings& changed) : command_(std::move(command)) {
    if (const auto known = changed.find(setting); known != changed.end())
      earlier_ = read_front<HeadCommand>(std::as_bytes(std::span(known->second.before)));
  }

  HostActions on_open(std::span<const std::uint16_t>, Time now) override {
    if (command_) learns_until_ = now + learning;
    return {};
  }
  /// Ends the wait for the head's parameters, or repeats the request, because it or its answer may be lost.
  HostActions on_tick(Time now) override {
    if (!command_ || now < *next_tick()) return {};
    return learns_until_ ? begin(now) : HostActions{request(now)};
  }
  std::optional<Time> next_tick() const override {
    if (!command_) return std::nullopt;
    return learns_until_ ? learns_until_ : std::optional(requested_at_ + patience);
  }
  HostActions on_leave() override {
    leaves_ = std::exchange(learns_until_, std::nullopt) && command_ && earlier_;
    // The line shows whose parameters the head has.
    if (leaves_) return {protocol::HostSend{0, from_host(Id::send_data, Bytes(4))}};
    const auto ours = std::exchange(command_, std::nullopt);  // no further requests
    const auto& first = before_ ? before_ : earlier_;
    if (!ours || !first) return {};
    const bool is_anothers = seen_ && !is_alike(*seen_, *ours) && !is_alike(*seen_, *first);
    if (is_anothers) return {};
    return {protocol::HostSend{0, from_host(Id::head_command, wire::bytes_of(*first))}};
  }
  HostActions on_bytes(std::size_t, BytesView received, Time now) override {
    HostActions actions;
    splitter_.append(now, received);
    while (const auto whole = splitter_.next()) {
      const auto message = read_frame(whole->bytes);
      if (!message) {
        counts_.junk_bytes += whole->bytes.size();
        continue;
      }
      ++counts_.messages;
      if (message->header.id == Id::alive) on_alive(message->payload, now, actions);
      if (message->header.id != Id::head_data) continue;
      if (std::exchange(leaves_, false)) {
        if (const auto line = read_front<HeadData>(message->payload)) seen_ = command_of(*line);
        std::ranges::move(on_leave(), std::back_inserter(actions));
      }
      if (learns_until_) {
        if (const auto line = read_front<HeadData>(message->payload)) before_ = command_of(*line);
        if (before_ && earlier_ && is_alike(*before_, *command_)) before_ = earlier_;
        std::ranges::move(begin(now), std::back_inserter(actions));
        continue;
      }
      if (auto ping = ping_from(message->payload)) {
        ping->facts.message_size = whole->bytes.size();
        if (const auto line = read_front<HeadData>(message->payload)) seen_ = command_of(*line);
        actions.emplace_back(*std::move(ping));
      }
      if (command_) actions.emplace_back(request(now));
    }
    return actions;
  }
  bool has_left() const override { return !leaves_; }
  protocol::ChangedSettings changed() const override {
    const auto& before = before_ ? before_ : earlier_;
    if (!before) return {};
    const Bytes bytes = wire::bytes_of(*before);
    std::string text;
    for (const std::byte b : bytes) text += std::to_integer<char>(b);
    return {{std::string(setting), {text, {}}}};
  }
  std::string about() const override { return "a Micron"; }
  std::optional<Counts> counts() const override { return counts_; }

 private:
  protocol::HostSend request(Time now) {
    requested_at_ = now;
    return {0, from_host(Id::send_data, Bytes(4))};
  }

  /// Sends the parameters and the first request.
  HostActions begin(Time now) {
    learns_until_.reset();
    return {protocol::HostSend{0, from_host(Id::head_command, wire::bytes_of(*command_))}, request(now)};
  }

  /// Before begin(): requests a line if the head has parameters, else begins. Later: sends the parameters to a restarted head.
  void on_alive(BytesView payload, Time now, HostActions& actions) {
    const auto alive = read_front<Alive>(payload);
    if (!alive || !command_) return;
    const bool has_parameters = (alive->head_info & head_info::received_parameters) != 0;
    if (leaves_) return;
    if (learns_until_ && has_parameters)
      actions.emplace_back(request(now));
    else if (learns_until_)
      std::ranges::move(begin(now), std::back_inserter(actions));
    else if (!has_parameters)
      actions.emplace_back(protocol::HostSend{0, from_host(Id::head_command, wire::bytes_of(*command_))});
  }

  /// Reads a scan line. Its direction is counted from astern; an inverted sonar counts bearings counter-clockwise.
  std::optional<HostPing> ping_from(BytesView payload) {
    const auto data = read_front<HeadData>(payload);
    if (!data || data->step == 0 || data->bearing >= turn) return std::nullopt;
    const BytesView rest = payload.subspan(wire::wire_size<HeadData>());
    if (rest.size() != data->size) return std::nullopt;
    const bool eight_bits = (data->control & control::eight_bits) != 0;
    const Bytes bins = eight_bits ? Bytes(rest.begin(), rest.end()) : unpacked(rest);
    if (bins.empty()) return std::nullopt;
    const double row_m = data->interval * bin_unit_s * sound_mps / 2;
    const auto rows = static_cast<unsigned>(bins.size());
    HostPing ping;
    const double frequency_hz = static_cast<double>(models().front()->modes.front().centre_hz);
    ping.facts = {++pings_, 1, rows, eight_bits ? 8u : 4u, row_m, rows * row_m, frequency_hz, 0};
    ping.facts.note = text::format("bearing %.1f deg", (data->bearing - ahead) * 360.0 / turn);
    protocol::Line line;
    // 17 = 255 / 15 converts bins of 4 bits to the scale of 8 bits.
    for (const std::byte bin : bins) line.push_back(static_cast<float>(std::to_integer<int>(bin) * (eight_bits ? 1 : 17)));
    const auto directions = static_cast<std::size_t>(std::max(turn / data->step, 4));
    if (sweep_.directions() != directions) sweep_ = protocol::Sweep(directions);
    const bool is_inverted = (data->control & control::inverted) != 0;
    const int bearing = is_inverted ? (turn - data->bearing) % turn : data->bearing;
    const auto direction = static_cast<std::size_t>(std::lround(bearing * static_cast<double>(directions) / turn)) % directions;
    sweep_.add(direction, std::move(line), row_m, ping);
    return ping;
  }

  std::optional<HeadCommand> command_;  // nullopt: this host sends nothing, as for a recording
  std::optional<HeadCommand> before_;   // parameters that the head had
  std::optional<HeadCommand> earlier_;  // those that it had before a host that has lost the sonar
  std::optional<HeadCommand> seen_;     // those of the last line, once ours were sent
  std::optional<Time> learns_until_;    // set while the host waits for before_
  bool leaves_ = false;                 // true: the host waits for a line before it restores earlier_
  recording::MessageSplitter splitter_{recording::Origin::device, framing};
  protocol::Sweep sweep_{400};
  Time requested_at_{};
  std::uint32_t pings_ = 0;  // a Micron does not number its pings
  Counts counts_;
};

}  // namespace

Result<std::unique_ptr<protocol::Host>> make_host(const protocol::Wanted& wanted) {
  if (auto accepted = protocol::accept_settings(wanted, "a Micron", {"range", "gain", "mode"}); !accepted)
    return tl::unexpected(accepted.error());
  if (wanted.settings.mode.value_or(0) > 0) return failure(ErrorKind::usage, "a Micron has one mode only");
  // The range is refused here, because the sonar would ignore the command and send nothing.
  const double farthest = static_cast<double>(models().front()->modes.front().max_range_m);
  const std::string why = protocol::range_complaint(wanted.settings.range_m.value_or(usual_range_m), "a Micron", 0, farthest);
  if (!why.empty()) return failure(ErrorKind::usage, why);
  return std::make_unique<MicronHost>(wanted.as_it_is ? std::nullopt : std::optional(command_of(wanted.settings)),
                                      wanted.changed);
}

}  // namespace sonar::micron
