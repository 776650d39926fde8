#include <algorithm>
#include <cmath>
#include <deque>

#include "core/base/geometry.hpp"
#include "protocol/blueview/blueview.hpp"
#include "protocol/blueview/encode_ping.hpp"
#include "protocol/blueview/frames.hpp"
#include "protocol/blueview/head_settings.hpp"
#include "protocol/blueview/models.hpp"
#include "protocol/limits.hpp"

namespace sonar::blueview {
namespace {

using namespace std::chrono_literals;
using protocol::HostActions;

constexpr auto host_keep_alive_after = 2s;  // time since the last message of this host
constexpr std::uint16_t abi_of_sdk = 4;     // the sonar reads this number and ignores it

/// Returns the error of an error frame of `sonar`, such as "P900-90 refuses a request: no head 3 (code 2010)", as in HostAction.
Error error_in(wire::BytesView payload, const std::string& sonar) {
  wire::Reader reader(payload);
  Code code{};
  reader("code", code);
  const std::string text = read_text(reader, "text") + " (code " + std::to_string(static_cast<int>(code)) + ")";
  if (code == Code::timeout) return {ErrorKind::unavailable, "sends no ping: " + text};
  return {ErrorKind::usage, sonar + " refuses a request: " + text};
}

struct GreetedHead {
  std::int32_t id = 0;
  float start_m = 0, longest_m = 0;
  std::int32_t centre_hz = 0;
};
struct Greeting {
  std::string model, serial;
  std::vector<GreetedHead> heads;
};
/// Reads HELLO_OK (docs/protocols/blueview-link.md, "Requests"), but skips fields that this host does not need. Returns nullopt
/// if the payload is too short, or has no head.
std::optional<Greeting> read_greeting(wire::BytesView payload) {
  wire::Reader reader(payload);
  std::uint16_t version = 0, beams = 0;
  std::uint8_t heads = 0;
  std::uint32_t capabilities = 0;
  std::int32_t whole = 0;
  float number = 0;
  Greeting greeting;
  reader("proto", version);
  greeting.model = read_text(reader, "model");
  read_text(reader, "name");
  greeting.serial = read_text(reader, "serial");
  read_text(reader, "firmware");
  reader("temp_c", number);
  reader("caps", capabilities);
  reader("n_heads", heads);
  for (int i = 0; i < heads && reader.ok(); ++i) {
    GreetedHead head;
    reader("id", head.id);
    read_text(reader, "name");
    reader("min", number);
    reader("max", head.longest_m);
    reader("start", head.start_m);
    reader("stop", number);
    reader("centre_hz", head.centre_hz);
    for (const char* name : {"fov_min", "fov_max"}) reader(name, number);
    reader("beams", beams);
    reader("sound_speed", whole);
    for (const char* name : {"gain", "tvg"}) reader(name, number);
    reader("fluid", whole);
    greeting.heads.push_back(head);
  }
  return reader.ok() && !greeting.heads.empty() ? std::optional(greeting) : std::nullopt;
}

/// A ping whose head has been read and whose samples have been decompressed. `samples`: 16 bits each, beam by beam.
struct DecodedPing {
  PingHead head;
  wire::Bytes samples;
};
/// Reads a ping. Errors: bad_data for an invalid ping. fields(PingHead) cannot read the payload, because it describes pings of
/// the emulated sonar, which have five of the eleven navigation fields; the protocol allows any of the fields.
Result<DecodedPing> read_ping(wire::BytesView payload) {
  constexpr std::size_t fixed = wire::wire_size<PingHead>() - 8 - 4 * 4 - 4;  // bytes before the navigation data
  DecodedPing ping;
  PingHead& h = ping.head;
  wire::Reader reader(payload);
  reader("head", h.head);
  reader("number", h.number);
  reader("t_utc", h.utc_s);
  reader("tz", h.time_zone);
  reader("start", h.start_m);
  reader("stop", h.stop_m);
  reader("c", h.sound_speed_mps);
  reader("fov_min", h.fov_min_deg);
  reader("fov_max", h.fov_max_deg);
  reader("bin_m", h.bin_m);
  reader("beams", h.beams);
  reader("bins", h.bins);
  reader("fmt", h.format);
  reader("compression", h.compression);
  reader("nav_fields", h.nav_fields);
  std::size_t at = fixed;
  for (const NavField wide : {nav_time, nav_latitude, nav_longitude}) {
    double value = 0;
    if ((h.nav_fields & wide) != 0) reader("nav", value), at += 8;
  }
  for (const NavField narrow : {nav_depth, nav_altitude, nav_pitch, nav_roll, nav_heading, nav_heading_velocity, nav_course}) {
    float value = 0;
    if ((h.nav_fields & narrow) != 0) reader("nav", value), at += 4;
  }
  if ((h.nav_fields & nav_text) != 0) at += 2 + read_text(reader, "text").size();
  reader("raw_len", h.raw_length);
  at += 4;
  const auto refused = [](const std::string& why) { return failure(ErrorKind::bad_data, "sent a ping that " + why); };
  if (!reader.ok() || at > payload.size()) return refused("is cut short");
  if (!(h.start_m >= 0 && h.stop_m > h.start_m && h.stop_m <= 1e6f && h.bin_m > 0 && h.bin_m <= 1e6f))
    return refused("has no valid ranges");
  if (!(h.fov_min_deg >= -180 && h.fov_max_deg > h.fov_min_deg && h.fov_max_deg <= 180)) return refused("has no valid sector");
  const wire::BytesView body = payload.subspan(at);
  if (h.compression == Compression::none) ping.samples.assign(body.begin(), body.end());
  if (h.compression == Compression::deflate) ping.samples = inflated(body, h.raw_length);
  if (h.format != 1 || ping.samples.size() != 2 * std::size_t{h.beams} * h.bins)
    return refused("does not hold the samples it announces");
  return ping;
}

Result<PolarImage> picture_of(const DecodedPing& ping) {
  const PingHead& h = ping.head;
  if (ping.samples.empty()) return failure(ErrorKind::bad_data, "ping " + std::to_string(h.number) + " holds no samples");
  PolarImage image;
  image.rows = h.bins;
  image.beams = h.beams;
  image.row_spacing_m = static_cast<double>(h.bin_m);
  image.start_m = static_cast<double>(h.start_m);
  const double step_deg = static_cast<double>(h.fov_max_deg - h.fov_min_deg) / static_cast<double>(image.beams);
  for (std::size_t beam = 0; beam < image.beams; ++beam)
    image.azimuth_rad.push_back(-rad_from_deg(static_cast<double>(h.fov_min_deg) + (static_cast<double>(beam) + 0.5) * step_deg));
  image.samples.reserve(image.rows * image.beams);
  for (std::size_t row = 0; row < image.rows; ++row)
    for (std::size_t beam = 0; beam < image.beams; ++beam) {
      const std::size_t at = 2 * (beam * image.rows + row);
      image.samples.push_back(
          static_cast<float>(std::to_integer<int>(ping.samples[at]) + 256 * std::to_integer<int>(ping.samples[at + 1])));
    }
  image.shade(shades);
  return image;
}

class BlueViewHost final : public protocol::Host {
 public:
  explicit BlueViewHost(const protocol::Wanted& wanted)
      : wanted_(wanted.as_it_is ? protocol::SettingsOverride{} : wanted.settings), head_(wanted.settings.mode.value_or(0)) {}

