#include "daemon/commands/dataset/contact_sheet.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <nlohmann/json.hpp>
#include <string>

#include "core/image/draw_fan.hpp"
#include "core/scene/instances.hpp"
#include "daemon/commands/render/label_json.hpp"
#include "daemon/emulator/view/ping_payloads.hpp"

namespace sonar::dataset {
namespace {

using nlohmann::json;

constexpr std::uint64_t most_pings_shown = 12;
constexpr int across = 3, sheet_width_px = 280, gap_px = 4;
constexpr float dimmed = 0.6f, tint = 0.75f;
constexpr Rgb shadow_colour{70, 130, 230};
constexpr std::array<Rgb, 6> class_colours{
    {{80, 220, 120}, {240, 90, 160}, {250, 220, 80}, {90, 220, 230}, {190, 130, 250}, {250, 140, 60}}};

/// Each class has a colour, which depends on its position among the names.
Rgb colour_of(const std::vector<std::string>& classes, const std::string& name) {
  const auto place = std::ranges::lower_bound(classes, name) - classes.begin();
  return class_colours[static_cast<std::size_t>(place) % class_colours.size()];
}

std::vector<std::string> classes_of_things(const Scene& scene) {
  std::vector<std::string> classes;
  for (std::size_t i = 0; i < instance_count(scene); ++i)  // hidden ones too: a class has one colour in all pings
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
  if (format.bits > 8 && format.scale == SampleFormat::Scale::linear)  // pressure: the root shows a wall and the bed before it
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

}  // namespace sonar::dataset
