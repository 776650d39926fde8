#include <algorithm>
#include <cmath>
#include <map>
#include <string>
#include <utility>

#include "core/text/format.hpp"
#include "protocol/aris/aris.hpp"
#include "protocol/aris/encode_frame.hpp"
#include "protocol/aris/models.hpp"
#include "protocol/limits.hpp"

namespace sonar::aris {
namespace {

using namespace std::chrono_literals;
using protocol::HostActions;

constexpr auto ping_after = 1s;                   // keep-alive; the device disconnects a controller after 10 s of silence
constexpr double nominal_sound_speed_mps = 1490;  // converts the requested range to time; no frame has stated the speed yet
constexpr std::uint32_t most_pulse_us = 80;
constexpr double nearest_end_m = 1.1;            // the shortest start delay, 930 us, and the fewest and shortest samples
constexpr std::size_t commands = 0, frames = 1;  // indices of ports

/// Settings for a product. `refusal`: reason why the product cannot have the requested settings (empty: it can); `acoustics` are
/// then the nearest possible settings.
struct Choice {
  Acoustics acoustics;
  std::string refusal;
};

Choice choice_for(const SonarModel& model, const protocol::SettingsOverride& wanted) {
  const Product& product = product_of(model);
  Acoustics a = product.initial;
  std::string refusal;
  if (wanted.mode) {
    // The modes with the telephoto lens are last.
    const auto modes = static_cast<std::uint32_t>(model.modes.size() / (product.has_telephoto ? 2 : 1));
    if (*wanted.mode < modes) {
      const ModeChoice choice = choice_of(product, static_cast<int>(*wanted.mode));
      a.ping_mode = choice.ping_mode;
      a.frequency = choice.frequency;
      a.cycle_us = shortest_cycle_us(a);
    } else {
      // Users count modes from 1.
      refusal = text::format("an %s has the modes 1 to %u here, no mode %u", model.name.c_str(), modes, *wanted.mode + 1);
    }
  }
  if (wanted.gain_percent) a.gain_db = static_cast<float>(highest_gain_db * *wanted.gain_percent / 100);
  if (wanted.range_m) {
    if (refusal.empty())
      refusal = protocol::range_complaint(*wanted.range_m, "an " + model.name, nearest_end_m, product.window_end_m);
    const double range_m = std::clamp(*wanted.range_m, nearest_end_m, product.window_end_m);
    const double end_us = 2e6 * range_m / nominal_sound_speed_mps;
    // A short range begins nearer, so that the fewest samples fit into it.
    a.start_delay_us = std::min(a.start_delay_us, static_cast<std::uint32_t>(end_us) - shortest_period_us * least_samples);
    const double window_us = end_us - a.start_delay_us;
    a.sample_period_us = static_cast<std::uint32_t>(std::clamp(std::ceil(window_us / 2000), 4.0, 100.0));
    a.samples_per_beam =
        static_cast<std::uint32_t>(std::clamp<double>(window_us / a.sample_period_us, least_samples, most_samples));
    a.cycle_us = shortest_cycle_us(a);
    a.pulse_us = std::max(a.pulse_us, std::min(a.sample_period_us, most_pulse_us));
  }
  const double rate_hz = wanted.rate_hz.value_or(static_cast<double>(a.frame_rate_hz));
  a.frame_rate_hz = static_cast<float>(std::clamp(rate_hz, 1.0, highest_frame_rate_hz(product, a, std::nullopt)));
  a.cookie = 1;
  return {judge(a, product, false).used, refusal};  // judge() limits the pulse to the longest of the product
}

PolarImage picture_of(const DecodedFrame& frame, const std::vector<double>& azimuth_rad) {
  PolarImage image;
  image.rows = frame.samples;
  image.beams = frame.beams;
  image.row_spacing_m = static_cast<double>(frame.header.window_length_m) / static_cast<double>(frame.samples);
  image.start_m = static_cast<double>(frame.header.window_start_m);
  image.azimuth_rad = azimuth_rad;
  image.samples.reserve(image.rows * image.beams);
  for (std::size_t row = 0; row < image.rows; ++row)
    for (std::size_t beam = image.beams; beam > 0; --beam)  // beam 0 of an ARIS is at starboard, beam 0 of a picture at port
      image.samples.push_back(static_cast<float>(std::to_integer<int>(frame.picture[row * image.beams + beam - 1])));
  return image;
}

/// Returns the mode that a frame states; null if the product or the mode is unknown, or if the frame has another number of beams
/// than the mode.
const FrequencyMode* mode_of(const DecodedFrame& frame) {
  for (const auto& model : models()) {
    const Product& product = product_of(*model);
    if (static_cast<std::uint32_t>(product.system) != frame.header.system) continue;
    const auto mode = mode_index(
        product, {frame.header.ping_mode, static_cast<Frequency>(frame.header.frequency), frame.header.large_lens != 0});
    if (!mode) return nullptr;
    const FrequencyMode& found = model->modes[static_cast<std::size_t>(*mode)];
    return found.beam_azimuths_rad.size() == frame.beams ? &found : nullptr;
  }
  return nullptr;
}

class ArisHost final : public protocol::Host {
 public:
  explicit ArisHost(const protocol::Wanted& wanted) : wanted_(wanted) {}

