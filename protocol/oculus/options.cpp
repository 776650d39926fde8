#include "protocol/oculus/settings.hpp"

#include <array>

#include "core/base/geometry.hpp"
#include "core/text/format.hpp"

namespace sonar::oculus {
namespace {

const std::array<protocol::Option, 22> option_rows{{
    {option_name::before_first_fire,
     {"dummies", "pings"},
     "dummies",
     "messages to a client before its first fire message; pings have the stored configuration and version 0"},
    {option_name::gain_echo,
     {"auto", "verbatim", "mapped", "used"},
     "auto",
     "gain in the echo: auto = 40 + 0.6 g in mode 2 with flag bit 4 clear, mapped = in mode 2 always, verbatim = never; "
     "used = as auto, but with gain assist the gain used, which no client expects"},
    {option_name::gain_assist,
     {"flag_set", "flag_clear", "off"},
     "flag_set",
     "which state of flag bit 4 leaves the gain to the device"},
    {option_name::row_gain,
     {"digital", "tvg"},
     "digital",
     "what row gains state: digital = the gain used + 20 log r, tvg = the time-varied gain over that of the first row, which "
     "samples over its root undo"},
    {option_name::pulse,
     {"rows", "native"},
     "rows",
     "pulse width: rows = 0.9 row spacings (M1200d, mode 2: 0.71), native = 2.5 mm at every range and the mean power of a row"},
    {option_name::ping_start_time_unit,
     {"nanoseconds", "microseconds"},
     "nanoseconds",
     "unit of the free-running 32-bit counter in version-1 pings"},
    {option_name::honour_network_speed,
     {"false", "true"},
     "false",
     "true lowers the ping rate to the Mbit/s that the client requested"},
    {option_name::reply_version,
     {"mirror", "0", "1", "2"},
     "mirror",
     "version of ping results: that of the fire message, or always this one"},
    {option_name::out_of_range,
     {"clamp", "ignore"},
     "clamp",
     "settings outside the model's limits: use the nearest valid ones, or ignore the whole message"},
    {option_name::user_config_write,
     {"silent", "reply"},
     "silent",
     "answer to a written user configuration: none, or the stored values"},
    {option_name::status_bit7, {"clear", "set"}, "clear", "bit 7 (\"main\" connection) of the status word"},
    {option_name::row_rate_hz,
     {},
     "262237.76223776224",
     "sample rate that determines the row spacing; 37.5 MHz / 143 in the capture",
     1e4,
     1e7},
    {option_name::row_origin,
     {"middle", "near_edge", "far_edge"},
     "middle",
     "range of row i, in resolutions: i + 0.5, i, or i + 1"},
    {option_name::dummy_period_ms, {}, "1000", "silence until a dummy message, before a fire message and in standby", 10, 60000},
    {option_name::boot_text,
     {"if_silent", "off", "on"},
     "if_silent",
     "a log message (0x80) to a client that connects: after 2 s without a fire message or a ping, never, or at once"},
    {option_name::lf_aperture_deg, {}, "product", "horizontal aperture of the low frequency, degrees", 5, 170},
    {option_name::hf_aperture_deg, {}, "product", "horizontal aperture of the high frequency, degrees", 5, 170},
    {option_name::lf_azimuth_width_deg, {}, "product", "-3 dB width of a low-frequency beam in azimuth, degrees", 0.1, 10},
    {option_name::hf_azimuth_width_deg, {}, "product", "-3 dB width of a high-frequency beam in azimuth, degrees", 0.1, 10},
    {option_name::lf_elevation_width_deg, {}, "product", "-3 dB width in elevation of the low frequency, degrees", 1, 60},
    {option_name::hf_elevation_width_deg, {}, "product", "-3 dB width in elevation of the high frequency, degrees", 1, 60},
    {option_name::elevation_width_is,
     {"two_way", "one_way"},
     "two_way",
     "pattern that has the elevation width: transmit times receive, or one of them"},
}};

float& aperture(FrequencyMode& mode) { return mode.horizontal_aperture_rad; }
float& azimuth_width(FrequencyMode& mode) { return mode.pattern.azimuth_width_rad; }
float& elevation_width(FrequencyMode& mode) { return mode.pattern.elevation_width_rad; }

struct Figure {
  std::string_view option;
  std::size_t mode;
  float& (*of)(FrequencyMode&);
};
constexpr Figure figures[] = {
    {option_name::lf_aperture_deg, 0, aperture},
    {option_name::hf_aperture_deg, 1, aperture},
    {option_name::lf_azimuth_width_deg, 0, azimuth_width},
    {option_name::hf_azimuth_width_deg, 1, azimuth_width},
    {option_name::lf_elevation_width_deg, 0, elevation_width},
    {option_name::hf_elevation_width_deg, 1, elevation_width},
};

}  // namespace

std::span<const protocol::Option> options() { return option_rows; }

// docs_test.cpp compares the page with this table, so that an option without a row fails.
std::string options_table() {
  std::string text;
  for (const protocol::Option& option : option_rows) {
    const std::string values = option.allowed.empty() ? protocol::numbers_of(option) : text::joined(option.allowed);
    text.append("| `").append(option.name).append("` | ").append(values).append(" | ").append(option.default_value);
    text.append(" | ").append(option.meaning).append(" |\n");
  }
  return text;
}

// A product of one frequency has only the lf_ options. An hf_ option, which would have no effect, is an error.
Result<std::shared_ptr<const SonarModel>> tuned(std::shared_ptr<const SonarModel> model, const protocol::OptionValues& options) {
  SonarModel changed = *model;
  bool any = false;
  for (const Figure& figure : figures) {
    const auto deg = given_number(options, figure.option);
    if (!deg) continue;
    if (figure.mode >= changed.modes.size())
      return failure(ErrorKind::config, "option " + std::string(figure.option) + ": " + changed.name +
                                            " has one frequency only, set the lf_ figure instead");
    figure.of(changed.modes[figure.mode]) = static_cast<float>(rad_from_deg(*deg));
    any = true;
  }
  if (text_option(options, option_name::elevation_width_is) == "one_way") {
    for (FrequencyMode& mode : changed.modes) mode.pattern.elevation_width_is = ElevationWidthIs::one_way;
    any = true;
  }
  if (!any) return model;
  return std::make_shared<const SonarModel>(std::move(changed));
}

}  // namespace sonar::oculus
