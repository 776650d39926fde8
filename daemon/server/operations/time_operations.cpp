#include "daemon/server/operations/time_operations.hpp"

#include <algorithm>
#include <utility>

#include "core/text/format.hpp"
#include "daemon/server/operations/operation_results.hpp"
#include "protocol/control/answers.hpp"

namespace sonar {

/// If time follows the poses, a pose is answered after the pings that it made possible have been sent. So a client that waits
/// for answers runs in step with the sonars.
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

/// The answer comes when the step is over, with the pings made since the answer before. A client that has shut down only its half
/// of the connection still gets an answer.
void TimeOperations::step(const control::Step& asked, Operations::Done done, HasLeft has_left) {
  if (std::string why = time_.step(asked.dt_s); !why.empty()) return done(refused(std::move(why)));
  const auto reached = [this, done = std::move(done)](Time then, bool is_whole) {
    if (!is_whole)
      return done(
          failed(text::format("the step ended early, at %.9g s: its client closed the connection; keep it open until the "
                              "answer",
                              seconds(then.time_since_epoch()))));
    const std::uint64_t before = std::exchange(pings_reported_, pings_made());
    // If a reload removed a sonar, its pings are gone too.
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

}  // namespace sonar
