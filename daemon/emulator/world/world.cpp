#include "daemon/emulator/world/world.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/motion/trajectory.hpp"

namespace sonar {
namespace {
// Samples that are closer in time give no speed, because the difference of their stamps is mostly jitter.
constexpr std::chrono::nanoseconds shortest_difference = std::chrono::milliseconds(1);
}  // namespace

void PoseHistory::put(const Sample& sample) {
  if (!samples_.empty() && samples_.back().at == sample.at) {
    samples_.back() = sample;
    return;
  }
  samples_.push_back(sample);
  while (samples_.size() > most_samples || (samples_.size() > 2 && sample.at - samples_.front().at > length))
    samples_.pop_front();
}

PoseHistory::Motion PoseHistory::between(const Sample& before, const Sample& after) {
  const auto gap = after.at - before.at;
  if (gap < shortest_difference) return {};
  const double per_s = 1 / seconds(gap);
  return {per_s * (after.pose.position_m - before.pose.position_m),
          per_s * rotation_between(before.pose.orientation, after.pose.orientation)};
}

/// Returns the velocities from the sender, else the difference of the last two poses. After a jump the motion is zero, because a
/// vehicle that was moved elsewhere stays there.
PoseHistory::Motion PoseHistory::newest_motion() const {
  const Sample& last = samples_.back();
  Motion motion;
  if (samples_.size() > 1) motion = between(samples_[samples_.size() - 2], last);
  if (motion::is_jump(motion.velocity_mps, motion.angular_velocity_radps)) motion = {};
  if (last.velocity_mps) motion.velocity_mps = rotate(last.pose.orientation, *last.velocity_mps);
  if (last.angular_velocity_radps) motion.angular_velocity_radps = *last.angular_velocity_radps;
  return motion;
}

Pose PoseHistory::beyond_newest(std::chrono::nanoseconds ahead) const {
  const Sample& last = samples_.back();
  const double ahead_s = seconds(ahead);
  const Motion motion = newest_motion();
  return {last.pose.position_m + ahead_s * motion.velocity_mps,
          normalized(last.pose.orientation * turned_by(ahead_s * motion.angular_velocity_radps))};
}

PoseHistory::Samples::const_iterator PoseHistory::not_before(Time t) const {
  return std::lower_bound(samples_.begin(), samples_.end(), t, [](const Sample& s, Time x) { return s.at < x; });
}

/// Returns zero where at() holds a pose, so that pose and motion agree.
PoseHistory::Motion PoseHistory::motion_at(Time t, std::chrono::nanoseconds extrapolate_max) const {
  if (t - samples_.back().at > extrapolate_max || t < samples_.front().at) return {};
  const auto after = not_before(t);
  if (after == samples_.end() || (after->at == t && after + 1 == samples_.end())) return newest_motion();
  return after->at == t ? between(*after, *(after + 1)) : between(*(after - 1), *after);
}

Pose PoseHistory::at(Time t, std::chrono::nanoseconds extrapolate_max) const {
  const auto after = not_before(t);
  if (after == samples_.end()) return beyond_newest(std::min<std::chrono::nanoseconds>(t - samples_.back().at, extrapolate_max));
  if (after->at == t || after == samples_.begin()) return after->pose;
  const Sample& a = *(after - 1);
  const Sample& b = *after;
  const double u = seconds(t - a.at) / seconds(b.at - a.at);
  return {a.pose.position_m + u * (b.pose.position_m - a.pose.position_m), slerp(a.pose.orientation, b.pose.orientation, u)};
}

namespace {

using control::ClockDomain;
using control::PoseSample;

constexpr double hidden_height_m = 1e4;  // far beyond any sonar's range, but near enough for exact placement
constexpr double smallest_orbit_m = 4;
constexpr double orbit_speed_mps = 0.5;
constexpr std::chrono::nanoseconds future_allowed = std::chrono::seconds(1);
constexpr std::chrono::nanoseconds most_out_of_order = std::chrono::seconds(1);  // if older, the clock was set back

std::string joined_names(const std::vector<std::string>& names) {
  std::string all;
  for (const std::string& n : names) all += (all.empty() ? "" : ", ") + n;
  return all.empty() ? "none" : all;
}

}  // namespace

World::World(PoseRules rules, std::vector<BodyStart> vehicles, std::vector<BodyStart> objects, Time start)
    : rules_(rules), start_(start) {
  use_vehicles(std::move(vehicles), start);
  use_objects(std::move(objects), start);
}

void World::use_vehicles(std::vector<BodyStart> vehicles, Time now) { vehicles_ = taken_over(vehicles_, vehicles, now); }
void World::use_objects(std::vector<BodyStart> objects, Time now) { objects_ = taken_over(objects_, objects, now); }

/// Makes the tracks for new bodies. Bodies with a known name keep their poses. A new body begins with a full allowance; a changed
/// trajectory begins now.
std::vector<World::Track> World::taken_over(std::vector<Track>& old, std::vector<BodyStart>& bodies, Time now) const {
  std::vector<Track> tracks;
  for (BodyStart& b : bodies) {
    const auto known = std::find_if(old.begin(), old.end(), [&](const Track& t) { return t.body.name == b.name; });
    Track t;
    if (known != old.end()) {
      t = std::move(*known);
    } else {
      t.allowance = rules_.burst;
      t.allowance_at = start_;
    }
    if (t.history.empty()) t.source = b.plan ? "trajectory " + b.plan.file : b.orbits ? "demo orbit" : "initial pose";
    if (b.plan && !motion::is_same(t.body.plan, b.plan)) t.playback = {b.plan.trajectory->duration(), b.plan.rules, now};
    t.body = std::move(b);
    tracks.push_back(std::move(t));
  }
  return tracks;
}

World::Track* World::find(PoseSample::Of of, const std::string& name, std::string& refusal) {
  const bool vehicle = of == PoseSample::Of::vehicle;
  std::vector<Track>& tracks = vehicle ? vehicles_ : objects_;
  if (name.empty() && tracks.size() == 1) return &tracks.front();
  std::vector<std::string> names;
  for (Track& t : tracks) {
    if (!name.empty() && t.body.name == name) return &t;
    names.push_back(t.body.name);
  }
  const std::string kind = vehicle ? "vehicle" : "moving object";
  refusal = name.empty() ? "the message names no " + kind +
                               ", which is allowed only if there is exactly one; known: " + joined_names(names)
                         : "no " + kind + " is called \"" + name.substr(0, 64) + "\"; known: " + joined_names(names);
  return nullptr;
}

/// True if a pose continues the body's history: it has the same sender and kind of time stamp, and follows no long silence.
bool World::continues(const Track& track, const PoseSample& sample, const Sender& sender, Time at, Time now) const {
  const bool known = !track.history.empty() && track.sender_id == sender.id && track.domain == sample.stamp.domain;
  if (!known) return false;
  // With `clock: follow`, time stops while no stamps arrive, so silence cannot be detected. A stamp far before the newest one
  // means that the sender's clock was set back, or that the simulator has restarted.
  const Time newest = track.history.newest().at;
  if (rules_.follows) return at >= newest - rules_.stale_after;
  const bool is_set_back = has_own_clock(sample) && at < newest - most_out_of_order;
  return !is_set_back && now - track.last_arrival <= rules_.stale_after;
}

/// Stores the previous sender if a pose has another one, and returns true once while two senders alternate.
bool World::has_rival(Track& track, const Sender& sender, Time now) const {
  const bool silent = now - track.last_arrival > rules_.stale_after;
  if (silent) {
    track.earlier_sender_id.clear();
    track.rival_reported = false;
  }
  if (track.sender_id == sender.id) return false;
  const bool alternate = track.earlier_sender_id == sender.id;
  track.earlier_sender_id = silent ? std::string() : track.sender_id;
  return alternate && !std::exchange(track.rival_reported, true);
}

/// Returns the offset of the sender's clock, from the least delay so far. A delay that grows by more than extrapolate_max is a
/// jump of that clock.
World::Ns World::offset_for(const Track& track, Time at, Time now, bool goes_on) {
  if (rules_.follows) return followed_offset_for(track, at, now);
  const Ns offset = now - at;
  const bool keep = goes_on && offset >= track.offset && offset - track.offset <= rules_.extrapolate_max;
  return keep ? track.offset : offset;
}

/// Takes one pose from the allowance. Returns true if none was left.
bool World::over_rate(Track& track, Time now) const {
  if (rules_.stepped) return false;
  const double refill = rules_.most_per_s * seconds(now - track.allowance_at);
  track.allowance = std::min(rules_.burst, track.allowance + std::max(0.0, refill));
  track.allowance_at = now;
  if (track.allowance < 1) return true;
  track.allowance -= 1;
  return false;
}

/// Called before anything is changed, so that a refused pose changes nothing.
std::string World::why_bad_time(const PoseSample& sample, Time at, Time now) const {
  if (has_shared_clock(sample) && (at > now + future_allowed || at < now - rules_.stale_after - future_allowed))
    return "WALL time stamp is " + std::to_string(seconds(at - now)) +
           " s from this computer's clock: synchronise the clocks, or send SIM or ARRIVAL time";
  if (rules_.follows && sample.of == PoseSample::Of::vehicle && sample.stamp.domain == ClockDomain::arrival)
    return "it has no time stamp, which clock: follow needs; send SIM or WALL time";
  return {};
}

/// Refuses a late pose, which is not inserted. A jump clears the history, so that nothing is interpolated across it.
bool World::is_next(Track& track, const PoseSample& sample, Time at, PoseOutcome& out) {
  const bool seq_is_old = sample.seq != 0 && track.seq != 0 && sample.seq <= track.seq;
  if (seq_is_old || at < track.history.newest().at) {
    ++counters_.late;
    out.verdict = PoseVerdict::late;
    out.refusal = "pose came out of order";
    return false;
  }
  if (at == track.history.newest().at) ++counters_.replaced;
  if (length(sample.pose.position_m - track.history.newest().pose.position_m) > rules_.max_jump_m) {
    ++counters_.jumps;
    out.notice = "pose of " + track.body.name + " jumped further than max_jump_m: history cleared";
    track.history.clear();
  }
  return true;
}

/// Checks name, time stamp, continuity and clock offset in this order, then keeps the pose. A pose that is refused or late only
/// changes a counter.
PoseOutcome World::accept(const PoseSample& sample, const Sender& sender, Time now) {
  PoseOutcome out;
  Track* const found = find(sample.of, sample.name, out.refusal);
  if (found == nullptr) {
    ++counters_.refused;
    out.verdict = PoseVerdict::unknown_name;
    return out;
  }
  Track& track = *found;
  const Time at = sample.stamp.domain == ClockDomain::arrival ? now : Time(Ns(sample.stamp.ns));
  out.refusal = why_bad_time(sample, at, now);
  if (!out.refusal.empty()) {
    ++counters_.refused;
    out.verdict = PoseVerdict::bad_time;
    return out;
  }

  const bool is_known = continues(track, sample, sender, at, now);
  const bool goes_on = is_known && sample.reset_counter == track.reset_counter;
  if (!goes_on) {
    ++(is_known ? counters_.resets : counters_.histories);
    track.history.clear();
  } else if (!is_next(track, sample, at, out)) {
    return out;
  }

  const Ns offset = has_own_clock(sample) ? offset_for(track, at, now, goes_on) : Ns(0);
  const bool vehicle = sample.of == PoseSample::Of::vehicle;  // poses of objects may be rare
  if (rules_.follows && vehicle && offset != track.offset && track.sender_id == sender.id)
    out.notice = "stamps of " + track.body.name +
                 " do not continue from the last one: they are shifted, and sonard's time continues without a jump";
  track.offset = offset;

  if (has_rival(track, sender, now)) {
    out.notice = track.body.name + " receives poses from two senders in turns, " + track.sender_id + " and " + sender.id +
                 ": let only one of them send";
  } else if (track.source != sender.source) {
    out.notice = "pose source of " + track.body.name + " changed: " + track.source + " -> " + sender.source +
                 (sample.fields.empty() ? "" : "; fields: " + sample.fields) + " (" +
                 std::string(control::name_of(sample.sent_in)) + ")";
  } else if (track.stale_reported) {
    out.notice = "poses of " + track.body.name + " are back";
  }
  if (!out.notice.empty()) out.body = track.body.name;
  keep(track, sample, sender, at, now);
  return out;
}

/// Stores a pose, ends the state "stale", and hides or shows the body as the pose requests.
void World::keep(Track& track, const PoseSample& sample, const Sender& sender, Time at, Time now) {
  track.source = sender.source;
  track.sender_id = sender.id;
  track.seq = sample.seq;
  track.reset_counter = sample.reset_counter;
  track.domain = sample.stamp.domain;
  track.last_arrival = now;
  track.hidden = sample.hidden;
  track.hidden_for_now = false;
  track.stale_reported = false;
  const PoseHistory::Sample kept{at, sample.pose, sample.velocity_mps, sample.angular_velocity_radps};
  // A pose above the rate limit replaces the newest one, so that the history stays short and up to date.
  if (over_rate(track, now) && !track.history.empty()) {
    ++counters_.over_rate;
    track.history.replace_newest(kept);
  } else {
    track.history.put(kept);
  }
  ++counters_.accepted;
}

void World::show_again() {
  for (Track& t : objects_)
    if (std::exchange(t.hidden_for_now, false)) t.hidden = false;
}

bool World::is_stale(const Track& track, Time now) const {
  return !track.history.empty() && now - last_news(track) > rules_.stale_after;
}

Time World::last_news(const Track& track) const {
  return rules_.follows ? track.history.newest().at + track.offset : track.last_arrival;
}

std::vector<World::Stale> World::newly_stale(Time now) {
  std::vector<Stale> sentences;
  for (Track& t : vehicles_) {  // only vehicles, because objects may rest, but if a vehicle gets no poses, a link is broken
    if (t.stale_reported || !is_stale(t, now)) continue;
    t.stale_reported = true;
    ++counters_.stale;
    const auto silent = std::chrono::duration_cast<std::chrono::milliseconds>(now - last_news(t));
    sentences.push_back(
        {t.body.name, "no pose for " + t.body.name + " from " + t.source + " for " + std::to_string(silent.count()) + " ms"});
  }
  return sentences;
}

/// Returns the first of these that applies: a place far above the scene (hidden), received poses, a trajectory, the orbit of the
/// demo, the initial pose. If no pose has arrived for stale_after, a body returns to its newest received pose, without
/// extrapolation.
Pose World::pose_at(const Track& track, Time t) const {
  if (track.hidden) return {{0, 0, hidden_height_m}, {}};
  if (!track.history.empty()) {
    const Time at = t - track.offset;
    if (at - track.history.newest().at > rules_.stale_after) return track.history.newest().pose;
    return track.history.at(at, rules_.extrapolate_max);
  }
  if (track.body.plan) return played(track, t).body_in_world;
  return track.body.orbits ? orbit(track.body.initial_pose, t) : track.body.initial_pose;
}

Pose World::orbit(const Pose& initial, Time t) const {
  const Vec3d p = initial.position_m;
  const double radius_m = std::max(smallest_orbit_m, std::hypot(p.x, p.y));
  const double angle = std::atan2(p.y, p.x) + orbit_speed_mps / radius_m * seconds(t - start_);
  const RollPitchYaw inward{0, 0, angle + pi};  // the sonar points across the centre of the world
  return {{radius_m * std::cos(angle), radius_m * std::sin(angle), p.z}, quat_from_rpy(inward)};
}

PoseHistory::Motion World::vehicle_moves(std::size_t vehicle, Time t) const {
  const Track& track = vehicles_[vehicle];
  if (track.hidden) return {};
  if (track.history.empty() && !track.body.plan) {
    if (!track.body.orbits) return {};
    const Vec3d p = orbit(track.body.initial_pose, t).position_m;
    const double per_s = orbit_speed_mps / std::hypot(p.x, p.y);
    return {{-per_s * p.y, per_s * p.x, 0}, {0, 0, per_s}};
  }
  const PoseHistory::Motion moves =
      track.history.empty() ? played(track, t).moves
                            : track.history.motion_at(t - track.offset, std::min(rules_.extrapolate_max, rules_.stale_after));
  return motion::is_jump(moves.velocity_mps, moves.angular_velocity_radps) ? PoseHistory::Motion{} : moves;
}

// The body is rigid: at the mount r its velocity is v + w x r.
Twist mounted_moves(const PoseHistory::Motion& body_moves, const Pose& body_in_world, const Pose& mount) {
  const Vec3d swing = rotate(body_in_world.orientation, cross(body_moves.angular_velocity_radps, mount.position_m));
  return {body_moves.velocity_mps + swing, rotate(conjugate(mount.orientation), body_moves.angular_velocity_radps)};
}

std::vector<Pose> World::objects_at(Time t) const {
  std::vector<Pose> poses;
  poses.reserve(objects_.size());
  for (const Track& o : objects_) poses.push_back(pose_at(o, t));
  return poses;
}

}  // namespace sonar