  HostActions on_open(std::span<const std::uint16_t>, Time now) override {
    wire::Bytes hello;
    const Put write(hello);
    write("proto", protocol_version);
    write("abi", abi_of_sdk);
    put_text(hello, "sonarctl");
    HostActions actions;
    send(FrameType::hello, ++last_id_, hello, now, actions);
    return actions;
  }

  HostActions on_bytes(std::size_t, wire::BytesView received, Time now) override {
    HostActions actions;
    framer_.append(received);
    while (const auto frame = framer_.next()) {
      if (last_id_ == 0)  // on_open() was not called: the bytes come from a recording
        on_recorded(*frame, actions);
      else if (frame->header.request_id == last_id_)
        on_answer(*frame, now, actions);
    }
    if (!framer_.broken().empty()) actions.emplace_back(Error{ErrorKind::bad_data, framer_.broken()});
    return actions;
  }

  HostActions on_tick(Time now) override {
    HostActions actions;
    if (now >= next_tick()) send(FrameType::keep_alive, 0, {}, now, actions);
    return actions;
  }
  std::optional<Time> next_tick() const override { return sent_at_ + host_keep_alive_after; }

  HostActions on_demand(Time now) override {
    HostActions actions;
    if (!is_open_ || asked_) return actions;
    wire::Bytes payload;
    const Put write(payload);
    write("head", greeting_.heads[head_].id);
    write("timeout_ms", std::uint32_t{0});  // no limit at the sonar
    send(FrameType::ping, ++last_id_, payload, now, actions);
    asked_ = true;
    return actions;
  }

  bool is_open() const override { return is_open_; }
  std::string about() const override {
    return greeting_.heads.empty() ? "a BlueView sonar" : greeting_.model + ", serial " + greeting_.serial;
  }

 private:
  void send(FrameType type, std::uint32_t id, wire::BytesView payload, Time now, HostActions& actions) {
    sent_at_ = now;
    actions.emplace_back(protocol::HostSend{0, make_frame(type, id, payload)});
  }

  /// Reads frames of a recording. Ignores the request ids, which belong to the requests of the recorded host.
  void on_recorded(const Frame& frame, HostActions& actions) {
    if (frame.header.type == FrameType::hello_ok) greeting_ = read_greeting(frame.payload).value_or(greeting_);
    if (frame.header.type == FrameType::ping_data) on_ping(frame, actions);
  }

