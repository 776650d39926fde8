// Gain assist: the device changes its gain so that the loud parts of the picture stay just below full scale (docs/acoustics.md,
// section 7). This file contains the rule (a pure function) and the state that a device keeps between pings. Times are the
// times of pings.
#pragma once

#include "core/sonar/ping.hpp"

namespace sonar {

/// Gain assist chooses the gain for which 99 % of the samples are at most 97 % of full scale. No source states these two
/// values. They are fitted to the first two captured pings of an M1200d (246 and 247 of 254; the third has 243). The time
/// constant is our choice.
inline constexpr double assisted_share = 0.99, assisted_level = 0.97, assist_time_s = 0.3;
/// Assumed level of a saturated picture above full scale [dB]. The samples do not show the true level. The value is low for the
/// first saturated picture, so that the gain does not jump when a scene becomes louder. It doubles with each further
/// saturated picture in succession.
inline constexpr double least_overload_db = 1, most_overload_db = 12;
/// The whole range of the gain setting, 0 to 100 % (docs/protocols/oculus.md) [dB].
inline constexpr double least_assisted_gain_db = 0, most_assisted_gain_db = 96;

/// The code that the fraction `share` of a ping's samples does not exceed, divided by max_code: 0 to 1.
double percentile_of_full_scale(const Ping& ping, double share = assisted_share);

/// The gain [dB] at the time `passed_s` after a picture that was made with `gain_db`. The loud part of that picture reached the
/// fraction `level` of full scale, after the power law `gamma`. The gain approaches, as a first-order system, the value at
/// which that part would have reached assisted_level. `overload_db` is the assumed level of a saturated picture above full scale.
double next_gain_db(double gain_db, double level, double gamma, double passed_s, double overload_db = most_overload_db);

/// State of a device's gain. It begins at the client's gain. After a change of mode, or after the assist was off, it begins at
/// that gain again.
class GainAssist {
 public:
  /// The gain [dB] of a ping fired at `at`; the client's gain if settings.gain_assist is off or the samples are logarithmic.
  float gain_db(const PingSettings& settings, Time at);
  /// Call it with every ping that the device made. It ignores pings without gain assist.
  void look_at(const Ping& ping);

 private:
  bool on_ = false, has_seen_ = false;
  int mode_ = 0;
  double gain_db_ = 0, level_ = 0, gamma_ = 1, overload_db_ = 0;
  Time seen_at_{};
};

}  // namespace sonar
