#include "daemon/server/poses/pose_intake.hpp"

#include <utility>

namespace sonar {
namespace {
constexpr auto wall_tolerance = std::chrono::milliseconds(1);
constexpr auto longest_pause = std::chrono::seconds(5);  // longest time between poses that count as arriving
}  // namespace

void PoseIntake::log_refusal(const std::string& why, const Sender& sender) {
  log_limited(log_, refusals_, LogLevel::warning, "pose refused: " + why, {{"from", sender.id}});
}

void PoseIntake::refuse(const std::string& why, const Sender& sender) {
  world_.count_refused();
  log_refusal(why, sender);
}

/// Converts a WALL stamp, which is of the computer's clock, to the time of the World, which never jumps. The difference of both
/// times is kept while it is correct to a millisecond, so that equal stamps stay equal.
void PoseIntake::map_wall(control::Stamp& stamp) {
  if (stamp.domain != control::ClockDomain::wall || clock_.stepped()) return;
  const auto shift = clock_.ahead_of_wall();
  if (std::chrono::abs(shift - wall_shift_) > wall_tolerance) wall_shift_ = shift;
  stamp.ns += wall_shift_.count();
}

std::string PoseIntake::take(control::PoseSample sample, const Sender& sender) {
  map_wall(sample.stamp);
  const PoseOutcome outcome = world_.accept(sample, sender, clock_.now());
  if (!outcome.refusal.empty() && outcome.verdict != PoseVerdict::late) log_refusal(outcome.refusal, sender);
  if (!outcome.notice.empty() && events_ != nullptr) events_->publish_pose(outcome.body, false, outcome.notice);
  if (!outcome.notice.empty()) log_limited(log_, notices_, LogLevel::info, outcome.notice);
  if (plausibility_ != nullptr && outcome.verdict == PoseVerdict::accepted && sample.of == control::PoseSample::Of::vehicle)
    for (const Note& note : plausibility_->use(sample, clock_.now())) log_.warning(text_of(note), {{"from", sender.id}});
  if (outcome.verdict == PoseVerdict::accepted && sample.of == control::PoseSample::Of::vehicle)
    newest_[sample.name] = {sender.source, clock_.now()};
  on_pose_();
  return outcome.refusal;
}

std::string_view PoseIntake::live_source(const std::string& vehicle) const {
  const auto named = newest_.find(vehicle), found = named != newest_.end() ? named : newest_.find({});
  return found != newest_.end() && clock_.now() - found->second.at <= longest_pause ? found->second.source : std::string_view();
}

std::string PoseIntake::place(const control::SetObject& asked, std::size_t body, const Sender& sender) {
  const bool hidden = !asked.visible.value_or(!world_.is_hidden(body));
  if (asked.in_world) {
    control::PoseSample sample;
    sample.of = control::PoseSample::Of::object;
    sample.name = asked.object;
    sample.pose = *asked.in_world;
    sample.velocity_mps = sample.angular_velocity_radps = Vec3d{};  // zero velocity, so that a placed object is not extrapolated
    sample.reset_counter = ++placements_;
    if (std::string refusal = take(std::move(sample), sender); !refusal.empty()) return refusal;
  }
  world_.hide(body, hidden);
  return {};
}

std::string PoseIntake::steer(const control::SetTrajectory& asked, const Sender& sender) {
  if (std::string why = world_.steer(asked, clock_.now()); !why.empty()) return why;
  std::string text = "trajectory" + (asked.name.empty() ? std::string() : " of " + asked.name) + ":";
  if (asked.position_s) text += " at " + std::to_string(*asked.position_s) + " s";
  if (asked.speed) text += " speed " + std::to_string(*asked.speed);
  if (asked.paused) text += *asked.paused ? " paused" : " playing";
  log_.info(text, {{"client", sender.id}});
  return {};
}

}  // namespace sonar
