// One example of every request, of a full status and of every event, with no two numbers alike; comparisons by eye of a test.
#pragma once

#include <vector>

#include "protocol/control/control.hpp"

namespace sonar::control {

inline std::vector<Request> every_request() {
  const Pose tilted{{1.5, -2.25, 3}, quat_from_rpy({0.1, -0.2, 0.3})};
  SetSonar sonar;
  sonar.sonar = "front";
  sonar.range_m = 12.5;
  sonar.rate_hz = 0;
  sonar.gain_percent = 40;
  sonar.mode = 1;
  sonar.beams = 256;
  sonar.transmit = false;
  sonar.mount = tilted;
  SetEnvironment water;
  water.temperature_c = 4;
  water.sound_speed_mps = 0;
  PoseSample pose, object;
  pose.name = "rov";
  pose.seq = 3;
  pose.stamp = {ClockDomain::sim, 123456789};
  pose.velocity_mps = Vec3d{1, 2, 3};
  object.of = PoseSample::Of::object;
  object.name = "crate";
  object.hidden = true;
  return {{1, Hello{1, "test", "a token of the lab"}},
          {2, pose},
          {3, object},
          {4, GetStatus{}},
          {5, sonar},
          {6, water},
          {7, LoadScene{"harbour.yaml"}},
          {8, AddObject{"crate2", "crate", "steel", tilted, true}},
          {9, RemoveObject{"crate2"}},
          {10, SetObject{"crate", true, tilted}},
          {11, Subscribe{true, false, true, false}},
          {12, SetTrajectory{PoseSample::Of::object, "crate", true, 1.5, 2.5}},
          {13, SetTrajectory{PoseSample::Of::vehicle, "rov", {}, 0.25, {}}},
          {14, Step{0.125}},
          {15, StartRecording{"run-1.mcap", "front"}},
          {16, StopRecording{"run-1.mcap"}}};
}

inline DaemonStatus full_status() {
  const Pose tilted{{1.5, -2.25, 3}, {0.6, 0, 0.8, 0}};  // of norm 1 to the last bit
  DaemonStatus s;
  s.version = "0.1";
  s.config = "lab.yaml";
  s.scene = "harbour";
  s.clock = "realtime";
  s.engine = "fake";
  s.seed = 0xffff'ffff'ffff'ffff;
  s.uptime_s = 1.5;
  s.resident_mb = 80;
  SonarStatus sonar;
  sonar.name = "front";
  sonar.profile = "oculus-m1200d";
  sonar.listens = "127.0.0.2:52100";
  sonar.advertised = "127.0.0.3";
  sonar.observers = "127.0.0.3:41003";
  sonar.observing = 2;
  sonar.status_to = {"127.255.255.255:52102", "10.0.0.7:52102"};
  sonar.pinging = true;
  sonar.transmits = false;
  sonar.range_m = 10;
  sonar.rate_hz = 11;
  sonar.gain_db = -12;
  sonar.frequency_hz = 2.1e6;
  sonar.beams = 512;
  sonar.rows = 437;
  sonar.in_world = tilted;
  sonar.clients = {{"127.0.0.1:40000", 1, 2, 3, 4.5}, {"127.0.0.1:40001", 5, 6, 7, 8.5}};
  sonar.figures = {1, 2, 3, 4, 5, 6, 7, 8.5, 9.5, 10.5, 11.5};
  s.sonars = {sonar};
  s.vehicles = {{"rov", "demo orbit", true, tilted},
                {"auv", "trajectory dive.tum", false, tilted, TrajectoryStatus{"dive.tum", 1.5, 60, 2.5, true, true}}};
  s.objects = {{"crate", "steel", true, false, 12, tilted}};
  s.poses = {21, 22, 23, 24, 25};
  s.environment = {12, 30, 8, 0};
  s.control = "127.0.0.4:14770";
  s.http = "127.0.0.5:8088";
  s.now_ns = 1234567890123456780;
  s.recordings = {{"front", "recordings/run-1.mcap", true, 31, 32, 33, ""},
                  {"front", "recordings/run-0.pcap", false, 34, 35, 36, "the disk is full"}};
  s.notes = {{"rov", "the sonar of rov is 3 m above the water", "say the frame"}, {"", "wreck is 1200 m long", "set scale"}};
  return s;
}

inline std::vector<Event> every_event() {
  PingEvent ping;
  ping.sonar = "front";
  ping.number = 7;
  ping.fired_at_ns = 1234567890123456789;
  ping.sonar_in_world = {{1, 2, -3}, {0.8, 0, 0, 0.6}};
  ping.range_m = 10;
  ping.beams = 512;
  ping.rows = 437;
  ping.clients = 2;
  ping.simulation_ms = 21.5;
  return {{ping, 9},
          {ClientEvent{"front", "127.0.0.1:4711", false, "it closed the connection"}, 0},
          {PoseEvent{"rov", true, "no pose for rov for 1 s"}, 1},
          {SceneEvent{"harbour", "loaded"}, 0}};
}

/// What a request is, whatever the road it came by: its bytes.
inline bool same(const Request& a, const Request& b) { return encode_request(a) == encode_request(b); }
inline bool same(const Response& a, const Response& b) { return encode_response(a) == encode_response(b); }

}  // namespace sonar::control
