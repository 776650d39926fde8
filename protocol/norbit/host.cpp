#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <deque>
#include <iterator>
#include <set>
#include <string>
#include <string_view>
#include <utility>

#include "core/base/geometry.hpp"
#include "core/text/format.hpp"
#include "protocol/limits.hpp"
#include "protocol/line_pictures.hpp"
#include "protocol/norbit/norbit.hpp"
#include "protocol/norbit/settings.hpp"

namespace sonar::norbit {
namespace {

using protocol::HostActions;
using protocol::HostPing;
using text::format;

constexpr std::size_t longest_reply = 512;
constexpr double usual_range_m = 10, usual_rate_hz = 10;
constexpr auto patience = std::chrono::seconds(2);  // time for which a packet waits for the packet of the other port
constexpr std::size_t most_waiting = 1024, most_waiting_bytes = 64u << 20;

constexpr auto learning = std::chrono::milliseconds(2500);  // longest wait for the settings that the sonar has

Bytes bytes_of(std::string_view text) {
  const auto bytes = std::as_bytes(std::span(text));
  return Bytes(bytes.begin(), bytes.end());
}

using NamedValues = std::pair<std::string, std::string>;  // name of a command, and its values

std::vector<NamedValues> lines_of(const protocol::SettingsOverride& wanted) {
  std::vector<NamedValues> lines{{"set_range", format("0 %g", wanted.range_m.value_or(usual_range_m))}};
  if (wanted.gain_percent) lines.emplace_back("set_gain", format("%g", most_gain_db * *wanted.gain_percent / 100));
  const double rate_hz = wanted.rate_hz.value_or(usual_rate_hz);
  if (rate_hz != 0) lines.emplace_back("set_rate", format("%g", rate_hz));
  lines.emplace_back("set_power", rate_hz == 0 ? "0" : "1");
  return lines;
}

std::vector<std::pair<double, double>> points_of(const Bathymetry& bathymetry) {
  std::vector<std::pair<double, double>> points;
  for (const Beam& beam : bathymetry.beams) {
    const double azimuth = -static_cast<double>(beam.angle_rad), range_m = bathymetry.range_m(beam);
    if (beam.sample > 1 && std::isfinite(azimuth) && std::isfinite(range_m)) points.emplace_back(azimuth, range_m);
  }
  return points;
}

/// Makes the picture of a water column, without samples. Returns nullopt if the angles do not increase from port to starboard, if
/// the samples have no range, or if there are no rows or fewer than two beams.
std::optional<PolarImage> fan_of(const Column& column) {
  PolarImage fan;
  fan.rows = column.front.samples;
  fan.beams = column.front.beams;
  fan.row_spacing_m = column.sample_m();
  fan.start_m = std::max(0.0, (column.front.first_sample - 0.5) * fan.row_spacing_m);  // a sample is in the middle of its row
  wire::Reader angles(column.directions);
  for (std::size_t n = 0; n < fan.beams; ++n) {
    float angle = 0;
    angles("direction", angle);
    fan.azimuth_rad.push_back(-static_cast<double>(angle));
    if (!std::isfinite(angle) || (n > 0 && !(fan.azimuth_rad[n] < fan.azimuth_rad[n - 1]))) return std::nullopt;
  }
  if (!(fan.row_spacing_m > 0 && std::isfinite(fan.row_spacing_m)) || fan.rows < 1 || fan.beams < 2) return std::nullopt;
  return fan;
}

PolarImage with_samples(PolarImage fan, const Column& column) {
  fan.samples.resize(fan.rows * fan.beams);
  wire::Reader pixels(column.pixels);
  for (float& sample : fan.samples) {
    std::uint16_t pixel = 0;
    pixels("pixel", pixel);
    sample = column.front.pixels == PixelType::int16 ? std::max<float>(0, static_cast<std::int16_t>(pixel)) : pixel;
  }
  fan.shade(shades);
  return fan;
}

/// Returns the elevation of the middle of the fan; mode 0 is that of a forward-looking sonar.
double elevation_of(int sonar_mode) { return sonar_mode == 0 ? 0 : -pi / 2; }

/// The two packets of a ping arrive at two ports, at each port in the order of the pings. The packets of a slow connection may
/// arrive much later than those of the other connection.
class NorbitHost final : public protocol::Host {
 public:
  /// `lines`: nullopt = sends nothing. `changed`: by a host that has lost the sonar.
  NorbitHost(std::optional<std::vector<NamedValues>> lines, protocol::ChangedSettings changed)
      : lines_(std::move(lines)), changed_(std::move(changed)) {
    for (auto& [name, setting] : changed_) setting.answers = 0;
  }

