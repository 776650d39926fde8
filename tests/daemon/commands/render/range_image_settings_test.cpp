// Renders range images at several ranges: they have the range cell, and the bytes, of the device that a host sets to that range.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "core/paper/paper_engine.hpp"
#include "daemon/commands/render/render_job.hpp"
#include "daemon/commands/render/sidecar.hpp"
#include "tests/protocol/waterlinked/waterlinked_testing.hpp"

namespace sonar::render::range_image_settings_test {
namespace {

using waterlinked::tests::Unit;

// A slope in front of the sonar, whose echo fills many range cells of each beam.
const std::string slope =
    "scene: {objects: [{type: box, size_m: [30, 30, 1], material: rock, pose: {xyz_m: [6, 0, -10.7], rpy_deg: [0, -45, 0]}}]}\n"
    "poses: {at: {frame: ENU_FLU, xyz_m: [0, 0, -10]}}\nwater: {temperature_c: 12, salinity_psu: 0, sound_speed_mps: 1500}\n";

RenderJob job_of(const std::string& scene, const std::string& ping) {
  auto input = parse_render_file(scene + "sonar: {profile: waterlinked-3d15, ping: {" + ping + "}}\n", "r.yaml", ".");
  if (!input) throw std::runtime_error(input.error().text);
  return input->jobs.at(0);
}
RenderJob job_of(const std::string& ping) { return job_of(slope, ping); }

TEST(RangeImageSettings, ThePulseIsTheRangeCellOfTheMode) {
  for (const char* ping : {"range_m: 15", "range_m: 8", "range_m: 8, range_start_m: 3", "mode: low-frequency, range_m: 2"}) {
    EXPECT_FLOAT_EQ(job_of(ping).settings.pulse_width_m, 0.02f) << ping;
    EXPECT_EQ(job_of(ping).settings.range_bin_count, 64) << ping;
  }
  EXPECT_FLOAT_EQ(job_of("mode: high-frequency, range_m: 8").settings.pulse_width_m, 0.01f);
  EXPECT_FLOAT_EQ(job_of("range_m: 8, pulse_width_m: 0.03").settings.pulse_width_m, 0.03f);
}

TEST(RangeImageSettings, PingsAreThoseOfTheDeviceAtTheSameRange) {
  Parallel pool(2);
  for (const std::string mode : {"low-frequency", "high-frequency"})
    for (const auto& [from, to] : {std::pair("0", "15"), {"0", "8"}, {"3", "8"}, {"0", "5.5"}, {"4.25", "11"}}) {
      SCOPED_TRACE(mode + " " + from + " to " + to);
      const RenderJob job =
          job_of("mode: " + mode + ", range_m: " + to + ", range_start_m: " + from + ", device_sound_speed_mps: 1500");
      Unit unit;
      ASSERT_EQ(unit.post("/acoustics/mode", '"' + mode + '"'), 204u);
      ASSERT_EQ(unit.post("/acoustics/speed_of_sound", "1500"), 204u);
      ASSERT_EQ(unit.post("/acoustics/range", std::string(R"({"min": )") + from + R"(, "max": )" + to + "}"), 204u);
      std::vector<PingRequest> requests(2, make_request(job, world_of(job), PingNumber{1}, Time{}));
      requests[1].settings = unit.settings;
      requests[1].vendor_settings = unit.device.settings;
      const auto engine = make_engine(job.scene, pool, {});
      const std::vector<Ping> pings = engine->run(requests);
      EXPECT_EQ(job.settings.pulse_width_m, unit.settings.pulse_width_m);
      EXPECT_TRUE(pings[0].samples == pings[1].samples);
      EXPECT_GT(std::count_if(pings[0].samples.begin(), pings[0].samples.end(), [](std::byte b) { return b != std::byte{0}; }),
                1000);
      const nlohmann::json about = sidecar(job, pings[0], "test", engine->statistics(), "");
      EXPECT_EQ(about["settings"]["pulse_width_m"], unit.settings.pulse_width_m);
      EXPECT_TRUE(about["settings"]["row_spacing_m"].is_null() && about["row_spacing_m"].is_null() && about["row_0_m"].is_null());
    }
}

/// The summed power of a level pole of 2 cm at 8 m does not depend on its height within the pitch of the rows, 9 cm there.
TEST(RangeImageSettings, AThinPoleIsHeardAtEveryHeight) {
  Parallel pool(2);
  for (const std::string mode : {"low-frequency", "high-frequency"}) {
    double least_db = 1e9, most_db = -1e9;
    for (int n = 0; n < 16; ++n) {
      const std::string z = std::to_string(-10 + 0.1 * n / 16);
      const std::string pole =
          "scene: {objects: [{type: cylinder, radius_m: 0.01, length_m: 1, material: rock,\n  pose: {xyz_m: [8, 0, " + z +
          "], rpy_deg: [90, 0, 0]}}]}\nposes: {at: {frame: ENU_FLU, xyz_m: [0, 0, -10]}}\n";
      const RenderJob job = job_of(pole, "mode: " + mode + ", range_m: 12, pulse_width_m: 3.2");
      PingRequest request = make_request(job, world_of(job), PingNumber{1}, Time{});
      request.switches.expected_power = request.switches.keep_pressure = true;
      auto held =
          std::make_shared<waterlinked::HeldSettings>(dynamic_cast<const waterlinked::HeldSettings&>(*request.vendor_settings));
      held->RangeImageSettings::least_strength = 0;
      held->RangeImageSettings::least_confirming = held->RangeImageSettings::median_passes = 0;
      request.vendor_settings = held;
      const Ping ping = make_engine(job.scene, pool, {})->run({&request, 1}).at(0);
      double power = 0;
      for (const float p : ping.pressure_upa) power += static_cast<double>(p) * static_cast<double>(p);
      const double db = 10 * std::log10(power);
      least_db = std::min(least_db, db), most_db = std::max(most_db, db);
    }
    EXPECT_LT(most_db - least_db, 1) << mode << ", greatest " << most_db;
  }
}

}  // namespace
}  // namespace sonar::render::range_image_settings_test
