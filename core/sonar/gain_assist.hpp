// Gain assist: the device turns its own gain so that the loud parts of the picture just stay below full scale (docs/acoustics.md,
// section 7). A pure rule and the little a device remembers between two pings; time is the pings' own.
#pragma once

#include "core/sonar/ping.hpp"

namespace sonar {

/// The loud part of a picture and where it should lie: 99 % of the samples at most 97 % of full scale. unknown: fitted to the
/// first two captured pings of an M1200d (246 and 247 of 254); the third has 243. The time: chosen.
inline constexpr double assisted_share = 0.99, assisted_level = 0.97, assist_time_s = 0.3;
/// How far above full scale a saturated picture is taken to be, which it does not say [dB]: the first little, so that a scene
/// that grows louder causes no steps; each further one in a row twice as far.
inline constexpr double least_overload_db = 1, most_overload_db = 12;
/// The knob's whole range, 0 to 100 % (docs/protocols/oculus.md) [dB].
inline constexpr double least_assisted_gain_db = 0, most_assisted_gain_db = 96;

/// The code that `share` of a ping's samples do not exceed, as a part of max_code, 0 to 1.
double percentile_of_full_scale(const Ping& ping, double share = assisted_share);

/// The gain `passed_s` after a picture made with `gain_db` whose loud part was `level` of full scale (after the power law
/// `gamma`): a first-order approach to the gain that would have put it at assisted_level. `overload_db`: of a saturated picture.
double next_gain_db(double gain_db, double level, double gamma, double passed_s, double overload_db = most_overload_db);

/// State of a device's gain. Starts from the client's gain, and again whenever the mode changes or the assist was off.
class GainAssist {
 public:
  /// The gain [dB] of a ping fired at `at`; the client's own when settings.gain_assist is off, or the samples
  /// are logarithmic.
  float gain_db(const PingSettings& settings, Time at);
  /// Every ping that came out. Pings without the assist are not looked at.
  void look_at(const Ping& ping);

 private:
  bool on_ = false, has_seen_ = false;
  int mode_ = 0;
  double gain_db_ = 0, level_ = 0, gamma_ = 1, overload_db_ = 0;
  Time seen_at_{};
};

}  // namespace sonar
