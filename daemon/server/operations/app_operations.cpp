#include "daemon/server/operations/app_operations.hpp"

#include <algorithm>
#include <utility>

#include "core/base/overloaded.hpp"
#include "core/text/format.hpp"
#include "daemon/config/config_parts.hpp"
#include "daemon/server/operations/operation_results.hpp"
#include "protocol/control/answers.hpp"

namespace sonar {

Result<Device*> SonarOperations::find(const std::string& name) {
  std::list<Device>& sonars = fleet_.devices();
  Device* const device = name.empty() && sonars.size() == 1 ? &sonars.front() : fleet_.find(name);
  if (device != nullptr) return device;
  return failure(ErrorKind::usage,
                 (name.empty() ? std::string("name the sonar") : "no sonar is called \"" + name.substr(0, 64) + "\"") +
                     "; there are: " + text::joined(sonars, ", ", [](const Device& d) { return d.config().name; }));
}

OperationResult SonarOperations::set(const control::SetSonar& asked, const Sender& sender) {
  const auto device = find(asked.sonar);
  return device ? result_of((*device)->ask(asked, sender.id)) : result_of(device.error());
}

/// Changes the values that are set. All sonars are in the same water.
OperationResult SonarOperations::set(const control::SetEnvironment& asked, const Sender& sender) {
  Water water = config_.water;
  water.temperature_c = asked.temperature_c.value_or(water.temperature_c);
  water.salinity_psu = asked.salinity_psu.value_or(water.salinity_psu);
  water.ph = asked.ph.value_or(water.ph);
  water.sound_speed_mps = asked.sound_speed_mps.value_or(water.sound_speed_mps);
  if (std::string why = why_no_water(water, config_.allow_hot); !why.empty()) return refused(std::move(why));
  if (water == config_.water) return {};
  config_.water = water;
  for (Device& d : fleet_.devices()) d.use_water(water);
  log_.info(text::format("water: %g C, %g psu, pH %g, sound speed %s", water.temperature_c, water.salinity_psu, water.ph,
                         water.sound_speed_mps == 0 ? "computed" : std::to_string(water.sound_speed_mps).c_str()),
            {{"client", sender.id}});
  return {};
}

void SonarOperations::start(const control::StartRecording& asked, const Sender& sender, Operations::Done done) {
  const auto device = find(asked.sonar);
  if (!device) return done(result_of(device.error()));
  recordings_.start(asked, (*device)->recorded(), sender.id,
                    [done = std::move(done)](const Result<void>& outcome) { done(result_of(outcome)); });
}

void SonarOperations::stop(const control::StopRecording& asked, Operations::Done done) {
  recordings_.stop(asked, [done = std::move(done)](const Result<void>& outcome) { done(result_of(outcome)); });
}

/// Passes on a pose. If time follows the poses, the answer comes after the pings that the pose made possible have been sent, so
/// that a client that waits for answers runs in step with the sonars.
void TimeOperations::take(const control::PoseSample& sample, const Sender& sender, Operations::Done done) {
  std::string refusal = poses_.take(sample, sender);
  if (!refusal.empty()) return done(refused(std::move(refusal)));
  if (sample.of != control::PoseSample::Of::vehicle || !time_.follows_poses()) return done({});
  if (time_.is_full())
    return done(
        failed("the pose was accepted, but too many earlier poses wait for their pings, so this answer "
               "does not wait for the pings of the pose"));
  time_.wait([done = std::move(done)](Time, bool) { done({}); });
}

/// Advances time. The answer comes when the step is over, and has the number of pings since the previous answer. A client that
/// has shut down only its half of the connection still gets an answer.
void TimeOperations::step(const control::Step& asked, Operations::Done done, HasLeft has_left) {
  if (std::string why = time_.step(asked.dt_s); !why.empty()) return done(refused(std::move(why)));
  const auto reached = [this, done = std::move(done)](Time then, bool is_whole) {
    if (!is_whole)
      return done(
          failed(text::format("the step ended early, at %.9g s: its client closed the connection; keep it open until the "
                              "answer",
                              seconds(then.time_since_epoch()))));
    const std::uint64_t before = std::exchange(pings_reported_, pings_made());
    // If a reload removed a sonar, its pings are no longer counted.
    const std::uint64_t pings = pings_reported_ - std::min(before, pings_reported_);
    const auto stepped = std::make_shared<v1::Stepped>();
    stepped->set_now_ns(then.time_since_epoch().count());
    stepped->set_pings(pings);
    done({.stepped = stepped});
  };
  time_.wait(reached, std::move(has_left));
  on_change_();
}

std::uint64_t TimeOperations::pings_made() const {
  std::uint64_t made = 0;
  for (const Device& d : fleet_.devices()) made += d.sonar().pings();
  return made;
}

OperationResult TimeOperations::steer(const control::SetTrajectory& asked, const Sender& sender) {
  return done_or_refused(poses_.steer(asked, sender));
}

void AppOperations::perform(const control::Operation& operation, const Sender& sender, Done done, HasLeft has_left) {
  std::visit(Overloaded{[&](const control::GetStatus&) { done({.status = monitoring_.status()}); },
                        [&](const control::PoseSample& asked) { time_.take(asked, sender, std::move(done)); },
                        [&](const control::Step& asked) { time_.step(asked, std::move(done), std::move(has_left)); },
                        [&](const control::SetTrajectory& asked) { done(time_.steer(asked, sender)); },
                        [&](const control::SetSonar& asked) { done(sonars_.set(asked, sender)); },
                        [&](const control::SetEnvironment& asked) { done(sonars_.set(asked, sender)); },
                        [&](const control::StartRecording& asked) { sonars_.start(asked, sender, std::move(done)); },
                        [&](const control::StopRecording& asked) { sonars_.stop(asked, std::move(done)); },
                        [&](const control::LoadScene& asked) { scene_.load(asked, sender, std::move(done)); },
                        [&](const control::AddObject& asked) { scene_.add(asked, sender, std::move(done)); },
                        [&](const control::RemoveObject& asked) { scene_.remove(asked, sender, std::move(done)); },
                        [&](const control::SetObject& asked) { scene_.set(asked, sender, std::move(done)); },
                        [&](const control::AddFault& asked) { done(faults_.add(asked, sender)); },
                        [&](const control::EndFaults& asked) { done(faults_.end(asked, sender)); },
                        [&](const control::GetFaults& asked) { done(faults_.report(asked)); }},
             operation);
}

}  // namespace sonar
