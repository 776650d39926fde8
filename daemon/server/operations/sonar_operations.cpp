#include "daemon/server/operations/sonar_operations.hpp"

#include <utility>

#include "core/text/format.hpp"
#include "daemon/config/config_parts.hpp"
#include "daemon/server/operations/operation_results.hpp"

namespace sonar {

Result<Device*> SonarOperations::find(const std::string& name) {
  std::list<Device>& sonars = fleet_.devices();
  Device* const device = name.empty() && sonars.size() == 1 ? &sonars.front() : fleet_.find(name);
  if (device != nullptr) return device;
  std::string names;
  for (const Device& d : sonars) names += (names.empty() ? "" : ", ") + d.config().name;
  return failure(ErrorKind::usage,
                 (name.empty() ? std::string("name the sonar") : "no sonar is called \"" + name.substr(0, 64) + "\"") +
                     "; there are: " + names);
}

OperationResult SonarOperations::set(const control::SetSonar& asked, const Sender& sender) {
  const auto device = find(asked.sonar);
  return device ? result_of((*device)->ask(asked, sender.id)) : result_of(device.error());
}

/// Unset values stay. All sonars are in the same water.
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

}  // namespace sonar
