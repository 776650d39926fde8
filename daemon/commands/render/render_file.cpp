// Reads the input of `sonard render`: a configuration, or a render file with its sweep.
#include <algorithm>

#include "core/base/regular_file.hpp"
#include "core/text/format.hpp"
#include "core/text/strict_yaml.hpp"
#include "daemon/commands/render/render_job.hpp"
#include "daemon/config/config_parts.hpp"
#include "daemon/config/load_config.hpp"
#include "daemon/config/scene_file.hpp"
#include "daemon/emulator/world/world_parts.hpp"
#include "protocol/host.hpp"

namespace sonar::render {
namespace {

using text::Map;
using text::Node;
using text::Range;

constexpr std::size_t most_steps = 1000;

/// Returns the model of a sonar without a profile: a wide fan of beams of 1 by 20 degrees, at 900 kHz, with 16-bit samples.
SonarModel plain_model() {
  FrequencyMode mode;
  mode.name = "plain";
  mode.centre_hz = 900e3f;
  mode.horizontal_aperture_rad = static_cast<float>(rad_from_deg(90));
  mode.min_range_m = 1e-3f;
  mode.max_range_m = 1e5f;
  mode.source_level_db = 210;
  mode.pattern.azimuth_width_rad = static_cast<float>(rad_from_deg(1));
  mode.pattern.elevation_width_rad = static_cast<float>(rad_from_deg(20));
  mode.receiver.full_scale_upa = 1e9f;
  SonarModel model;
  model.profile = model.name = "plain";
  model.modes = {mode};
  return model;
}

PingSettings plain_settings(const Water& water, double depth_m, const FrequencyMode& mode) {
  PingSettings s;
  s.pulse_width_m = 0.0254f;
  s.device_sound_speed_mps = static_cast<float>(true_sound_speed_mps(water, depth_m));
  s.device_absorption_db_per_m = static_cast<float>(absorption_db_per_m(water, depth_m, static_cast<double>(mode.centre_hz)));
  s.format = {.bits = 16, .max_code = 65535, .gamma = 1, .row_gains = false};
  return s;
}

/// Reads the poses of the vehicle. A file of poses replaces `at` and `orbit`.
void read_path(const Node& node, const std::filesystem::path& folder, RenderJob& job) {
  if (!node.present()) return;
  Map keys = node.map();
  job.vehicle().initial_pose = read_world_pose(keys.optional("at"));
  job.vehicle().orbits = keys.optional("orbit").boolean_or(false);
  const TrajectoryKeys trajectory(keys);
  if (!trajectory.file) return;
  const TrajectoryFiles::Named named = TrajectoryFiles(folder).read(trajectory);
  const std::string body = trajectory.body.text_or({}, 64);
  if (!named.file) return;
  if (const auto r = follow(job, *named.file, named.name, body); !r) trajectory.file.fail(r.error().text);
}

/// Reads the sonar; the job must already have the water and the vehicle's poses.
void read_sonar(const Node& node, RenderJob& job) {
  Map keys = node.map();
  const Node profile_node = keys.optional("profile"), options = keys.optional("options");
  SonarConfig& sonar = job.sonar();
  sonar.name = keys.optional("name").text_or("sonar", 64);
  sonar.mount = read_mount(keys.optional("mount"));
  sonar.bearings = read_enum(keys.optional("bearing"), sonar.bearings, bearings_names);
  const Node ping = keys.optional("ping"), model_node = keys.optional("model");
  protocol::Profile& profile = sonar.profile = {nullptr, std::make_shared<const SonarModel>(plain_model())};
  if (profile_node.present()) {
    auto found = protocol::find_profile(profile_node.text(64));
    if (!found) return profile_node.fail(found.error().text);
    profile = *std::move(found);
    sonar.options = read_options(options, *profile.vendor);
    auto tuned = profile.vendor->tuned(profile.model, sonar.options);
    if (!tuned) return options.fail(tuned.error().text);
    profile.model = *std::move(tuned);
  } else if (options.present()) {
    return options.fail("need a profile, which is not given");
  }
  const int first_mode = profile.vendor ? device_settings(job).mode : 0;
  const int mode = read_mode(ping.map().optional("mode"), *profile.model, first_mode);
  if (model_node.present()) {  // without changes the model stays the same object, for which tables are cached
    SonarModel model = *profile.model;
    read_model(model_node.map(), model.modes[static_cast<std::size_t>(mode)]);
    profile.model = std::make_shared<const SonarModel>(std::move(model));
  }
  job.settings =
      profile.vendor ? device_settings(job) : plain_settings(job.config.water, first_depth_m(job), profile.model->modes.front());
  job.settings.mode = mode;
  RowsOf rows = profile.vendor ? RowsOf::device : RowsOf::no_device;
  if (const auto cell_m = range_cell_m(job)) {
    rows = RowsOf::range_image;
    job.settings.pulse_width_m = *cell_m;
  } else if (profile.vendor && mode != first_mode) {
    job.settings.pulse_width_m = pulse_of_mode_m(job);
  }
  read_ping(ping.map(), *profile.model, rows, job.settings);
}

/// Reads the scene from inline keys, or from the file that `node` names. An error in the scene is bad data, as in a scene file.
/// Everything else must be read before, because later errors of the document count as errors of the scene.
Result<std::shared_ptr<const Scene>> read_scene_of(const Node& node, const std::filesystem::path& folder, const std::string& name,
                                                   const text::Document& document, ShapeCache* known) {
  if (node.is_map()) {
    std::shared_ptr<const Scene> scene = read_scene(node.map(), folder, name, known);
    if (auto error = document.finish()) return failure(ErrorKind::bad_data, std::move(error->text));
    return scene;
  }
  const SceneFile file = read_scene_file(node, folder);
  if (auto error = document.finish()) return tl::make_unexpected(*std::move(error));
  auto scene = load_scene(file);
  if (!scene) return failure(scene.error().kind, node.location() + ": " + node.path() + ": " + scene.error().text);
  return *std::move(scene);
}

/// Reads the scene last, because its errors are of another kind.
Result<RenderJob> read_job(const text::Document& document, const std::string& name, const std::filesystem::path& folder,
                           const Values& values, ShapeCache* known) {
  Map root = document.root();
  RenderJob job;
  job.values = values;
  job.name = root.optional("name").text_or(std::filesystem::path(name).stem().string(), 200);
  root.optional("about").text_or("", 4096);
  job.config.water = read_water(root.optional("water"));
  job.config.seed = root.optional("seed").unsigned_integer_or(1);
  const bool is_product = root.optional("sonar").map().has("profile");
  job.config.engine = read_engine(root.optional("engine"), is_product ? product_switches : Switches{});
  read_path(root.optional("poses"), folder, job);
  const Node scene_node = root.required("scene");
  read_sonar(root.optional("sonar"), job);
  root.optional("sweep").map().entries();
  root.optional("let").map().entries();
  // Keys of a data set's job, and of an oracle (tests/oracles).
  for (const char* key : {"dataset", "vary", "constraints", "counts", "expect"}) root.optional(key);
  if (auto error = document.finish()) return tl::make_unexpected(*error);
  auto scene = read_scene_of(scene_node, folder, job.name, document, known);
  if (!scene) return tl::make_unexpected(scene.error());
  job.scene = *std::move(scene);
  return job;
}

/// Returns the values of each step of the sweep, with those of `let`; one step if there is no sweep.
Result<std::vector<Values>> read_steps(const text::Document& document) {
  Map root = document.root();
  std::vector<Values> steps(1);
  bool first = true;
  for (const auto& [name, list] : root.optional("sweep").map().entries()) {
    const auto items = list.items(1, most_steps);
    if (first) steps.resize(std::max<std::size_t>(items.size(), 1));
    if (items.size() != steps.size()) list.fail("lists of a sweep must be equally long");
    for (std::size_t i = 0; i < std::min(items.size(), steps.size()); ++i) steps[i][name] = items[i].number();
    first = false;
  }
  for (const auto& [name, formula] : root.optional("let").map().entries())
    for (Values& step : steps) {
      const auto value = evaluate(formula.text(1000), step);
      if (!value) formula.fail(value.error().text);
      step[name] = value.value_or(0);
    }
  if (auto error = document.error()) return tl::make_unexpected(*error);
  return steps;
}

Result<std::string> text_of_file(const std::filesystem::path& file) {
  auto text = read_regular(file, text::YamlLimits{}.max_bytes);  // if the file is too long, reads one byte more than the limit
  if (text && text->empty()) return failure(ErrorKind::missing_file, "cannot read " + file.string() + ": it is empty");
  return text;
}

Result<RenderInput> from_config(const std::filesystem::path& file, const std::string& text, const std::string& sonar) {
  auto config = parse_config(text, file.string(), file.parent_path());
  if (!config) return tl::make_unexpected(config.error());
  std::size_t index = 0;
  const std::string names = text::joined(config->sonars, ", ", &SonarConfig::name);
  while (index < config->sonars.size() && config->sonars[index].name != sonar) ++index;
  if (sonar.empty() && config->sonars.size() > 1)
    return failure(ErrorKind::usage, file.string() + " has several sonars, choose one: --sonar " + config->sonars[0].name +
                                         " (there are " + names + ")");
  if (sonar.empty()) index = 0;
  if (index == config->sonars.size())
    return failure(ErrorKind::usage, "no sonar \"" + sonar + "\" in " + file.string() + "; there are " + names);
  const auto scene = load_scene(config->scene, config->origin);
  if (!scene) return tl::make_unexpected(scene.error());
  if (std::string why = why_not_movable(**scene, *config); !why.empty()) return failure(ErrorKind::config, std::move(why));
  RenderJob job;
  job.name = file.stem().string();
  job.scene = *scene;
  job.config = *std::move(config);
  job.sonar_index = index;
  for (VehicleConfig& v : job.config.vehicles) v.plan.rules = {};  // trajectories keep the times of the file
  for (ObjectConfig& o : job.config.objects) o.plan.rules = {};
  job.settings = device_settings(job);
  RenderInput input{file.string(), {}, text};
  if (!job.config.scene.built_in)
    if (const auto more = text_of_file(job.config.scene.path)) input.text += *more;
  input.jobs.push_back(std::move(job));
  return input;
}

bool is_scene(const Map& root) { return root.has("objects") && !root.has("scene") && !root.has("world"); }

std::string what_to_do_with_a_scene(const std::filesystem::path& file) {
  const std::string scene = std::filesystem::absolute(file).lexically_normal().string();
  return file.string() + " is a scene, without a sonar. A render file names a scene and a sonar: echo '{scene: \"" + scene +
         "\", sonar: {profile: " + std::string(protocol::makes().front().demo_profile) +
         "}, poses: {at: {frame: ENU_FLU, xyz_m: [0, 0, -3]}}}' > render.yaml && "
         "sonard render render.yaml --out pings (docs/render.md)";
}

}  // namespace

Result<text::Document> with_numbers(const text::Document& outline, const Values& values, const std::string& name) {
  return outline.changed([&](const std::string& text, int line) { return substitute(text, values, name, line); });
}

Result<RenderInput> parse_render_file(std::string_view text, const std::string& name, const std::filesystem::path& folder) {
  const auto outline = text::parse_yaml(text, name, {.error_kind = ErrorKind::config});
  if (!outline) return tl::make_unexpected(outline.error());
  auto jobs = read_render_jobs(*outline, name, folder);
  if (!jobs) return tl::make_unexpected(jobs.error());
  return RenderInput{name, *std::move(jobs), std::string(text)};
}

Result<std::vector<RenderJob>> read_render_jobs(const text::Document& outline, const std::string& name,
                                                const std::filesystem::path& folder, ShapeCache* known) {
  const auto steps = read_steps(outline);
  if (!steps) return tl::make_unexpected(steps.error());
  std::vector<RenderJob> jobs;
  for (const Values& values : *steps) {
    const auto filled = with_numbers(outline, values, name);
    if (!filled) return tl::make_unexpected(filled.error());
    auto job = read_job(*filled, name, folder, values, known);
    if (!job) return tl::make_unexpected(job.error());
    jobs.push_back(*std::move(job));
  }
  return jobs;
}

/// Loads a file, whose kind depends on a key: `world` is in a configuration, `objects` in a scene, `dataset` in a job; other
/// files are render files.
Result<RenderInput> load_render_input(const std::filesystem::path& file, const std::string& sonar) {
  const auto text = text_of_file(file);
  if (!text) return tl::make_unexpected(text.error());
  const auto outline = text::parse_yaml(*text, file.string(), {.error_kind = ErrorKind::config});
  if (!outline) return tl::make_unexpected(outline.error());
  Map root = outline->root();
  if (is_scene(root)) return failure(ErrorKind::config, what_to_do_with_a_scene(file));
  if (root.has("dataset"))
    return failure(ErrorKind::config,
                   file.string() + " is the job of a data set: sonard dataset " + file.string() + " --out DIR");
  const bool is_config = root.has("world");
  if (!is_config && !sonar.empty())
    return failure(ErrorKind::usage, "--sonar is for configurations; " + file.string() + " is a render file");
  auto input = is_config ? from_config(file, *text, sonar) : parse_render_file(*text, file.string(), file.parent_path());
  if (!input) return input;
  if (const Node scene = root.optional("scene"); !is_config && scene.present() && !scene.is_map()) {
    const SceneFile its = read_scene_file(scene, file.parent_path());
    if (const auto more = its.built_in ? Result<std::string>{} : text_of_file(its.path)) input->text += *more;
  }
  const bool wants_motion =
      root.optional("engine").map().optional("motion").choice_or<bool>(false, {{"on", true}, {"off", false}});
  for (RenderJob& job : input->jobs) job.wants_motion = wants_motion;
  return input;
}

}  // namespace sonar::render