  /// Asks for the settings first, because the sonar keeps those of the host.
  HostActions on_open(std::span<const std::uint16_t>, Time now) override {
    begun_ = now;
    if (!lines_) return {};
    learns_until_ = now + learning;
    return ask();
  }
  HostActions on_bytes(std::size_t port, BytesView received, Time now) override {
    HostActions actions;
    if (!begun_) begun_ = now;
    if (port < kinds) received_at_[port] = now;
    if (port == command_port_index && lines_) return on_replies(received);
    auto& splitter = splitters_[std::min(port, splitters_.size() - 1)];  // a recording has the packets of all ports in one stream
    splitter.append(now, received);
    while (auto whole = splitter.next()) {
      if (auto bathymetry = read_bathymetry(whole->bytes)) {
        if (Parts* const parts = place_for(bathymetry->front.ping, of_bottom, whole->bytes.size(), now, actions))
          parts->bathymetry = std::move(bathymetry);
      } else if (auto column = read_column(whole->bytes)) {
        if (Parts* const parts = place_for(column->front.ping, of_column, whole->bytes.size(), now, actions)) {
          parts->column_bytes = std::move(whole->bytes);  // a move keeps the address, which `column` needs
          parts->column = std::move(column);
        }
      } else if (port == 1) {  // not counted at port 0, where a recording is one stream, also with replies to commands
        counts_.junk_bytes += whole->bytes.size();
      }
      show(std::nullopt, actions);
    }
    return actions;
  }
  /// Shows waiting pings. All ports have been read before a tick, even after a pause of the reader.
  HostActions on_tick(Time now) override {
    HostActions actions;
    if (learns_until_ && now >= *learns_until_) actions = begin();
    show(now, actions);
    return actions;
  }
  std::optional<Time> next_tick() const override {
    if (waiting_.empty()) return learns_until_;
    return std::min(learns_until_.value_or(Time::max()), given_up_at(waiting_.front()));
  }
  HostActions on_leave() override {
    if (!lines_) return {};
    const bool has_set = !std::exchange(learns_until_, std::nullopt);
    std::erase_if(*lines_, [&](const NamedValues& c) {
      protocol::ChangedSetting& setting = changed_[c.first];
      return has_set ? setting.answers == 0 && setting.before.empty() : !setting.ends_early();
    });
    leaves_ = !lines_->empty();
    return leaves_ ? ask() : HostActions{};
  }
  bool has_left() const override { return !leaves_ || have_answers(3); }
  protocol::ChangedSettings changed() const override { return changed_; }
  std::string about() const override { return "a Norbit"; }
  std::optional<Counts> counts() const override { return counts_; }

 private:
  static constexpr std::size_t command_port_index = std::size(host_ports) - 1;

  /// A name without values is a question.
  HostActions ask() const {
    std::string text;
    for (const auto& [name, values] : *lines_) text += name + "\r\n";
    return {protocol::HostSend{command_port_index, bytes_of(text)}};
  }
  HostActions begin() {
    learns_until_.reset();
    std::string text;
    for (const auto& [name, values] : *lines_) text.append(name).append(" ").append(values).append("\r\n");
    return {protocol::HostSend{command_port_index, bytes_of(text)}};
  }
  bool have_answers(int count) const {
    return std::ranges::all_of(*lines_, [&](const NamedValues& c) {
      const auto setting = changed_.find(c.first);
      return setting != changed_.end() && setting->second.answers >= count;
    });
  }

  /// Reads replies such as "set_range 0 10 # m". The sonar answers the commands in order.
  HostActions on_replies(BytesView received) {
    HostActions actions;
    for (const std::byte b : received) {
      const char c = std::to_integer<char>(b);
      if (c != '\n' && reply_.size() < longest_reply) reply_ += c;
      if (c != '\n') continue;
      const std::string line = std::exchange(reply_, {});
      const std::size_t space = line.find(' '), end = std::min(line.find_first_of("#\r"), line.size());
      if (space >= end) continue;
      const std::string name = line.substr(0, space);
      if (std::ranges::find(*lines_, name, &NamedValues::first) == lines_->end()) continue;
      if (const auto back = changed_[name].on_answer(line.substr(space + 1, end - space - 1)); back && leaves_)
        actions.emplace_back(protocol::HostSend{command_port_index, bytes_of(name + " " + *back + "\r\n")});
    }
    if (learns_until_ && have_answers(1)) std::ranges::move(begin(), std::back_inserter(actions));
    return actions;
  }