  /// Sends settings for each product, because only beacons state the product, and beacons may not arrive here. The device refuses
  /// settings for other products. An ARIS 1800 also accepts settings for a 1200, so those for a 1200 are sent first. Frames
  /// begin when the receiver is set. The first frame states the product; if this product cannot have the requested settings, the
  /// host gives up.
  HostActions on_open(std::span<const std::uint16_t> own, Time now) override {
    HostActions actions;
    std::uint32_t cookie = 0;
    for (const auto& model : models()) {
      if (wanted_.as_it_is) break;
      const SystemType system = product_of(*model).system;
      Choice choice = choice_for(*model, wanted_.settings);
      if (!choice.refusal.empty()) refusals_[system] = std::move(choice.refusal);
      choice.acoustics.cookie = asked_[system] = ++cookie;
      Command command;
      command.type = CommandType::set_acoustics;
      command.acoustics = choice.acoustics;
      send(command, now, actions);
    }
    Command command;
    command.type = CommandType::set_receiver;
    command.receiver = Receiver{own[frames], ""};
    send(command, now, actions);
    return actions;
  }

  HostActions on_bytes(std::size_t port, wire::BytesView received, Time) override {
    HostActions actions;
    if (port != frames) return actions;
    bytes_ += received.size();
    auto frame = assembler_.add(received);
    if (!frame) return actions;
    if (const auto why = refusals_.find(static_cast<SystemType>(frame->header.system)); why != refusals_.end())
      return {Error{ErrorKind::usage, why->second}};
    warn_of(*frame, actions);
    const FrequencyMode* const mode = mode_of(*frame);
    if (mode == nullptr) return actions;
    const FrameHeader& h = frame->header;
    const double length_m = static_cast<double>(h.window_length_m);
    protocol::HostPing ping;
    ping.facts = {static_cast<std::uint32_t>(frame->index),       static_cast<unsigned>(frame->beams),
                  static_cast<unsigned>(frame->samples),          8,
                  length_m / static_cast<double>(frame->samples), static_cast<double>(h.window_start_m) + length_m,
                  static_cast<double>(mode->centre_hz),           std::exchange(bytes_, 0)};
    ping.picture = [kept = std::make_shared<const DecodedFrame>(*std::move(frame)), mode]() -> Result<PolarImage> {
      return picture_of(*kept, mode->beam_azimuths_rad);  // `mode` points into models(), which is never destroyed
    };
    actions.emplace_back(std::move(ping));
    return actions;
  }

  HostActions on_tick(Time now) override {
    HostActions actions;
    if (now < next_tick()) return actions;
    Command command;
    command.type = CommandType::ping;
    command.ping.emplace();
    send(command, now, actions);
    return actions;
  }
  std::optional<Time> next_tick() const override { return sent_at_ + ping_after; }
  std::string about() const override { return "an ARIS"; }

 private:
  void send(const Command& command, Time now, HostActions& actions) {
    sent_at_ = now;
    actions.emplace_back(protocol::HostSend{commands, framed(command)});
  }

  /// Adds two notices, at most once each: the sonar does not use the sent settings; frames were lost.
  void warn_of(const DecodedFrame& frame, HostActions& actions) {
    constexpr int settled = 3;  // the first frames may have been made before the settings arrived
    const FrameHeader& h = frame.header;
    if (frame.index >= settled && !asked_.empty() && !warned_of_settings_) {
      const auto cookie = asked_.find(static_cast<SystemType>(h.system));
      warned_of_settings_ =
          cookie == asked_.end() || (h.applied_cookie != cookie->second && h.constrained_cookie != cookie->second);
      if (warned_of_settings_) actions.emplace_back(protocol::Notice{"the sonar does not use the settings that were sent to it"});
    }
    if (assembler_.incomplete() > 0 && !std::exchange(warned_of_losses_, true))
      actions.emplace_back(
          protocol::Notice{"a frame before number " + std::to_string(frame.index) + " is left out: datagrams were lost"});
  }

  protocol::Wanted wanted_;
  FrameAssembler assembler_;
  std::map<SystemType, std::uint32_t> asked_;   // cookie of the settings for each product; empty = none were sent
  std::map<SystemType, std::string> refusals_;  // reasons why products cannot have the requested settings
  bool warned_of_settings_ = false, warned_of_losses_ = false;
  Time sent_at_{};
  std::size_t bytes_ = 0;  // number of bytes since the last whole frame
};

}  // namespace

Result<std::unique_ptr<protocol::Host>> make_host(const protocol::Wanted& wanted) {
  if (auto known = protocol::accept_settings(wanted, "an ARIS", {"range", "rate", "gain", "mode"}); !known)
    return tl::unexpected(known.error());
  if (wanted.settings.rate_hz == 0.0) return failure(ErrorKind::usage, "an ARIS has no standby: its least rate is 1 Hz");
  const double fastest_hz = static_cast<double>(models().front()->max_rate_hz), rate_hz = wanted.settings.rate_hz.value_or(1);
  if (rate_hz > fastest_hz)
    return failure(ErrorKind::usage, text::format("the rate of an ARIS is 1 to %g Hz, not %g Hz", fastest_hz, rate_hz));
  const auto fits = [&wanted](const auto& model) { return choice_for(*model, wanted.settings).refusal.empty(); };
  if (!wanted.as_it_is && std::none_of(models().begin(), models().end(), fits))
    return failure(
        ErrorKind::usage,
        "no ARIS has this range and mode: an ARIS 1200 has modes 1 and 2, others 1 to 4, and its range of 1.1 to 100 m is the "
        "longest");
  return std::make_unique<ArisHost>(wanted);
}

}  // namespace sonar::aris
