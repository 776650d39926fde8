// Attitudes and places that arrive in different messages, joined by the sender's clock into whole poses.
// protocol/mavlink/mavlink_poses.hpp keeps one for local and one for satellite positions; both see the same attitudes.
#pragma once

#include <deque>
#include <optional>
#include <vector>

#include "protocol/mavlink/readings.hpp"

namespace sonar::mavlink {

/// The newest attitudes, by their own time.
class Attitudes {
 public:
  /// Longest time between two attitudes that are interpolated. An attitude older than this is too old for a position.
  static constexpr std::int64_t longest_gap_ms = 1000;
  /// Limit of extrapolation of the newest attitude by its rates.
  static constexpr std::int64_t longest_carry_ms = 20;

  enum class Answer { known, later, never };
  void put(const AttitudeReading& reading);
  void clear() { readings_.clear(); }
  bool empty() const { return readings_.empty(); }
  /// The attitude at a moment: interpolated, or extrapolated for a short time. `later`: needs the next reading.
  Answer at(std::int64_t at_ms, AttitudeReading& out) const;

 private:
  static constexpr std::size_t most = 64;
  std::deque<AttitudeReading> readings_;
};

/// Positions that wait for their attitude.
template <class Place>
class PairedPlaces {
 public:
  struct Paired {
    AttitudeReading attitude;
    Place place;
  };
  void put(const Place& place) {
    waiting_.push_back(place);
    if (waiting_.size() > most) waiting_.pop_front();
  }
  void clear() { waiting_.clear(); }
  /// The next position with a known attitude, in order of arrival.
  std::optional<Paired> next(const Attitudes& attitudes) {
    while (!waiting_.empty()) {
      Paired paired;
      const Attitudes::Answer answer = attitudes.at(waiting_.front().at_ms, paired.attitude);
      if (answer == Attitudes::Answer::later) return std::nullopt;
      paired.place = waiting_.front();
      waiting_.pop_front();
      if (answer == Attitudes::Answer::known) return paired;
    }
    return std::nullopt;
  }

 private:
  static constexpr std::size_t most = 16;
  std::deque<Place> waiting_;
};

}  // namespace sonar::mavlink
