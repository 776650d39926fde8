#include "daemon/commands/dataset/labelled_ping.hpp"

#include <algorithm>
#include <map>
#include <stdexcept>

#include "core/image/draw_fan.hpp"
#include "core/image/gray_png.hpp"
#include "core/pipeline/labels.hpp"
#include "core/scene/instances.hpp"
#include "daemon/commands/render/label_json.hpp"
#include "daemon/commands/render/sidecar.hpp"
#include "daemon/emulator/view/ping_payloads.hpp"
#include "daemon/server/engine/start_engine.hpp"
#include "daemon/server/system/sha256.hpp"

namespace sonar::dataset {
namespace {

using nlohmann::json;

constexpr std::size_t cell_cache_bytes = 96u << 20;  // each thread has an engine

std::vector<std::byte> bytes_of_text(const std::string& text) {
  const auto bytes = std::as_bytes(std::span(text));
  return {bytes.begin(), bytes.end()};
}

std::string visible_of(const Scene& scene) {
  std::string flags;
  for (const Object& o : scene.objects) flags += o.visible ? '1' : '0';
  return flags;
}

/// Pixels per class. Pixels without an instance are in a shadow or show no object.
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

/// Numbers the first hit of each beam as the labels do: 0 for none.
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

/// A new scene is put into the existing engine, which keeps the trees and cells of meshes that both scenes share (shapes_).
Result<DrawnPing> PingMaker::compute(std::uint64_t number, Ping& ping) {
  auto drawn = draw_ping(job_, number, known_);
  if (!drawn) return drawn;
  const std::string key = drawn->scene_key + "\n" + visible_of(*drawn->job.scene);
  // An engine is used again while the scene and the visibility of its objects are the same.
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
