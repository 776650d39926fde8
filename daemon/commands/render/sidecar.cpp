#include "daemon/commands/render/sidecar.hpp"

#include <bit>
#include <cmath>

#include <nlohmann/json.hpp>

#include "core/pipeline/water_line.hpp"
#include "core/sonar/range_image.hpp"
#include "daemon/commands/options/sonar_version.hpp"
#include "daemon/config/products.hpp"
#include "daemon/emulator/world/world_parts.hpp"
#include "daemon/server/system/sha256.hpp"

namespace sonar::render {
namespace {

using nlohmann::json;

json json_of(Vec3d v) { return {v.x, v.y, v.z}; }
json json_of(const Pose& pose) {
  const Quatd& q = pose.orientation;
  return {{"xyz_m", json_of(pose.position_m)}, {"wxyz", {q.w, q.x, q.y, q.z}}};
}
double deg(float rad) { return deg_from_rad(static_cast<double>(rad)); }
/// Returns null for an infinite number, because JSON has none.
json finite(float x) { return std::isfinite(x) ? json(x) : json(nullptr); }

const char* name_of(Taper taper) {
  constexpr const char* names[] = {"uniform", "taylor30", "hamming", "hann", "unit"};
  return names[static_cast<int>(taper)];
}
const char* name_of(Waveform::Shape shape) {
  constexpr const char* names[] = {"gaussian", "cw", "lfm", "measured"};
  return names[static_cast<int>(shape)];
}

const char* name_of(BeamSpacing spacing) {
  constexpr const char* names[] = {"uniform_in_sine", "uniform_in_angle", "listed"};
  return names[static_cast<int>(spacing)];
}

json json_of(const SonarModel& model, const FrequencyMode& mode) {
  const ReceiverModel& law = mode.receiver;
  return {{"profile", model.profile},
          {"model", model.name},
          {"mode", mode.name},
          {"centre_hz", mode.centre_hz},
          {"aperture_deg", deg(mode.horizontal_aperture_rad)},
          {"source_level_db", mode.source_level_db},
          {"beam_spacing", name_of(mode.beam_spacing)},
          {"interleaved_pings", mode.interleaved_pings},
          {"azimuth_width_deg", deg(mode.pattern.azimuth_width_rad)},
          {"azimuth_taper", name_of(mode.pattern.azimuth_taper)},
          {"elevation_width_deg", deg(mode.pattern.elevation_width_rad)},
          {"elevation_taper", name_of(mode.pattern.elevation_taper)},
          {"elevation_width_is", mode.pattern.elevation_width_is == ElevationWidthIs::one_way ? "one_way" : "two_way"},
          {"waveform",
           {{"shape", name_of(mode.waveform.shape)},
            {"sweep_s", mode.waveform.sweep_s},
            {"falling", mode.waveform.falling},
            {"exact", mode.waveform.exact},
            {"samples", mode.waveform.samples.size()}}},
          {"receiver",
           {{"tvg_slope_db", law.tvg_slope_db},
            {"tvg_minimum_range_m", law.tvg_minimum_range_m},
            {"tvg_ceiling_db", finite(law.tvg_ceiling_db)},
            {"full_scale_upa", law.full_scale_upa},
            {"noise_figure_db", law.noise_figure_db},
            {"crosstalk_db", law.crosstalk_db},
            {"noise_width", law.noise_width},
            {"defocus", law.defocus},
            {"profile",
             {{"noise_db", law.profile.noise_db},
              {"near_noise_db", law.profile.near_noise_db},
              {"near_m", law.profile.near_m},
              {"blend", law.profile.blend}}},
            {"channel_gain_db", law.channel_gain_db},
            {"shared_noise",
             {{"level_db", law.shared_noise.level_db},
              {"channels", law.shared_noise.channels},
              {"group", law.shared_noise.group},
              {"sine", law.shared_noise.sine},
              {"full_m", law.shared_noise.full_m},
              {"steady", law.shared_noise.steady},
              {"focus_rows", law.shared_noise.focus_rows},
              {"nearest_focus_m", law.shared_noise.nearest_focus_m}}},
            {"truncates", law.truncates},
            {"leak_upa", law.leak_upa},
            {"leak_ring_db", law.leak_ring_db},
            {"leak_ring_step_m", law.leak_ring_step_m},
            {"leak_decay_db_per_m", law.leak_decay_db_per_m},
            {"leak_is_shared", law.leak_is_shared}}}};
}

json json_of(const PingSettings& s) {
  return {{"mode", s.mode + 1},
          {"beams", s.beam_count},
          {"rows", s.range_bin_count},
          {"range_m", s.range_m},
          {"range_start_m", s.range_start_m},
          {"row_spacing_m", s.range_bin_m},
          {"row_centre", s.row_centre},
          {"pulse_width_m", s.pulse_width_m},
          {"samples_per_row", s.samples_per_row},
          {"rate_hz", s.rate_hz},
          {"ping_interval_s", s.ping_interval_s},
          {"gain_db", s.gain_db},
          {"tvg", s.tvg},
          {"device_sound_speed_mps", s.device_sound_speed_mps},
          {"device_absorption_db_per_m", s.device_absorption_db_per_m},
          {"bits", s.format.bits},
          {"max_code", s.format.max_code},
          {"gamma", s.format.gamma},
          {"row_gains", s.format.row_gains},
          {"scale", s.format.scale == SampleFormat::Scale::linear ? "linear" : "logarithmic"},
          {"floor_db", s.format.floor_db},
          {"ceiling_db", s.format.ceiling_db}};
}

json json_of(const Switches& switches) {
  json all{{"mode", name_of(switches.mode)}, {"expected_power", switches.expected_power}, {"fixed_fan", switches.fixed_fan}};
  for (const NamedSwitch& part : named_switches) all[part.name] = switches.*part.is_on;
  return all;
}

json json_of(const Water& water) {
  return {{"temperature_c", water.temperature_c},
          {"salinity_psu", water.salinity_psu},
          {"ph", water.ph},
          {"sound_speed_mps", water.sound_speed_mps}};
}

/// Returns range, index and name of the first object that each beam hit; null for a beam that hit none.
json truth_of(const Ping& ping, const Scene& scene) {
  json range = json::array(), object = json::array(), name = json::array();
  for (const BeamTruth& t : ping.truth) {
    const bool hit = t.object != BeamTruth::nothing;
    range.push_back(hit ? json(t.range_m) : json(nullptr));
    object.push_back(hit ? json(t.object) : json(nullptr));
    name.push_back(hit ? json(scene.objects[t.object].name) : json(nullptr));
  }
  return {{"first_hit_m", range}, {"object", object}, {"object_name", name}};
}

void add(Sha256& hash, const json& value) {
  const std::string text = value.dump();
  hash.add(std::as_bytes(std::span(text.data(), text.size())));
}

void add_trajectory(Sha256& hash, const std::shared_ptr<const motion::Trajectory>& trajectory, Time begins_at) {
  if (!trajectory) return;
  const motion::Points& p = trajectory->points();
  add(hash, {begins_at.time_since_epoch().count(), p.times.size()});
  hash.add(std::as_bytes(std::span(p.times)));
  hash.add(std::as_bytes(std::span(p.poses)));
  hash.add(std::as_bytes(std::span(p.velocities_mps)));
  hash.add(std::as_bytes(std::span(p.angular_velocities_radps)));
}

/// Adds meshes by their content, not by the names of their files.
void add_scene(Sha256& hash, const Scene& scene) {
  for (const Object& o : scene.objects) {
    add(hash, {o.name, o.label, o.visible, json_of(o.in_world)});
    hash.add(std::as_bytes(std::span(o.mesh->vertices)));
    hash.add(std::as_bytes(std::span(o.mesh->triangles)));
    hash.add(std::as_bytes(std::span(o.mesh->material)));
  }
  for (const Material& m : scene.materials)
    add(hash,
        {m.name, m.lambert_db, m.roughness_m, m.reflection, m.trend_db_per_decade, m.texture.shape, m.gsab.a_db, m.gsab.c_db});
}

}  // namespace

json sidecar(const RenderJob& job, const Ping& ping, const std::string& engine, const PingStatistics& count,
             const std::string& digest) {
  const PingRequest& r = ping.request;
  const PingSettings& s = r.settings;
  const FrequencyMode& mode = ping.mode();
  const bool of_ranges = range_image_of(r) != nullptr;  // the rows of a range image are elevations, so they have no range
  json settings = json_of(s);
  if (of_ranges) settings["row_spacing_m"] = nullptr;
  const double depth_m = depth_from_z(r.sonar_in_world.position_m.z);
  return {{"sonard", version},
          {"inputs", digest},
          {"ping", static_cast<std::uint32_t>(r.number)},
          {"time_s", seconds(r.fired_at.time_since_epoch())},
          {"scene", job.scene->name},
          {"sweep", job.values},
          {"sonar", json_of(*r.model, mode)},
          {"sonar_name", job.sonar().name},
          {"settings", std::move(settings)},
          {"row_0_m", of_ranges ? json(nullptr) : json(s.range_of_row(0))},
          {"row_spacing_m", of_ranges ? json(nullptr) : json(s.range_bin_m)},
          {"beam_azimuth_rad", ping.beam_azimuth_rad},
          {"row_gain", ping.row_gain},
          {"water",
           [&] {
             json water = json_of(r.water);
             water["true_sound_speed_mps"] = true_sound_speed_mps(r.water, depth_m);
             water["absorption_db_per_m"] = absorption_db_per_m(r.water, depth_m, static_cast<double>(mode.centre_hz));
             return water;
           }()},
          {"bearing", bearings_names[static_cast<std::size_t>(r.bearings)]},
          {"sonar_in_world", json_of(r.sonar_in_world)},
          {"vehicle_in_world", json_of(r.vehicle_in_world)},
          {"above_sea_surface", is_in_air(r.sonar_in_world, *job.scene)},
          {"twist",
           {{"velocity_mps", json_of(r.sonar_moves.velocity_mps)},
            {"angular_rate_radps", json_of(r.sonar_moves.angular_rate_radps)}}},
          {"seed", static_cast<std::uint64_t>(r.seed)},
          {"switches", json_of(effective_switches(r.switches))},
          {"engine", engine},
          {"counts", {{"rays", count.rays}, {"echoes", count.echoes}, {"tiles", count.tiles}, {"cells", count.cells}}},
          {"truth", truth_of(ping, *job.scene)}};
}

/// Everything that can change a byte of the pings must be added here: pings with an equal digest are not rendered again.
std::string digest_of(const RenderInput& input, double rate_hz, bool plain_pictures) {
  Sha256 hash;
  add(hash, {version, input.text, rate_hz});
  if (plain_pictures) add(hash, "plain pictures");
  for (const RenderJob& job : input.jobs) {
    add(hash, json_of(job.model(), job.mode()));
    hash.add(std::as_bytes(std::span(job.mode().waveform.samples)));
    add(hash,
        {json_of(job.settings), json_of(job.config.water), json_of(job.config.engine.switches), job.config.seed, job.sonar_index,
         job.values, static_cast<int>(job.config.engine.simd) + 16 * static_cast<int>(job.config.engine.device),
         json_of(job.sonar().mount), static_cast<int>(job.sonar().bearings), json_of(job.vehicle().initial_pose),
         job.vehicle().orbits});
    add_trajectory(hash, job.vehicle().plan.trajectory, job.begins_at);
    if (job.snapshots) add(hash, "snapshots");
    // The index of a moving object is added, because its trajectory alone does not say which object moves.
    const std::vector<BodyStart> bodies = bodies_of(*job.scene, job.config);
    for (std::size_t i = 0; i < bodies.size(); ++i) {
      if (bodies[i].plan) add(hash, i);
      add_trajectory(hash, bodies[i].plan.trajectory, job.begins_at);
    }
    add_scene(hash, *job.scene);
  }
  return hash.hex();
}

static_assert(std::endian::native == std::endian::little, "arrays are written in the byte order of the memory");

std::string npy_header(std::string_view type, std::initializer_list<std::size_t> shape) {
  std::string sizes;
  for (const std::size_t n : shape) sizes += std::to_string(n) + (shape.size() == 1 ? "," : ", ");
  if (shape.size() > 1) sizes.resize(sizes.size() - 2);
  std::string dictionary = "{'descr': '" + std::string(type) + "', 'fortran_order': False, 'shape': (" + sizes + "), }";
  constexpr std::size_t before = 10, multiple = 64;  // bytes of magic, version and length, before the dictionary
  const std::size_t whole = (before + dictionary.size() + 1 + multiple - 1) / multiple * multiple;
  dictionary.resize(whole - before - 1, ' ');
  dictionary += '\n';
  std::string header("\x93NUMPY\x01\x00", 8);
  header += static_cast<char>(dictionary.size() & 0xff);
  header += static_cast<char>(dictionary.size() >> 8);
  return header + dictionary;
}

}  // namespace sonar::render