  enum Kind : std::size_t { of_bottom, of_column, kinds };  // packets, by their port
  struct Parts {
    std::uint32_t number = 0;
    Time since{};
    std::optional<Bathymetry> bathymetry;
    Bytes column_bytes;
    std::optional<Column> column;  // reads column_bytes
    std::size_t bytes = 0;
    bool has(Kind kind) const { return kind == of_column ? column.has_value() : bathymetry.has_value(); }
    bool is_whole() const { return bathymetry && column; }
    Kind missing() const { return bathymetry ? of_column : of_bottom; }
  };

  /// Returns the ping to which a packet belongs; null if the ping was shown without the packet.
  Parts* place_for(std::uint32_t number, Kind kind, std::size_t bytes, Time now, HostActions& actions) {
    ++counts_.messages;
    received_at_[kind] = now;
    if (shown_without_[kind].erase(number) > 0) {
      const char* const what = kind == of_column ? "water column" : "bathymetry";
      actions.emplace_back(protocol::Notice{format("the %s of ping %u came after the ping was shown", what, number)});
      return nullptr;
    }
    waiting_bytes_ += bytes;
    auto ping =
        std::find_if(waiting_.begin(), waiting_.end(), [&](const Parts& p) { return p.number == number && !p.has(kind); });
    if (ping == waiting_.end()) {
      const auto newest = std::find_if(waiting_.rbegin(), waiting_.rend(), [&](const Parts& p) { return p.has(kind); });
      ping = std::find_if(newest.base(), waiting_.end(), [&](const Parts& p) { return p.number > number; });
      ping = waiting_.emplace(ping);
      ping->number = number;
      ping->since = now;
    }
    ping->bytes += bytes;
    return &*ping;
  }

  /// Returns the time at which a ping is shown without its other packet. A port that has never sent a packet may be closed on
  /// purpose, so only the first pings wait for it.
  Time given_up_at(const Parts& ping) const {
    const std::optional<Time>& last = received_at_[ping.missing()];
    return (last ? std::max(*last, ping.since) : begun_.value_or(ping.since)) + patience;
  }

