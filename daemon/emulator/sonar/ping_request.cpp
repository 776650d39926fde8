#include "daemon/emulator/sonar/ping_request.hpp"

namespace sonar {

PingRequest ping_request(const Config& config, const World& world, std::size_t vehicle, const Pose& mount, Time at) {
  PingRequest request;
  request.fired_at = at;
  request.vehicle_in_world = world.vehicle_at(vehicle, at);
  request.sonar_in_world = compose(request.vehicle_in_world, mount);
  request.sonar_moves = mounted_moves(world.vehicle_moves(vehicle, at), request.vehicle_in_world, mount);
  request.bodies_in_world = world.objects_at(at);
  request.water = config.water;
  request.seed = Seed(config.seed);
  request.switches = config.engine.switches;
  return request;
}

protocol::DeviceState device_state(const SonarConfig& sonar, const Config& config, Time now) {
  protocol::DeviceState s;
  s.name = sonar.name;
  s.id = sonar.device_id;
  s.model = sonar.profile.model;
  s.advertise_ip = sonar.advertise_ip;
  s.netmask = sonar.netmask;
  // A locally administered address, which no real device can have.
  s.mac = {
      0x02, 0x53, 0x4f, 0x00, static_cast<std::uint8_t>(sonar.device_id >> 8), static_cast<std::uint8_t>(sonar.device_id & 0xff)};
  s.powered_up_at = now;
  s.water = config.water;
  s.options = sonar.options;
  s.simulated_time = config.clock != ClockMode::realtime;
  return s;
}

}  // namespace sonar
