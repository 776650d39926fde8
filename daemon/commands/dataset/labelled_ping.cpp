#include "daemon/commands/dataset/labelled_ping.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <stdexcept>

#include "core/image/draw_fan.hpp"
#include "core/pipeline/labels.hpp"
#include "core/scene/instances.hpp"
#include "daemon/commands/render/sidecar.hpp"
#include "daemon/emulator/view/ping_payloads.hpp"
#include "daemon/server/engine/start_engine.hpp"
#include "daemon/server/system/sha256.hpp"

namespace sonar::dataset {
namespace {

using nlohmann::json;

constexpr std::uint64_t most_pings_shown = 12;
constexpr int across = 3, sheet_width_px = 280, gap_px = 4;
constexpr float dimmed = 0.6f, tint = 0.75f;
constexpr Rgb shadow_colour{70, 130, 230};
constexpr std::array<Rgb, 6> class_colours{
    {{80, 220, 120}, {240, 90, 160}, {250, 220, 80}, {90, 220, 230}, {190, 130, 250}, {250, 140, 60}}};

/// Returns the colour of a class, which depends on the position of its name.
Rgb colour_of(const std::vector<std::string>& classes, const std::string& name) {
  const auto place = std::ranges::lower_bound(classes, name) - classes.begin();
  return class_colours[static_cast<std::size_t>(place) % class_colours.size()];
}

std::vector<std::string> classes_of_things(const Scene& scene) {
  std::vector<std::string> classes;
  for (std::size_t i = 0; i < instance_count(scene); ++i)  // hidden objects too, so that a class has one colour in all pings
    if (i >= scene.objects.size() || !scene.objects[i].label.empty()) classes.push_back(instance_class(scene, i));
  std::ranges::sort(classes);
  classes.erase(std::unique(classes.begin(), classes.end()), classes.end());
  return classes;
}

/// Mixes a colour over the picture where the samples of a mask are 1.
void colour_mask(Raster& raster, FanPainter& painter, PolarImage& mask, Rgb colour) {
  const auto drawn = painter.draw(mask);
  if (!drawn) return;
  for (std::size_t i = 0; i < raster.pixels.size(); ++i) {
    const Rgb covered = drawn->pixels[i];
    if (covered == outside_colour || covered.r == 0) continue;
    const auto at = static_cast<int>(i);
    blend(raster, at % raster.width, at / raster.width, colour, tint * static_cast<float>(covered.r) / 255);
  }
}

void draw_box(Raster& raster, int x0, int y0, int x1, int y1, Rgb colour) {
  for (int x = x0; x <= x1; ++x) blend(raster, x, y0, colour, 1), blend(raster, x, y1, colour, 1);
  for (int y = y0; y <= y1; ++y) blend(raster, x0, y, colour, 1), blend(raster, x1, y, colour, 1);
}

void copy_into(Raster& to, const Raster& from, int left, int top) {
  for (int y = 0; y < from.height; ++y)
    for (int x = 0; x < from.width; ++x) to.at(left + x, top + y) = from.at(x, y);
}

}  // namespace

std::vector<std::uint64_t> pings_on_sheet(std::uint64_t pings) {
  const std::uint64_t count = std::min(pings, most_pings_shown);
  std::vector<std::uint64_t> numbers;
  for (std::uint64_t i = 0; i < count; ++i) numbers.push_back(1 + i * pings / count);
  return numbers;
}

Result<std::optional<Raster>> contact_cell(const Ping& ping, const Scene& scene, const json& annotations) {
  if (ping.request.settings.beam_count < 2) return std::nullopt;
  const auto copper = find_colour_map("copper"), gray = find_colour_map("gray");
  if (!copper || !gray) return tl::make_unexpected(copper ? gray.error() : copper.error());
  const FanStyle style{.width_px = sheet_width_px, .colours = *copper, .rings = false};
  PolarImage polar = polar_image_of(ping);
  const SampleFormat& format = ping.request.settings.format;
  // Samples are pressures: with the square root, a wall and the weaker bed before it are both visible.
  if (format.bits > 8 && format.scale == SampleFormat::Scale::linear)
    for (float& sample : polar.samples) sample = std::sqrt(sample * polar.full_scale);
  const auto picture = draw_fan(polar, style);
  if (!picture) return tl::make_unexpected(picture.error());
  Raster labelled = *picture;
  for (Rgb& p : labelled.pixels)
    if (p != outside_colour)
      p = {static_cast<std::uint8_t>(dimmed * p.r), static_cast<std::uint8_t>(dimmed * p.g),
           static_cast<std::uint8_t>(dimmed * p.b)};

  FanPainter painter({.width_px = sheet_width_px, .colours = *gray, .rings = false});
  // From here on the samples of `polar` are a mask: first of the shadows, then of each instance in turn.
  polar.full_scale = 1;
  const PingLabels& labels = *ping.labels;
  std::ranges::transform(labels.caster, polar.samples.begin(), [](std::uint16_t caster) { return caster != 0 ? 1.0f : 0.0f; });
  colour_mask(labelled, painter, polar, shadow_colour);
  const std::vector<std::string> classes = classes_of_things(scene);
  const FanLayout from = fan_layout(polar, {.width_px = render::cartesian_width_px, .colours = {}, .rings = false});
  const FanLayout to = fan_layout(polar, style);
  // Boxes of annotations are pixels of a larger picture; they are scaled about the apex of the fan.
  const double scale = from.metres_per_pixel / to.metres_per_pixel;
  for (const json& thing : annotations) {
    const auto instance = thing["instance"].get<std::uint16_t>();
    const Rgb colour = colour_of(classes, thing["class"].get<std::string>());
    std::ranges::transform(labels.instance, polar.samples.begin(),
                           [&](std::uint16_t label) { return label == instance ? 1.0f : 0.0f; });
    colour_mask(labelled, painter, polar, colour);
    const json& box = thing["cartesian"]["bbox"];
    const auto x = [&](double px) { return static_cast<int>(std::lround(to.apex_x + (px - from.apex_x) * scale)); };
    const auto y = [&](double px) { return static_cast<int>(std::lround(to.apex_y + (px - from.apex_y) * scale)); };
    const double left = box[0], top = box[1], width = box[2], height = box[3];
    draw_box(labelled, x(left) - 1, y(top) - 1, x(left + width) + 1, y(top + height) + 1, colour);
  }
  Raster cell(2 * sheet_width_px + gap_px, picture->height);
  copy_into(cell, *picture, 0, 0);
  copy_into(cell, labelled, sheet_width_px + gap_px, 0);
  return cell;
}

Raster contact_sheet(const std::vector<Raster>& cells) {
  int height_px = 1;
  for (const Raster& cell : cells) height_px = std::max(height_px, cell.height);
  const int columns = std::min(across, static_cast<int>(cells.size())), wide = cells.front().width + 4 * gap_px;
  Raster sheet(columns * wide, (static_cast<int>(cells.size()) + across - 1) / across * (height_px + gap_px));
  for (std::size_t i = 0; i < cells.size(); ++i)
    copy_into(sheet, cells[i], static_cast<int>(i) % across * wide, static_cast<int>(i) / across * (height_px + gap_px));
  return sheet;
}

namespace {

using nlohmann::json;

constexpr std::size_t cell_cache_bytes = 96u << 20;  // small, because each thread has an engine

std::vector<std::byte> bytes_of_text(const std::string& text) {
  const auto bytes = std::as_bytes(std::span(text));
  return {bytes.begin(), bytes.end()};
}

std::string visible_of(const Scene& scene) {
  std::string flags;
  for (const Object& o : scene.objects) flags += o.visible ? '1' : '0';
  return flags;
}

/// Counts the pixels of each class. Pixels without an instance are in a shadow or show no object.
json pixels_of(const PingLabels& labels, const Scene& scene) {
  std::vector<std::uint64_t> by_instance(labels.visible.size() + 1);
  std::uint64_t shadow = 0;
  for (std::size_t i = 0; i < labels.instance.size(); ++i)
    ++by_instance[labels.instance[i]], shadow += labels.caster[i] != 0 ? 1 : 0;
  std::map<std::string, std::uint64_t> by_class{{"none", by_instance[0] - shadow}, {"shadow", shadow}};
  for (std::size_t i = 1; i < by_instance.size(); ++i)
    if (by_instance[i] > 0) by_class[instance_class(scene, i - 1)] += by_instance[i];
  return by_class;
}

/// Replaces the object of the first hit of each beam with its number in the labels; 0 if there is no hit.
void number_as_instances(json& truth) {
  json instance = json::array();
  for (const json& object : truth["object"]) instance.push_back(object.is_null() ? 0U : object.get<std::uint32_t>() + 1);
  truth["instance"] = std::move(instance);
  truth.erase("object");
}

std::string scene_digest(const std::string& scene_key) {
  Sha256 hash;
  hash.add(std::as_bytes(std::span(scene_key)));
  return hash.hex().substr(0, 16);
}

Result<Raster> draw(const Ping& ping, int width_px) {
  const auto colours = find_colour_map("viridis");
  if (!colours) return tl::make_unexpected(colours.error());
  return draw_fan(polar_image_of(ping), {.width_px = width_px, .colours = *colours, .rings = false});
}

}  // namespace

/// Computes a ping. A new scene is put into the existing engine, which keeps the trees and cells of meshes that both scenes share
/// (shapes_).
Result<DrawnPing> PingMaker::compute(std::uint64_t number, Ping& ping) {
  auto drawn = draw_ping(job_, number, known_);
  if (!drawn) return drawn;
  const std::string key = drawn->scene_key + "\n" + visible_of(*drawn->job.scene);
  // The engine gets a new scene only if the scene or the visibility of its objects differs.
  if (!engine_ || key != engine_key_) {
    const SimdLevel simd = simd_.value_or(drawn->job.config.engine.simd);
    // start_engine() returns the engine that `make` returned; it is kept.
    const auto make = [&](std::shared_ptr<const Scene> s) -> std::unique_ptr<PingEngine> {
      std::unique_ptr<ChangingEngine> engine = std::move(engine_);
      if (engine)
        engine->change_scene(s);
      else
        engine = make_changing_engine(std::move(s), one_, {.simd = simd, .cell_cache_bytes = cell_cache_bytes});
      return engine;
    };
    auto started = start_engine(make, drawn->job.scene);
    if (!started) return tl::make_unexpected(started.error());
    engine_.reset(static_cast<ChangingEngine*>(started->release()));
    engine_key_ = key;
  }
  // The next draw may use this scene again without loading it.
  known_ = {drawn->scene_key, drawn->whole_scene, &shapes_};
  try {
    PingRequest request = request_of(*drawn, number);
    if (const std::string why = why_unlabelled(request, *drawn->job.scene); !why.empty()) throw std::invalid_argument(why);
    request.switches.keep_labels = true;
    ping = std::move(engine_->run({&request, 1}).front());
  } catch (const std::invalid_argument& refused) {
    return failure(ErrorKind::config, job_.source + ": ping " + std::to_string(number) + ": " + refused.what());
  }
  return drawn;
}

Result<LabelledPing> PingMaker::make(std::uint64_t number) {
  Ping ping;
  const auto drawn = compute(number, ping);
  if (!drawn) return tl::make_unexpected(drawn.error());
  const PingSettings& s = ping.request.settings;
  if (s.format.bits > 16)
    return failure(ErrorKind::config, job_.source + ": samples of 32 bits do not fit a PNG file; set sonar.ping.bits to 8 or 16");
  const PingLabels& labels = *ping.labels;
  LabelledPing made;
  made.width = s.beam_count, made.height = s.range_bin_count, made.negative = drawn->negative;
  Result<void> done;
  const auto put_picture = [&](const char* ending, std::span<const std::byte> values, int bits) {
    // After an error no more pictures are encoded; the error is returned below.
    if (!done) return;
    auto png = encode_gray_png(values, made.width, made.height, bits);
    if (png)
      made.files.emplace_back(ending, *std::move(png));
    else
      done = tl::make_unexpected(png.error());
  };
  put_picture("samples.png", ping.samples, s.format.bits);
  put_picture("labels.png", std::as_bytes(std::span(labels.instance)), 16);
  put_picture("share.png", std::as_bytes(std::span(labels.share)), 8);
  put_picture("caster.png", std::as_bytes(std::span(labels.caster)), 16);
  if (!done) return tl::make_unexpected(done.error());
  const Scene& scene = *drawn->job.scene;
  made.annotations = render::annotations_of(labels, ping, scene);
  made.pixels = pixels_of(labels, scene);
  made.scene = scene_digest(drawn->scene_key);
  made.draws = drawn->draws.words;
  if (std::ranges::binary_search(on_sheet_, number)) {
    auto cell = contact_cell(ping, scene, made.annotations);
    if (!cell) return tl::make_unexpected(cell.error());
    made.cell = *std::move(cell);
  }
  json words = render::sidecar(drawn->job, ping, engine_->description(), engine_->statistics(), inputs_);
  words.erase("sweep");
  words["draws"] = drawn->draws.words;
  for (const auto& [name, value] : drawn->draws.numbers) words["draws"][name] = value;
  words["attempt"] = drawn->attempt;
  words["negative"] = drawn->negative;
  words["instances"] = render::instances_of(scene);
  words["layout"] = render::layout_of(ping);
  words["annotations"] = made.annotations;
  number_as_instances(words["truth"]);
  if (job_.fan && made.width >= 2) {
    constexpr int fan_width_px = 1000;
    const auto fan = draw(ping, fan_width_px);
    if (!fan) return tl::make_unexpected(fan.error());
    auto png = encode_png(*fan);
    if (!png) return tl::make_unexpected(png.error());
    made.files.emplace_back("fan.png", *std::move(png));
  }
  made.files.emplace_back("json",
                          bytes_of_text(words.dump() + "\n"));  // last, so that a reader of the stream then has the whole ping
  return made;
}

Result<std::optional<Raster>> PingMaker::cell(std::uint64_t number) {
  Ping ping;
  const auto drawn = compute(number, ping);
  if (!drawn) return tl::make_unexpected(drawn.error());
  const Scene& scene = *drawn->job.scene;
  return contact_cell(ping, scene, render::annotations_of(*ping.labels, ping, scene));
}

}  // namespace sonar::dataset
