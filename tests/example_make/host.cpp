// The driver's side of the Example's protocol, and the functions for recordings.
#include <algorithm>
#include <cmath>

#include "protocol/recorded/message_splitter.hpp"
#include "tests/example_make/example.hpp"
#include "tests/example_make/messages.hpp"

namespace sonar::example_make {
namespace {

using protocol::HostActions;

struct Decoded {
  PingHead head;
  BytesView bearings, samples;
};
std::optional<Decoded> ping_in(BytesView whole) {
  if (!framing.begins_message(whole, recording::Origin::device) || kind_of(whole) != Kind::ping) return std::nullopt;
  const auto head = payload_of<PingHead>(whole);
  if (!head || head->beams == 0 || head->rows == 0) return std::nullopt;
  const std::size_t bearings = 2u * head->beams, samples = std::size_t{head->beams} * head->rows;
  const BytesView rest = whole.subspan(header_size + head_size);
  if (rest.size() != bearings + samples) return std::nullopt;
  return Decoded{*head, rest.first(bearings), rest.subspan(bearings)};
}

PolarImage picture_of(BytesView whole) {
  const Decoded ping = *ping_in(whole);
  PolarImage image;
  image.rows = ping.head.rows;
  image.beams = ping.head.beams;
  image.row_spacing_m = 1e-3 * ping.head.range_mm / ping.head.rows;
  wire::Reader read(ping.bearings);
  for (std::size_t beam = 0; beam < image.beams; ++beam) {
    std::int16_t bearing = 0;
    read("bearing", bearing);
    image.azimuth_rad.push_back(1e-4 * bearing);
  }
  for (const std::byte sample : ping.samples) image.samples.push_back(static_cast<float>(std::to_integer<int>(sample)));
  return image;
}

class ExampleHost final : public protocol::Host {
 public:
  explicit ExampleHost(std::optional<Settings> wanted) : wanted_(wanted) {}
  HostActions on_open(std::span<const std::uint16_t>, Time) override {
    if (!wanted_) return {};
    return {protocol::HostSend{0, message(Kind::settings, wire::bytes_of(*wanted_))}};
  }
  HostActions on_bytes(std::size_t, BytesView received, Time now) override {
    HostActions actions;
    splitter_.append(now, received);
    while (auto whole = splitter_.next()) {
      if (const auto ping = ping_in(whole->bytes)) {
        on_ping(std::move(whole->bytes), ping->head, actions);
      } else if (!framing.begins_message(whole->bytes, recording::Origin::device)) {
        counts_.junk_bytes += whole->bytes.size();
        continue;
      } else if (kind_of(whole->bytes) == Kind::refused) {
        actions.emplace_back(Error{ErrorKind::usage, "refuses the settings"});
      } else {
        accepted_ = accepted_ || kind_of(whole->bytes) == Kind::accepted;
      }
      ++counts_.messages;
    }
    return actions;
  }
  bool is_open() const override { return !wanted_ || accepted_; }
  std::string about() const override { return "an Example"; }
  std::optional<Counts> counts() const override { return counts_; }

 private:
  void on_ping(Bytes whole, const PingHead& head, HostActions& actions) {
    protocol::HostPing ping;
    const double range_m = 1e-3 * head.range_mm;
    ping.facts = {head.number, head.beams, head.rows, 8, range_m / head.rows, range_m, static_cast<double>(head.frequency_hz),
                  whole.size()};
    ping.fired_s = 1e-6 * static_cast<double>(head.fired_us);
    if (last_ && head.number > *last_ + 1) counts_.missing_pings += head.number - *last_ - 1;
    if (last_ && head.number <= *last_)
      ping.errors.push_back("number " + std::to_string(head.number) + " after " + std::to_string(*last_));
    last_ = head.number;
    ping.picture = [kept = std::make_shared<const Bytes>(std::move(whole))]() -> Result<PolarImage> { return picture_of(*kept); };
    actions.emplace_back(std::move(ping));
  }

  std::optional<Settings> wanted_;
  recording::MessageSplitter splitter_{recording::Origin::device, framing};
  bool accepted_ = false;
  std::optional<std::uint32_t> last_;
  Counts counts_;
};

constexpr std::array<recording::FileKind, 1> kinds{{{
    .ending = ".exs",
    .name = "Example log",
    .holds = "messages of an Example",
    .begins =
        [](BytesView front) {
          return recording::begins_with(front, {'E', 'X'});
        },
    .read = [](std::unique_ptr<recording::Source> source) { return recording::read_raw_dump(std::move(source), framing); },
    .write = [](std::unique_ptr<recording::Sink> sink) { return recording::write_raw_dump(std::move(sink)); },
    .is_raw_dump = true,
}}};

}  // namespace

Result<std::unique_ptr<protocol::Host>> make_host(const protocol::Wanted& wanted) {
  if (auto known = protocol::accept_settings(wanted, "an Example", {"range", "rate", "gain", "mode"}); !known)
    return tl::unexpected(known.error());
  protocol::SettingsOverride settings = wanted.settings;
  if (!settings.rate_hz) settings.rate_hz = 10;
  if (settings.mode.value_or(0) != 0) return failure(ErrorKind::usage, "an Example has one mode");
  Settings s;
  s.range_mm = static_cast<std::uint32_t>(std::lround(1000 * std::clamp(settings.range_m.value_or(10), 0.5, 50.0)));
  s.rate_centihz =
      static_cast<std::uint16_t>(std::lround(100 * std::clamp(*settings.rate_hz, *settings.rate_hz > 0 ? 0.01 : 0.0, 20.0)));
  s.gain_percent = static_cast<std::uint8_t>(std::lround(settings.gain_percent.value_or(50)));
  return std::make_unique<ExampleHost>(wanted.as_it_is ? std::nullopt : std::optional(s));
}

recording::Codec codec() {
  return {.framing = &framing,
          .files = kinds,
          .sender = [](const recording::RecordedMessage& message) -> std::optional<recording::Sender> {
            if (!framing.begins_message(message.bytes, recording::Origin::device)) return std::nullopt;
            return recording::Sender{vendor().models().front()};
          },
          .samples = [](BytesView message) -> std::optional<recording::Samples> {
            const auto ping = ping_in(message);
            if (!ping) return std::nullopt;
            return recording::Samples{ping->head.beams, ping->head.rows, 8,
                                      std::make_shared<const Bytes>(ping->samples.begin(), ping->samples.end())};
          }};
}

}  // namespace sonar::example_make
