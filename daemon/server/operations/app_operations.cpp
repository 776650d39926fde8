#include "daemon/server/operations/app_operations.hpp"

#include <utility>

#include "core/base/overloaded.hpp"

namespace sonar {

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
