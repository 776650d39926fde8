// Render files: the effects of their keys, and their errors.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "core/paper/paper_engine.hpp"
#include "daemon/commands/render/coverage.hpp"
#include "daemon/commands/render/render_job.hpp"
#include "daemon/commands/render/sidecar.hpp"

namespace sonar::render {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

RenderInput parsed(const std::string& text) {
  auto input = parse_render_file(text, "r.yaml", ".");
  if (!input) throw std::runtime_error(input.error().text);
  return *std::move(input);
}
std::string refusal(const std::string& text) {
  const auto input = parse_render_file(text, "r.yaml", ".");
  return input ? "accepted" : input.error().text;
}

const std::string point =
    "scene: {objects: [{type: point, target_strength_db: -10, pose: {xyz_m: [4, 0, -10]}}]}\n"
    "poses: {at: {frame: ENU_FLU, xyz_m: [0, 0, -10]}}\nengine: {noise: off}\n"
    "water: {temperature_c: 10, salinity_psu: 0, sound_speed_mps: 1500}\n";

TEST(RenderFile, TheErrorOfAMissingPosesFileNamesThePathsTried) {
  const auto why = [](const std::string& name, const std::string& folder) {
    return parse_render_file("scene: demo.yaml\nposes: {file: " + name + "}\n", "r.yaml", folder).error().text;
  };
  const std::string here = std::filesystem::current_path().string();
  EXPECT_THAT(why("none.csv", ""), HasSubstr("no such file: \"none.csv\"; looked in " + here));  // a bare `sonard render r.yaml`
  EXPECT_THAT(why("none.csv", "missions"), HasSubstr("looked in " + here + "/missions"));
  EXPECT_THAT(why("/nowhere/none.csv", ""), AllOf(HasSubstr("no such file: \"/nowhere/none.csv\""), Not(HasSubstr("looked in"))));
}

TEST(RenderFile, AFifoIsRefusedAndNotWaitedFor) {
  const std::string fifo = testing::TempDir() + "render-" + std::to_string(getpid()) + ".yaml";
  ASSERT_EQ(mkfifo(fifo.c_str(), 0600), 0);
  const auto input = load_render_input(fifo, "");
  std::filesystem::remove(fifo);
  ASSERT_FALSE(input);
  EXPECT_EQ(input.error().kind, ErrorKind::missing_file);
  EXPECT_THAT(input.error().text, HasSubstr("is a FIFO, not a regular file"));
}

TEST(RenderFile, TheErrorOfAMissingSceneAsksForOne) {
  EXPECT_THAT(refusal("sonar: {}\n"), AllOf(HasSubstr("scene"), Not(HasSubstr("no such file"))));
}

TEST(RenderFile, KeysReachTheSonarAndItsSettings) {
  const RenderInput input = parsed(point + R"(
seed: 7
sonar:
  model: {centre_hz: 5e5, aperture_deg: 60, source_level_db: 190, azimuth_width_deg: 2, elevation_width_deg: 10,
          azimuth_taper: unit, elevation_taper: unit, elevation_width_is: one_way, beam_spacing: uniform_in_angle,
          waveform: {shape: lfm, falling: true}, receiver: {tvg_slope_db: 40, tvg_ceiling_db: inf, leak_upa: 5}}
  ping: {range_m: 6, beams: 101, rows: 300, row_centre: 1, pulse_width_m: 0.03, gain_db: 3, bits: 8, gamma: 0.5, tvg: false,
         device_sound_speed_mps: 1480}
)");
  ASSERT_EQ(input.jobs.size(), 1u);
  const RenderJob& job = input.jobs[0];
  const FrequencyMode& mode = job.mode();
  EXPECT_EQ(job.config.seed, 7u);
  EXPECT_EQ(mode.centre_hz, 5e5f);
  EXPECT_NEAR(static_cast<double>(mode.horizontal_aperture_rad), pi / 3, 1e-6);
  EXPECT_EQ(mode.source_level_db, 190);
  EXPECT_EQ(mode.pattern.azimuth_taper, Taper::unit);
  EXPECT_EQ(mode.pattern.elevation_taper, Taper::unit);
  EXPECT_EQ(mode.pattern.elevation_width_is, ElevationWidthIs::one_way);
  EXPECT_EQ(mode.beam_spacing, BeamSpacing::uniform_in_angle);
  EXPECT_EQ(mode.waveform.shape, Waveform::Shape::lfm);
  EXPECT_TRUE(mode.waveform.falling);
  EXPECT_EQ(mode.receiver.tvg_slope_db, 40);
  EXPECT_TRUE(std::isinf(mode.receiver.tvg_ceiling_db));
  EXPECT_EQ(mode.receiver.leak_upa, 5);
  const PingSettings& s = job.settings;
  EXPECT_EQ(s.beam_count, 101);
  EXPECT_EQ(s.range_bin_count, 300);
  EXPECT_DOUBLE_EQ(s.range_bin_m, 0.02);
  EXPECT_EQ(s.row_centre, 1);
  EXPECT_EQ(s.pulse_width_m, 0.03f);
  EXPECT_EQ(s.format.bits, 8);
  EXPECT_EQ(s.format.max_code, 254u);
  EXPECT_FALSE(s.tvg);
  EXPECT_EQ(s.device_sound_speed_mps, 1480);
  EXPECT_FALSE(job.config.engine.switches.noise);
}

TEST(RenderFile, SharedNoiseReachesTheReceiver) {
  const auto with = [](const std::string& noise) {
    return point + "sonar: {model: {receiver: {leak_is_shared: true, shared_noise: {" + noise + "}}}}\n";
  };
  const RenderInput input = parsed(
      with("level_db: 3, channels: 96, group: 24, sine: 0.4, full_m: 2, steady: 0.5, focus_rows: 1, nearest_focus_m: 0.1"));
  const ReceiverModel& law = input.jobs.at(0).mode().receiver;
  EXPECT_TRUE(law.leak_is_shared);
  EXPECT_EQ(law.shared_noise.level_db, 3);
  EXPECT_EQ(law.shared_noise.channels, 96);
  EXPECT_EQ(law.shared_noise.group, 24);
  EXPECT_EQ(law.shared_noise.sine, 0.4f);
  EXPECT_EQ(law.shared_noise.full_m, 2);
  EXPECT_EQ(law.shared_noise.steady, 0.5f);
  EXPECT_EQ(law.shared_noise.focus_rows, 1);
  EXPECT_EQ(law.shared_noise.nearest_focus_m, 0.1f);

  EXPECT_THAT(refusal(with("channels: 97")), HasSubstr("shared_noise: channels must be even"));
  EXPECT_THAT(refusal(with("channels: 100")),
              HasSubstr("shared_noise: group 32 does not fit 100 channels: 40 would do; it must be even"));
  for (const auto& [wrong, right] :
       {std::pair("channels: 100", 40), {"group: 31", 32}, {"group: 2", 4}, {"channels: 130, group: 4", 10}})
    EXPECT_THAT(refusal(with(wrong)), HasSubstr("channels: " + std::to_string(right) + " would do")) << wrong;
  EXPECT_THAT(refusal(with("steady: 1.1")), HasSubstr("shared_noise.steady: must be between 0 and 1"));
}

TEST(RenderFile, WindowsListedBeamsAndLevelsReachTheSonar) {
  const std::string text = point +
                           "sonar: {model: {beam_azimuths_deg: [20, 5, -10], beam_widths_deg: [2, 1, 3]},\n"
                           "  ping: {range_m: 6, range_start_m: 4, rows: 100, bits: 8, max_code: 255, scale: logarithmic,\n"
                           "         floor_db: -60, ceiling_db: 10}}\n";
  const RenderInput input = parsed(text);
  const RenderJob& job = input.jobs.at(0);
  const PingSettings& s = job.settings;
  EXPECT_EQ(job.mode().beam_spacing, BeamSpacing::listed);
  EXPECT_EQ(s.beam_count, 3);
  EXPECT_NEAR(job.mode().beam_azimuths_rad.at(1), rad_from_deg(5), 1e-12);
  EXPECT_NEAR(static_cast<double>(job.mode().beam_widths_rad.at(2)), rad_from_deg(3), 1e-7);
  EXPECT_NEAR(s.range_bin_m, 0.02, 1e-12);
  EXPECT_EQ(s.range_bin_count, 100);
  EXPECT_EQ(s.format.scale, SampleFormat::Scale::logarithmic);

  Parallel pool(1);
  PingRequest request = make_request(job, world_of(job), PingNumber{1}, Time{});
  request.switches.keep_truth = request.switches.keep_pressure = true;
  const auto engine = make_engine(job.scene, pool, {});
  const Ping ping = engine->run({&request, 1}).at(0);
  const auto about = sidecar(job, ping, "test", engine->statistics(), "");
  EXPECT_NEAR(about.at("row_0_m").get<double>(), 4.01, 1e-9);
  EXPECT_EQ(about.at("settings").at("range_start_m"), 4);
  EXPECT_EQ(about.at("settings").at("scale"), "logarithmic");
  EXPECT_EQ(about.at("sonar").at("beam_spacing"), "listed");

  EXPECT_THAT(refusal(point + "sonar: {model: {beam_azimuths_deg: [20, 25]}}\n"), HasSubstr("must be below the one before"));
  EXPECT_THAT(refusal(point + "sonar: {model: {beam_azimuths_deg: [20, 5]}, ping: {beams: 3}}\n"), HasSubstr("beams"));
  EXPECT_THAT(refusal(point + "sonar: {ping: {range_m: 3, range_start_m: 3.5}}\n"), HasSubstr("range_start_m"));
  EXPECT_THAT(refusal(point + "sonar: {ping: {range_m: 3, range_start_m: 3, rows: 10, bits: 16}}\n"),
              HasSubstr("must be below range_m"));
}

TEST(RenderFile, WithAProfileBinsAndPulseScaleWithTheRange) {
  const RenderJob whole = parsed(point + "sonar: {profile: oculus-m1200d, ping: {mode: HF}}\n").jobs.at(0);
  const RenderJob half =
      parsed(point + "sonar: {profile: oculus-m1200d, ping: {mode: 2, range_m: " + std::to_string(whole.settings.range_m / 2) +
             "}}\n")
          .jobs.at(0);
  EXPECT_EQ(whole.mode().name, "HF");
  EXPECT_EQ(half.mode().name, "HF");
  EXPECT_EQ(half.settings.range_bin_count, whole.settings.range_bin_count);
  EXPECT_NEAR(half.settings.range_bin_m, whole.settings.range_bin_m / 2, 1e-9);
  EXPECT_NEAR(static_cast<double>(half.settings.pulse_width_m), static_cast<double>(whole.settings.pulse_width_m) / 2, 1e-6);
}

TEST(RenderFile, ASweepReadsTheFileOnceForEachStep) {
  const RenderInput input = parsed(R"(
scene: {objects: [{type: point, target_strength_db: 0, pose: {xyz_m: [$r, 0, $(-2*r)]}}]}
sonar: {ping: {range_m: $reach}}
sweep: {r: [2, 3]}
let: {reach: 2*r + 1}
)");
  ASSERT_EQ(input.jobs.size(), 2u);
  EXPECT_EQ(input.jobs[1].scene->point_targets.at(0).position_m.x, 3);
  EXPECT_EQ(input.jobs[1].scene->point_targets.at(0).position_m.z, -6);
  EXPECT_EQ(input.jobs[0].settings.range_m, 5);
  EXPECT_EQ(input.jobs[1].settings.range_m, 7);
}

TEST(RenderFile, ErrorsHaveTheLineAndTheKey) {
  EXPECT_THAT(refusal(point + "sonar: {ping: {rnage_m: 4}}\n"), AllOf(HasSubstr("r.yaml:5"), HasSubstr("range_m")));
  EXPECT_THAT(refusal(point + "sonar: {profile: oculus-m1300d}\n"), HasSubstr("oculus-m1200d"));
  EXPECT_THAT(refusal(point + "sonar: {options: {pulse: native}}\n"), HasSubstr("which is not given"));
  for (const char* mode : {"0", "3", "-1"})
    EXPECT_THAT(refusal(point + "sonar: {profile: oculus-m1200d, ping: {mode: " + mode + "}}\n"), HasSubstr("ping.mode")) << mode;
  EXPECT_THAT(refusal(point + "sonar: {ping: {range_m: 1000, row_spacing_m: 0.001}}\n"),
              HasSubstr("ping.row_spacing_m: the picture would have 1000000 rows of 0.001 m, and may have 65535: "));
  EXPECT_THAT(refusal(point + "sonar: {ping: {range_m: 1000, pulse_width_m: 0.0001}}\n"), HasSubstr("ping.pulse_width_m: the "));
  EXPECT_THAT(refusal("scene: no-such-scene.yaml\n"), HasSubstr("no such file"));
  EXPECT_THAT(refusal("sonar: {}\n"), HasSubstr("scene"));
  EXPECT_THAT(refusal(point + "sweep: {a: [1, 2], b: [1]}\n"), HasSubstr("equally long"));
  EXPECT_THAT(refusal(point + "seed: $q\n"), HasSubstr("r.yaml:5: "));
  EXPECT_THAT(refusal(point + "let: {a: 1/0}\n"), HasSubstr("finite"));
}

TEST(RenderFile, ErrorsInASceneAreBadDataInAnyFile) {
  const auto kind = [](const std::string& text) {
    const auto input = parse_render_file(text, "r.yaml", ".");
    return input ? ErrorKind::bug : input.error().kind;
  };
  const std::string rest = "\nsonar: {ping: {range_m: 4}}\nexpect: []\n";
  EXPECT_EQ(kind("scene: {objects: [{type: ball}]}" + rest), ErrorKind::bad_data);
  EXPECT_EQ(kind("scene: {objects: [{type: sphere, radius_m: -1}]}" + rest), ErrorKind::bad_data);
  EXPECT_EQ(kind("scene: {objects: [], object: 1}" + rest), ErrorKind::bad_data) << "an unknown key is found last";
  const std::string file = testing::TempDir() + "/render_file_test_scene.yaml";
  std::ofstream(file) << "objects: [{type: ball}]\n";
  EXPECT_EQ(kind("scene: " + file + rest), ErrorKind::bad_data) << "the kind of error of load_scene()";
  EXPECT_THAT(refusal("scene: " + file + rest), HasSubstr("r.yaml:1:8: scene: "));
  // A mistake in the render file itself is an error of configuration.
  EXPECT_EQ(kind("scene: {objects: []}\nsonar: {ping: {range_m: -4}}\n"), ErrorKind::config);
  EXPECT_EQ(kind("scene: {objects: []}\nsonr: {}\n"), ErrorKind::config);
  EXPECT_EQ(kind("scene: no-such-scene.yaml\n"), ErrorKind::config) << "as for world.scene of a configuration";
}

TEST(RenderFile, ThePulseIsThatOfTheMode) {
  const auto rows = [](const std::string& ping) {
    const PingSettings s = parsed(point + "sonar: {profile: oculus-m1200d, ping: {" + ping + "}}\n").jobs.at(0).settings;
    return static_cast<double>(s.pulse_width_m) / s.range_bin_m;
  };
  EXPECT_NEAR(rows("mode: LF, range_m: 25"), 0.9, 1e-5);
  EXPECT_NEAR(rows("mode: HF"), 0.71, 1e-5) << "the first mode is LF";
  EXPECT_NEAR(rows("mode: HF, range_m: 2, rows: 703"), 0.71, 1e-5);
}

TEST(RenderFile, ARangeThatTheProductDoesNotHaveGetsANote) {
  const auto note = [](const std::string& sonar) { return note_of_range(parsed(point + "sonar: {" + sonar + "}\n").jobs.at(0)); };
  EXPECT_EQ(note("profile: oculus-m1200d, ping: {mode: HF, range_m: 10}"), "");
  EXPECT_EQ(note("profile: oculus-m1200d, ping: {mode: LF, range_m: 25}"), "");
  EXPECT_EQ(note("profile: oculus-m1200d, ping: {mode: HF, range_m: 25}"),
            "range 25 m: Oculus M1200d in mode HF accepts 0.1 to 10 m; rendered anyway, where the device would use 10 m");
  EXPECT_THAT(note("profile: oculus-m370s, ping: {range_m: 0.15}"), HasSubstr("accepts 0.2 to 200 m"));
  EXPECT_EQ(note("ping: {range_m: 600}"), "") << "a sonar without a profile has no limits";
  EXPECT_EQ(note("ping: {range_m: 0.01}"), "");
}

TEST(Npy, HeadersAreAlignedAndHaveTypeAndShape) {
  const std::string header = npy_header("<f4", {437, 512});
  EXPECT_EQ(header.size() % 64, 0u);
  EXPECT_EQ(header.substr(1, 5), "NUMPY");
  EXPECT_EQ(header.back(), '\n');
  EXPECT_THAT(header, HasSubstr("{'descr': '<f4', 'fortran_order': False, 'shape': (437, 512), }"));
  EXPECT_EQ(static_cast<unsigned char>(header[8]) + 256u * static_cast<unsigned char>(header[9]), header.size() - 10);
}

TEST(RenderJob, MovesObjectsAlongTheirTrajectories) {
  RenderInput input = parsed(
      "scene: {materials: {a: {lambert_db: -20}}, objects: [{name: ball, type: sphere, moving: true, material: a, "
      "radius_m: 1, pose: {xyz_m: [5, 0, 0]}}]}\n");
  RenderJob& job = input.jobs.at(0);
  const std::string digest_at_rest = digest_of(input, 0);
  EXPECT_EQ(make_request(job, world_of(job), PingNumber{1}, Time{}).bodies_in_world.at(0).position_m.x, 5);
  motion::Points points{{motion::Ns{0}, std::chrono::seconds(10)}, {{{0, 0, 0}, {}}, {{10, 0, 0}, {}}}, {}, {}};
  job.config.objects = {{"ball", {std::make_shared<const motion::Trajectory>(std::move(points))}, {}}};
  EXPECT_EQ(make_request(job, world_of(job), PingNumber{1}, Time{} + std::chrono::seconds(4)).bodies_in_world.at(0).position_m.x,
            4);
  EXPECT_NE(digest_of(input, 0), digest_at_rest);
}

TEST(Digest, FollowsEverythingThatChangesAPing) {
  const RenderInput input = parsed(point);
  const std::string digest = digest_of(input, 0);
  const auto changed = [&](auto&& change) {
    RenderInput other = input;
    change(other.jobs[0]);
    return digest_of(other, 0) != digest;
  };
  EXPECT_EQ(digest_of(parsed(point), 0), digest);
  EXPECT_NE(digest_of(input, 5), digest);
  EXPECT_TRUE(changed([](RenderJob& j) { j.config.seed = 2; }));
  EXPECT_TRUE(changed([](RenderJob& j) { j.config.engine.switches.volume = false; }));
  EXPECT_TRUE(changed([](RenderJob& j) { j.settings.gain_db = 1; }));
  const auto way = [](double z_m) {
    return std::make_shared<const motion::Trajectory>(motion::Points{{motion::Ns{0}}, {{{0, 0, z_m}, {}}}, {}, {}});
  };
  EXPECT_TRUE(changed([&](RenderJob& j) { j.vehicle().plan.trajectory = way(0); }));
  RenderInput follows = input, elsewhere = input;
  follows.jobs[0].vehicle().plan.trajectory = way(0);
  elsewhere.jobs[0].vehicle().plan.trajectory = way(1);
  EXPECT_NE(digest_of(follows, 0), digest_of(elsewhere, 0));
  EXPECT_TRUE(changed([](RenderJob& j) { j.config.water.ph = 7; }));
  EXPECT_FALSE(changed([](RenderJob& j) { j.config.engine.threads = 3; }));
}

TEST(ResolutionCell, FollowsThePulseInUse) {
  RenderJob job = parsed(point + "sonar: {ping: {pulse_width_m: 0.03, device_sound_speed_mps: 1500}}\n").jobs.at(0);
  const auto energy_per_width = [&](const std::string& waveform) {
    const RenderJob other =
        parsed(point + "sonar: {ping: {pulse_width_m: 0.03, device_sound_speed_mps: 1500}, model: {waveform: " + waveform +
               "}}\n")
            .jobs.at(0);
    const ResolutionCell cell = cell_of(other);
    return cell.energy_s / (2 * cell.pulse_width_m / 1500);
  };
  // Integral of |p|^2 over its -3 dB width: Gaussian sqrt(pi / (4 ln 2)); triangle (2 / 3) / (2 - sqrt 2).
  EXPECT_NEAR(energy_per_width("{shape: gaussian}"), std::sqrt(pi / (4 * std::log(2.0))), 1e-6);
  EXPECT_NEAR(energy_per_width("{shape: cw}"), 2.0 / 3 / (2 - std::sqrt(2.0)), 1e-3);
  EXPECT_NEAR(cell_of(job).pulse_width_m, 0.03, 1e-9);
  // A measured triangle rises in 20 samples of 100 kHz. The cell has the width of this pulse, not that of the settings.
  std::string samples;
  for (int n = -20; n <= 20; ++n) samples += (n > -20 ? ", [" : "[") + std::to_string(1 - std::abs(n) / 20.0) + ", 0]";
  const RenderJob measured =
      parsed(point +
             "sonar: {ping: {pulse_width_m: 0.03, device_sound_speed_mps: 1500}, model: {waveform: {shape: measured, "
             "sample_rate_hz: 1e5, samples: [" +
             samples + "]}}}\n")
          .jobs.at(0);
  EXPECT_NEAR(cell_of(measured).pulse_width_m, 750 * 2e-4 * (2 - std::sqrt(2.0)), 1e-3);
  EXPECT_NEAR(cell_of(measured).energy_s, 2e-4 * 2 / 3, 1e-6);
  EXPECT_NEAR(cell_of(measured).beam_u, cell_of(job).beam_u, 1e-12);
}

/// Returns the coverage of a level bed 2 m below a sonar without a profile.
Coverage coverage_with(const std::string& waveform) {
  const RenderJob job =
      with_bed_only(parsed("scene: {objects: [{type: plane, material: sand, size_m: [40, 40], pose: {xyz_m: [0, 0, -12]}}]}\n"
                           "poses: {at: {frame: ENU_FLU, xyz_m: [0, 0, -10], rpy_deg: [0, 14, 0]}}\n"
                           "sonar: {ping: {range_m: 8, beams: 65}, model: {waveform: " +
                           waveform + "}}\n")
                        .jobs.at(0));
  Parallel pool(2);
  PingRequest request = make_request(job, world_of(job), PingNumber{1}, Time{});
  request.switches.keep_pressure = true;
  const auto coverage = measure_coverage(job, make_engine(job.scene, pool, {})->run({&request, 1}).at(0));
  if (!coverage) throw std::runtime_error(coverage.error().text);
  return *coverage;
}

TEST(Coverage, UsesTheEnergyOfThePulseInUse) {
  for (const char* shape : {"{shape: gaussian}", "{shape: cw}", "{shape: lfm}"}) {
    const Coverage c = coverage_with(shape);
    EXPECT_GT(c.bins, 1000u) << shape;
    EXPECT_NEAR(c.mean_db, 0, 0.05) << shape;
    EXPECT_GE(c.percent(), 99.9) << shape;
  }
}

TEST(Coverage, RefusesPingsThatItCannotCompare) {
  RenderJob job = shipped_sonars_over_a_bed().front();
  Ping ping;
  ping.request = make_request(job, world_of(job), PingNumber{1}, Time{});
  ping.request.sonar_in_world.orientation = quat_from_rpy({0.1, 0.2, 0});
  EXPECT_THAT(measure_coverage(job, ping).error().text, HasSubstr("roll"));
  ping.request.sonar_in_world.orientation = {};
  job.config.engine.switches.mode = Mode::paper;
  EXPECT_THAT(measure_coverage(job, ping).error().text, HasSubstr("canonical"));
  job.config.engine.switches = {};
  job.config.engine.switches.conical = false;
  EXPECT_THAT(measure_coverage(job, ping).error().text, HasSubstr("conical"));
}

TEST(Sidecar, HasTheSwitchesThatTookEffect) {
  RenderInput input = parsed(point + "sonar: {ping: {range_m: 6, beams: 65}}\n");
  RenderJob& job = input.jobs.at(0);
  Parallel pool(1);
  const auto switches_told = [&](const std::string& part) {
    const auto engine = make_engine(job.scene, pool, {});
    const PingRequest request = make_request(job, world_of(job), PingNumber{1}, Time{});
    return sidecar(job, engine->run({&request, 1}).at(0), engine->description(), engine->statistics(), "")["switches"][part]
        .get<bool>();
  };
  EXPECT_TRUE(switches_told("specular"));
  job.config.engine.switches.multipath = true;
  EXPECT_TRUE(switches_told("multipath"));
  job.config.engine.switches.fixed_fan = 8;
  EXPECT_FALSE(switches_told("multipath"));
  EXPECT_TRUE(switches_told("specular"));
  job.config.engine.switches.mode = Mode::paper;
  for (const NamedSwitch& part : named_switches) EXPECT_FALSE(switches_told(part.name)) << part.name;
}

}  // namespace
}  // namespace sonar::render
