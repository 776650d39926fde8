#include <algorithm>
#include <iterator>
#include <nlohmann/json.hpp>
#include <utility>

#include "core/text/format.hpp"
#include "protocol/dvl/dvl.hpp"
#include "protocol/dvl/reports.hpp"
#include "protocol/line_pictures.hpp"

namespace sonar::dvl {
namespace {

using protocol::HostActions;
using protocol::HostPing;

constexpr std::string_view title = "a DVL";
constexpr std::size_t points = 200;  // points of a line of the waterfall
constexpr float silent_db = -2000;   // below every echo, so that lines without an echo are dark

constexpr auto learning = std::chrono::milliseconds(2500);  // longest wait for the settings that the device has
constexpr const char *acoustics = "acoustic_enabled", *range_mode_name = "range_mode";

Bytes get_config() { return line_of(R"({"command":"get_config"})"); }

Bytes set_config(const nlohmann::ordered_json& parameters) {
  return line_of(nlohmann::ordered_json{{"command", "set_config"}, {"parameters", parameters}}.dump());
}

/// Makes the parameters that the host sets.
nlohmann::ordered_json parameters_of(const protocol::SettingsOverride& wanted, const Product& product) {
  return {{acoustics, wanted.rate_hz.value_or(1) > 0},
          {range_mode_name, wanted.range_m ? range_mode_for(*wanted.range_m, product) : "auto"}};
}

/// Returns the reach of the shortest range mode that covers the distance. The picture has this range, so that its scale is
/// steady.
double window_m(double distance_m) {
  double far_m = 0;
  for (const auto& model : models())  // reports do not have the model
    for (int mode = 0; mode < range_mode_count; ++mode) {
      far_m = range_mode(mode, product_of(*model)).highest_m / altitude_per_distance;
      if (distance_m <= far_m) return far_m;
    }
  return far_m;
}

class DvlHost final : public protocol::Host {
 public:
  explicit DvlHost(const protocol::Wanted& wanted) {
    if (!wanted.as_it_is) parameters_ = parameters_of(wanted.settings, product_);
    changed_ = wanted.changed;
    for (auto& [name, setting] : changed_) setting.answers = 0;
    if (wanted.settings.range_m) window_m_ = window_m(*wanted.settings.range_m / altitude_per_distance);
  }
  /// Asks for the settings first, because the device keeps those of the host.
  HostActions on_open(std::span<const std::uint16_t>, Time now) override {
    if (!parameters_) return {};
    learns_until_ = now + learning;
    return {protocol::HostSend{0, get_config()}};
  }
  HostActions on_tick(Time now) override { return learns_until_ && now >= *learns_until_ ? begin() : HostActions{}; }
  std::optional<Time> next_tick() const override { return learns_until_; }
  /// Reads reports, which end with CR LF. A line that is too long is dropped, and reading continues after the next line end.
  HostActions on_bytes(std::size_t, BytesView received, Time now) override {
    HostActions actions;
    for (const std::byte b : received) {
      line_.push_back(b);
      if (b == std::byte{'\n'}) {
        on_line(actions, now);
        line_.clear();
      } else if (line_.size() > longest_line) {
        line_.clear();
      }
    }
    return actions;
  }
  HostActions on_leave() override {
    if (!parameters_) return {};
    const bool has_set = !std::exchange(learns_until_, std::nullopt);
    leaves_ = has_set && answers() > 0;
    for (auto& [name, setting] : changed_) leaves_ = (has_set ? !setting.before.empty() : setting.ends_early()) || leaves_;
    return leaves_ ? HostActions{protocol::HostSend{0, get_config()}} : HostActions{};
  }
  bool has_left() const override { return !leaves_ || answers() >= 3; }
  protocol::ChangedSettings changed() const override { return changed_; }
  std::string about() const override { return std::string(title); }

 private:
  void on_line(HostActions& actions, Time now) {
    const Line line = read_line(line_);
    if (line.velocity) actions.emplace_back(ping_from(line.velocity->measured, now));
    if (line.response && line.response->to == "get_config" && line.response->acoustics && parameters_)
      on_settings(*line.response, actions);
    if (line.response && !line.response->success && line.response->to != "get_config")
      actions.emplace_back(Error{ErrorKind::usage, "the DVL refuses " + line.response->to + ": " + line.response->error});
  }

