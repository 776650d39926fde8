// An example of every request, of a full status and of every event, in which all numbers differ; and comparisons of messages.
#pragma once

#include <vector>

#include "protocol/control/control.hpp"
#include "tests/protocol/control/message_from.hpp"

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
  sonar.mount = MountChange{tilted.position_m, tilted.orientation};
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
          {15, StartRecording{"run-1.mcap", "front", true}},
          {16, StopRecording{"run-1.mcap"}}};
}

inline v1::DaemonStatus full_status() {
  // The norm is 1 to the last bit.
  const std::string tilted = " position { x: 1.5 y: -2.25 z: 3 } orientation { w: 0.6 y: 0.8 } ";
  return message_from<v1::DaemonStatus>(
      R"(version: "0.1" config: "lab.yaml" scene: "harbour" clock: "realtime" engine: "fake" seed: 0xffffffffffffffff
         uptime_s: 1.5 resident_mb: 80 control: "127.0.0.4:14770" http: "127.0.0.5:8088" now_ns: 1234567890123456780
         poses { accepted: 21 refused: 22 late: 23 replaced: 24 over_rate: 25 }
         environment { temperature_c { value: 12 } salinity_psu { value: 30 } ph { value: 8 } sound_speed_mps { value: 0 } }
         sonars {
           name: "front" profile: "oculus-m1200d" listens: "127.0.0.2:52100" advertised: "127.0.0.3"
           observers: "127.0.0.3:41003" observing: 2 status_to: "127.255.255.255:52102" status_to: "10.0.0.7:52102"
           pinging: true range_m: 10 rate_hz: 11 gain_db: -12 frequency_hz: 2.1e6 beams: 512 rows: 437
           clients { address: "127.0.0.1:40000" pings_written: 1 pings_dropped: 2 bytes_written: 3 connected_s: 4.5
                     bytes_read: 9 requests: 10 complaint: "odd" unread_s: 0.5 taking: 11 unsent_bytes: 12 silent_s: 13.5 }
           asked_by: "127.0.0.1:40000" silenced_by: "http 127.0.0.1" waiting: 1 asking_observer: "127.0.0.1:40002"
           turned_away { address: "10.0.0.9:1" why: "no slot is free" utc_ns: 1234567890123456780 ago_s: 5.5 }
           clients { address: "127.0.0.1:40001" pings_written: 5 pings_dropped: 6 bytes_written: 7 connected_s: 8.5 }
           figures {
             pings: 1 refused: 2 served: 3 dropped: 4 skipped_ticks: 5 clients: 6 refused_clients: 7
             simulation_ms: 8.5 latency_ms_p50: 9.5 latency_ms_p99: 10.5 late_ms_p99: 11.5
           })" +
      tilted + R"(}
         vehicles { name: "rov" source: "demo orbit" stale: true)" +
      tilted + R"(}
         vehicles {
           name: "auv" source: "trajectory dive.tum"
           trajectory { file: "dive.tum" position_s: 1.5 duration_s: 60 speed: 2.5 paused: true loop: true })" +
      tilted + R"(}
         objects { name: "crate" material: "steel" moving: true triangles: 12)" +
      tilted + R"(}
         recordings { sonar: "front" file: "recordings/run-1.mcap" running: true pings: 31 messages: 32 bytes: 33 }
         recordings { sonar: "front" file: "recordings/run-0.pcap" pings: 34 messages: 35 bytes: 36 why: "the disk is full" }
         notes { vehicle: "rov" text: "the sonar of rov is 3 m above the water" cure: "say the frame" }
         notes { text: "wreck is 1200 m long" cure: "set scale" })");
}

inline std::vector<v1::Event> every_event() {
  return {message_from<v1::Event>(R"(ping {
                                       sonar: "front" number: 7 fired_at_ns: 1234567890123456789
                                       position { x: 1 y: 2 z: -3 } orientation { w: 0.8 z: 0.6 }
                                       range_m: 10 beams: 512 rows: 437 clients: 2 simulation_ms: 21.5
                                     }
                                     unsent: 9)"),
          message_from<v1::Event>(R"(client { sonar: "front" client: "127.0.0.1:4711" why: "it closed the connection" })"),
          message_from<v1::Event>(R"(pose { vehicle: "rov" stale: true text: "no pose for rov for 1 s" } unsent: 1)"),
          message_from<v1::Event>(R"(scene { scene: "harbour" text: "loaded" })")};
}

/// Compares two requests by their bytes.
inline bool same(const Request& a, const Request& b) { return encode_request(a) == encode_request(b); }
inline bool same(const v1::Response& a, const v1::Response& b) { return encode_response(a) == encode_response(b); }

}  // namespace sonar::control