  /// Handles the answer to the last request. Requests are sent one by one: HELLO, a SET for each setting, then pings. Each answer
  /// triggers the next SET; after the last SET the host is open.
  void on_answer(const Frame& frame, Time now, HostActions& actions) {
    const auto fail = [&actions](ErrorKind kind, std::string text) { actions.emplace_back(Error{kind, std::move(text)}); };
    if (frame.header.type == FrameType::error) return actions.emplace_back(error_in(frame.payload, about())), void();
    if (is_open_) {
      if (frame.header.type == FrameType::ping_data && asked_) on_ping(frame, actions);
      return;
    }
    if (greeting_.heads.empty()) {
      const auto greeting = read_greeting(frame.payload);
      if (!greeting) return fail(ErrorKind::bad_data, "sends a greeting that describes no heads");
      greeting_ = *greeting;
      if (const std::string refusal = plan_settings(); !refusal.empty()) return fail(ErrorKind::usage, refusal);
    }
    if (settings_.empty()) {
      is_open_ = true;
      return;
    }
    wire::Bytes payload;
    const Put write(payload);
    write("head", greeting_.heads[head_].id);
    write("key", settings_.front().first);
    put_value(payload, settings_.front().second);
    settings_.pop_front();
    send(FrameType::set, ++last_id_, payload, now, actions);
  }

  /// Queues the settings to send. Returns the reason if the sonar cannot use them, else an empty text.
  std::string plan_settings() {
    if (head_ >= greeting_.heads.size())
      return greeting_.model + " has " + std::to_string(greeting_.heads.size()) + " head(s), no mode " +
             std::to_string(head_ + 1);
    const GreetedHead& head = greeting_.heads[head_];
    if (wanted_.range_m) {
      const auto range_m = static_cast<float>(*wanted_.range_m);
      if (range_m <= head.start_m || range_m > head.longest_m)
        return greeting_.model + " has a range of " + std::to_string(std::lround(head.start_m)) + " to " +
               std::to_string(std::lround(head.longest_m)) + " m: give a --range within it";
      settings_.emplace_back(Key::stop_range, range_m);
    }
    for (const auto& model : models())
      if (model->name == greeting_.model)
        if (std::string why = protocol::rate_complaint(wanted_, greeting_.model, model->max_rate_hz); !why.empty()) return why;
    if (wanted_.gain_percent) settings_.emplace_back(Key::gain, gain_db_from(*wanted_.gain_percent));
    if (wanted_.rate_hz.value_or(0) > 0) settings_.emplace_back(Key::ping_interval, ping_interval_ms(*wanted_.rate_hz));
    return {};
  }

  void on_ping(const Frame& frame, HostActions& actions) {
    asked_ = false;
    auto decoded = read_ping(frame.payload);
    if (!decoded) return actions.emplace_back(std::move(decoded.error())), void();
    protocol::HostPing ping;
    const PingHead& h = decoded->head;
    ping.facts = {h.number,
                  h.beams,
                  h.bins,
                  16,
                  static_cast<double>(h.bin_m),
                  static_cast<double>(h.stop_m),
                  head_ < greeting_.heads.size() ? static_cast<double>(greeting_.heads[head_].centre_hz) : 0,
                  header_size + frame.payload.size()};
    ping.picture = [kept = std::make_shared<const DecodedPing>(*std::move(decoded))] { return picture_of(*kept); };
    actions.emplace_back(std::move(ping));
  }

  protocol::SettingsOverride wanted_;
  Framer framer_{longest_payload};
  Greeting greeting_;
  std::deque<std::pair<Key, Value>> settings_;  // settings that are not sent yet
  std::size_t head_;                            // index into greeting_.heads
  std::uint32_t last_id_ = 0;
  bool is_open_ = false, asked_ = false;  // asked_: true if a requested ping has not arrived yet
  Time sent_at_{};
};

}  // namespace

const protocol::Search search{.port = discovery_port,
                              .question =
                                  [] {
                                    wire::Bytes question;
                                    const Put put(question);
                                    put("mark", discovery_question);
                                    put("version", protocol_version);
                                    return question;
                                  },
                              .answer = [](wire::BytesView datagram) -> std::optional<protocol::Search::Answer> {
                                wire::Reader reader(datagram);
                                std::array<std::uint8_t, 4> mark{};
                                std::uint16_t version = 0, port = 0;
                                reader("mark", mark);
                                reader("version", version);
                                reader("port", port);
                                const std::string model = read_text(reader, "model"), serial = read_text(reader, "serial");
                                if (!reader.ok() || mark != discovery_answer) return std::nullopt;
                                return protocol::Search::Answer{port, "BlueView head " + model + " (" + serial + ")"};
                              }};

Result<std::unique_ptr<protocol::Host>> make_host(const protocol::Wanted& wanted) {
  if (auto known = protocol::accept_settings(wanted, "a BlueView sonar", {"range", "rate", "gain", "mode"}); !known)
    return tl::unexpected(known.error());
  if (wanted.settings.rate_hz == 0.0)
    return failure(ErrorKind::usage, "a BlueView sonar has no standby: it pings when it is asked");
  float fastest_hz = 0;
  for (const auto& model : models()) fastest_hz = std::max(fastest_hz, model->max_rate_hz);
  if (const std::string why = protocol::rate_complaint(wanted.settings, "a BlueView sonar", fastest_hz); !why.empty())
    return protocol::refused(why);
  return std::make_unique<BlueViewHost>(wanted);
}

}  // namespace sonar::blueview
