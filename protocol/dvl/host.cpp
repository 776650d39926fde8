#include <algorithm>
#include <nlohmann/json.hpp>

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

Bytes set_config(bool acoustics, const std::string& range_mode) {
  const nlohmann::ordered_json message{{"command", "set_config"},
                                       {"parameters", {{"acoustic_enabled", acoustics}, {"range_mode", range_mode}}}};
  return line_of(message.dump());
}

/// Makes the commands. The first reads the settings that on_leave() restores, because the device would keep ours.
Bytes request(const protocol::SettingsOverride& wanted, const Product& product) {
  Bytes all = line_of(R"({"command":"get_config"})");
  const Bytes ours =
      set_config(wanted.rate_hz.value_or(1) > 0, wanted.range_m ? range_mode_for(*wanted.range_m, product) : "auto");
  all.insert(all.end(), ours.begin(), ours.end());
  return all;
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
    if (!wanted.as_it_is) request_ = request(wanted.settings, product_);
    if (wanted.settings.range_m) window_m_ = window_m(*wanted.settings.range_m / altitude_per_distance);
  }
  HostActions on_open(std::span<const std::uint16_t>, Time) override {
    if (!request_) return {};
    return {protocol::HostSend{0, *request_}};
  }
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
    if (!before_ || !before_->acoustics) return {};
    return {protocol::HostSend{0, set_config(*before_->acoustics, before_->range_mode)}};
  }
  std::string about() const override { return std::string(title); }

 private:
  void on_line(HostActions& actions, Time now) {
    const Line line = read_line(line_);
    if (line.velocity) actions.emplace_back(ping_from(line.velocity->measured, now));
    if (line.response && request_ && line.response->to == "get_config" && !before_) before_ = line.response;
    if (line.response && !line.response->success && line.response->to != "get_config")
      actions.emplace_back(Error{ErrorKind::usage, "the DVL refuses " + line.response->to + ": " + line.response->error});
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
  std::optional<Bytes> request_;
  std::optional<Response> before_;  // settings that the device had
  double window_m_ = 0;             // least range of the picture, from the wanted range
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
