#include "daemon/commands/render/render_job.hpp"

#include <algorithm>

#include "core/text/format.hpp"

namespace sonar::render {

PingSettings device_settings(const protocol::Profile& profile, const protocol::OptionValues& options, const Water& water,
                             double depth_m) {
  protocol::DeviceState device;
  device.name = profile.model->name;
  device.id = 1;
  device.model = profile.model;
  device.water = water;
  device.depth_m = depth_m;
  device.options = options;
  return profile.vendor->initial_settings(device).settings;
}

std::string note_of_range(const RenderJob& job) {
  constexpr double rounding = 1 + 1e-6;
  const double least_m = static_cast<double>(job.mode().min_range_m), most_m = static_cast<double>(job.mode().max_range_m);
  const double range_m = job.settings.range_m;
  if (range_m >= least_m / rounding && range_m <= most_m * rounding) return {};
  return text::format("range %g m: %s in mode %s takes %g to %g m; rendered all the same, where the device would use %g m",
                      range_m, job.model->name.c_str(), job.mode().name.c_str(), least_m, most_m,
                      std::clamp(range_m, least_m, most_m));
}

PingRequest make_request(const RenderJob& job, PingNumber number, Time at) {
  PingRequest request;
  request.model = job.model;
  request.number = number;
  request.fired_at = at;
  request.vehicle_in_world = vehicle_at(job.path, at);
  request.sonar_in_world = compose(request.vehicle_in_world, job.mount);
  request.sonar_moves = sonar_twist_at(job.path, job.mount, at);
  request.bodies_in_world = job.scene->bodies_in_world;
  for (std::size_t i = 0; i < job.body_paths.size(); ++i)
    if (job.body_paths[i]) request.bodies_in_world.at(i) = job.body_paths[i]->at(at - job.path.begins_at).body_in_world;
  request.water = job.water;
  request.settings = job.settings;
  request.sonar_id = job.sonar_id;
  request.seed = Seed{job.seed};
  request.switches = job.engine.switches;
  return request;
}

}  // namespace sonar::render