  /// Shows the complete pings. If a port has already sent the packet of a later ping, the earlier ping is not shown, because a
  /// slow reader loses different pings at each port. If the port is silent at `now`, or too many pings wait, the ping is shown
  /// incomplete.
  void show(std::optional<Time> now, HostActions& actions) {
    while (!waiting_.empty()) {
      Parts& ping = waiting_.front();
      const bool is_left_out = !ping.is_whole() && std::any_of(waiting_.begin() + 1, waiting_.end(),
                                                               [&](const Parts& p) { return p.has(ping.missing()); });
      if (!ping.is_whole() && !is_left_out) {
        const bool is_silent = now && *now >= given_up_at(ping);
        if (!is_silent && waiting_.size() <= most_waiting && waiting_bytes_ <= most_waiting_bytes) return;
        auto& shown = shown_without_[ping.missing()];
        shown.insert(ping.number);
        if (shown.size() > most_waiting) shown.erase(shown.begin());
      }
      waiting_bytes_ -= ping.bytes;
      if (!is_left_out) emit(std::make_shared<const Parts>(std::move(ping)), actions);
      waiting_.pop_front();
    }
  }
  /// Adds a ping, whose picture is decoded only on request.
  void emit(std::shared_ptr<const Parts> kept, HostActions& actions) {
    const Parts& parts = *kept;
    HostPing ping;
    SonarPicture seen{.kind = PictureKind::points, .image = {}};
    ping.facts.bits = 16;
    ping.facts.message_size = parts.bytes;
    if (parts.bathymetry) {
      const BathymetryFront& front = parts.bathymetry->front;
      seen.points = points_of(*parts.bathymetry);
      seen.detections = seen.points.size();
      ping.facts.number = front.ping;
      ping.facts.beams = front.beams;
      ping.facts.rows = 1;
      ping.facts.frequency_hz = static_cast<double>(front.frequency_hz);
      ping.fired_s = front.time_s;
      seen.elevation_rad = elevation_of(front.sonar_mode);
      double nearest_m = 0, farthest_m = 0;
      for (const auto& [azimuth, range_m] : seen.points) {
        nearest_m = nearest_m == 0 ? range_m : std::min(nearest_m, range_m);
        farthest_m = std::max(farthest_m, range_m);
      }
      ping.facts.row_m = ping.facts.range_m = farthest_m;
      ping.facts.note =
          seen.points.empty() ? "no bottom" : format("%zu points from %.2f to %.2f m", seen.points.size(), nearest_m, farthest_m);
    }
    std::optional<PolarImage> fan;
    if (parts.column) {
      const Column& column = *parts.column;
      const ColumnFront& front = column.front;
      ping.facts.number = front.ping;
      ping.facts.beams = front.beams;
      ping.facts.rows = front.samples;
      ping.facts.row_m = column.sample_m();
      ping.facts.range_m = (front.first_sample - 0.5 + static_cast<double>(front.samples)) * column.sample_m();
      ping.facts.frequency_hz = 1e3 * static_cast<double>(front.frequency_khz);
      ping.fired_s = front.time_s;
      seen.elevation_rad = elevation_of(front.sonar_mode);
      fan = fan_of(column);
      if (!fan) ping.errors.emplace_back("the directions of the beams do not rise, or its samples have no range");
    }
    if (last_ && ping.facts.number > *last_ + 1) counts_.missing_pings += ping.facts.number - *last_ - 1;
    if (last_ && ping.facts.number <= *last_)
      ping.errors.push_back("number " + std::to_string(ping.facts.number) + " after " + std::to_string(*last_));
    last_ = ping.facts.number;
    if (fan) shown_m_ = ping.facts.range_m;
    seen.column = fan ? SonarPicture::Column::sent : SonarPicture::Column::none;
    if (!fan) seen.image = protocol::empty_fan(rad_from_deg(swath_deg / 2), std::max(ping.facts.range_m, shown_m_));
    ping.picture = [kept, fan]() -> Result<PolarImage> {
      if (fan) return with_samples(*fan, *kept->column);
      return failure(ErrorKind::usage, "a picture needs the water column, port 2211: sonarctl listen prints the points");
    };
    ping.drawing = [kept = std::move(kept), fan = std::move(fan), seen = std::move(seen)] {
      SonarPicture drawn = seen;
      if (fan) drawn.image = with_samples(*fan, *kept->column);
      return drawn;
    };
    actions.emplace_back(std::move(ping));
  }

  std::optional<std::vector<NamedValues>> lines_;
  protocol::ChangedSettings changed_;  // by the name of the command
  std::optional<Time> learns_until_;   // set while the host waits for the settings that the sonar has
  bool leaves_ = false;
  std::string reply_;  // the beginning of a reply
  static recording::MessageSplitter splitter() { return {recording::Origin::device, framing}; }
  std::array<recording::MessageSplitter, 3> splitters_{splitter(), splitter(), splitter()};
  std::deque<Parts> waiting_;  // begins with a ping that lacks a packet
  std::size_t waiting_bytes_ = 0;
  std::optional<Time> begun_;
  std::array<std::optional<Time>, kinds> received_at_;
  std::array<std::set<std::uint32_t>, kinds> shown_without_;  // numbers of pings whose packet may still come
  double shown_m_ = usual_range_m;                            // far end of the last water column
  std::optional<std::uint32_t> last_;
  Counts counts_;
};

}  // namespace

Result<std::unique_ptr<protocol::Host>> make_host(const protocol::Wanted& wanted) {
  if (auto accepted = protocol::accept_settings(wanted, "a Norbit", {"range", "rate", "gain", "mode"}); !accepted)
    return tl::unexpected(accepted.error());
  if (wanted.settings.mode.value_or(0) > 0) return failure(ErrorKind::usage, "a Norbit has one mode only");
  // These settings are refused here, because the sonar would ignore them and ping with its present settings.
  for (const std::string& why :
       {protocol::range_complaint(wanted.settings.range_m.value_or(usual_range_m), "a Norbit", shortest_m, farthest_m),
        protocol::rate_complaint(wanted.settings, "a Norbit", models().front()->max_rate_hz)})
    if (!why.empty()) return failure(ErrorKind::usage, why);
  return std::make_unique<NorbitHost>(wanted.as_it_is ? std::nullopt : std::optional(lines_of(wanted.settings)), wanted.changed);
}

}  // namespace sonar::norbit
