#include "daemon/render/render_job.hpp"

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