  /// Sets the parameters, and asks what the device made of them.
  HostActions begin() {
    learns_until_.reset();
    return {protocol::HostSend{0, set_config(*parameters_)}, protocol::HostSend{0, get_config()}};
  }

  int answers() const {
    const auto setting = changed_.find(range_mode_name);
    return setting != changed_.end() ? setting->second.answers : 0;
  }
  void on_settings(const Response& found, HostActions& actions) {
    nlohmann::ordered_json back;
    if (const auto value = changed_[acoustics].on_answer(found.acoustics.value_or(false) ? "true" : "false"))
      back[acoustics] = *value == "true";
    if (const auto value = changed_[range_mode_name].on_answer(found.range_mode)) back[range_mode_name] = *value;
    if (leaves_ && !back.empty()) actions.emplace_back(protocol::HostSend{0, set_config(back)});
    if (learns_until_) std::ranges::move(begin(), std::back_inserter(actions));
  }

  HostPing ping_from(const Measurement& report, Time now) {
    double farthest_m = 0;
    for (const Beam& beam : report.beams)
      if (beam.is_valid) farthest_m = std::max(farthest_m, beam.distance_m);
    const double range_m = std::max(window_m(farthest_m), window_m_), row_m = range_m / points;
    HostPing ping;
    ping.facts = {++number_, beam_count, 1, 32, range_m, range_m, product_.centre_hz, line_.size()};
    ping.facts.note = report.is_valid ? text::format("velocity %.3f %.3f %.3f m/s, altitude %.2f m", report.velocity_mps.x,
                                                     report.velocity_mps.y, report.velocity_mps.z, report.altitude_m)
                                      : "no velocity";
    if (report.reflected_at > Time{}) ping.fired_s = seconds(report.reflected_at.time_since_epoch());
    ping.picture = []() -> Result<PolarImage> {
      return failure(ErrorKind::usage, "the report of a DVL is not a picture: sonarctl listen prints its velocities");
    };
    std::vector<float> echoes(points, silent_db);
    for (const Beam& beam : report.beams) {
      if (!beam.is_valid || !(beam.distance_m >= 0 && beam.distance_m < range_m)) continue;
      float& point = echoes[static_cast<std::size_t>(beam.distance_m / row_m)];
      point = std::max(point, static_cast<float>(std::clamp(beam.rssi_dbm, -200.0, 200.0)));
    }
    waterfall_.add(std::move(echoes), 0, row_m, now, ping);
    ping.drawing = [waterfall = std::move(ping.drawing),
                    valid = static_cast<std::size_t>(std::ranges::count_if(report.beams, &Beam::is_valid))] {
      SonarPicture seen = waterfall();
      seen.detections = valid;
      return seen;
    };
    return ping;
  }

  const Product& product_ = product_of(*models().front());  // the first product, because reports do not name the model
  std::optional<nlohmann::ordered_json> parameters_;        // nullopt: this host sends nothing
  protocol::ChangedSettings changed_;                       // by the name of the parameter
  std::optional<Time> learns_until_;                        // set while the host waits for the settings that the device has
  bool leaves_ = false;
  double window_m_ = 0;  // least range of the picture, from the wanted range
  Bytes line_;
  std::uint32_t number_ = 0;
  protocol::Waterfall waterfall_;
};

}  // namespace

// The device has no command for rate and gain, which it determines itself.
Result<std::unique_ptr<protocol::Host>> make_host(const protocol::Wanted& wanted) {
  if (auto accepted = protocol::accept_settings(wanted, title, {"range", "rate", "mode"}); !accepted)
    return tl::unexpected(accepted.error());
  if (wanted.settings.mode.value_or(0) > 0) return failure(ErrorKind::usage, "a DVL has one mode only");
  if (wanted.settings.rate_hz.value_or(0) > 0)
    return failure(ErrorKind::usage, "a DVL sets its rate by altitude: leave --rate out, or give --rate standby");
  return std::make_unique<DvlHost>(wanted);
}

}  // namespace sonar::dvl
