// Joins attitudes and positions, which arrive in different messages, into whole poses by the time stamps of the sender.
// protocol/mavlink/mavlink_poses.hpp has one queue for local and one for satellite positions; both use the same attitudes.
#pragma once

#include <deque>
#include <optional>
#include <vector>

#include "protocol/mavlink/readings.hpp"

namespace sonar::mavlink {

/// The newest attitudes, in order of the sender's time.
class Attitudes {
 public:
  /// Two attitudes further apart than this are not interpolated; a position between them gets no attitude.
  static constexpr std::int64_t longest_gap_ms = 1000;
  /// The newest attitude is extrapolated by its angular rates for at most this time.
  static constexpr std::int64_t longest_carry_ms = 20;

  /// `later`: unknown until a newer reading arrives. `never`: the moment is before the first reading, or in a gap that is too
  /// long.
  enum class Answer { known, later, never };
  void put(const AttitudeReading& reading);
  void clear() { readings_.clear(); }
  bool empty() const { return readings_.empty(); }
  /// The attitude at a moment, interpolated between two readings or extrapolated from the newest. `out` is set only if `known`.
  Answer at(std::int64_t at_ms, AttitudeReading& out) const;

 private:
  static constexpr std::size_t most = 64;
  std::deque<AttitudeReading> readings_;
};

/// Positions that wait for an attitude at their time, the oldest first.
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
  /// The next position, in order of arrival, whose attitude is known. Drops positions whose attitude will never be known.
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
