#include "daemon/commands/render/sidecar.hpp"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <vector>

#include "core/image/draw_fan.hpp"
#include "core/scene/instances.hpp"

namespace sonar::render {
namespace {

using nlohmann::json;

constexpr int beams_per_edge = 4;  // largest distance between corners of a polygon along an arc

/// Returns whether an instance is annotated: objects with a label and point targets are.
bool is_thing(const Scene& scene, std::size_t i) {
  const std::size_t objects = scene.objects.size();
  return i < objects ? !scene.objects[i].label.empty() : true;
}

PolarImage shape_of(const Ping& ping) {
  const PingSettings& s = ping.request.settings;
  PolarImage shape;
  shape.rows = static_cast<std::size_t>(s.range_bin_count), shape.beams = static_cast<std::size_t>(s.beam_count);
  shape.row_spacing_m = s.range_bin_m;
  shape.start_m = s.range_start_m;
  shape.azimuth_rad.assign(ping.beam_azimuth_rad.begin(), ping.beam_azimuth_rad.end());
  return shape;
}

/// Converts corners between beams and rows to positions in the picture of the fan.
class Cartesian {
 public:
  explicit Cartesian(const PolarImage& shape)
      : shape_(shape), layout_(fan_layout(shape, {.width_px = cartesian_width_px, .colours = {}, .rings = false})) {}
  const FanLayout& layout() const { return layout_; }
  std::pair<double, double> at(Corner corner) const {
    const auto& azimuth = shape_.azimuth_rad;
    // Beam k spans [k - 1/2, k + 1/2] of the table; beyond an end, the spacing of the last two beams continues.
    const double beam = corner.x - 0.5;
    const auto left = static_cast<std::size_t>(std::clamp(std::floor(beam), 0.0, static_cast<double>(azimuth.size()) - 2));
    const double angle = azimuth[left] + (beam - static_cast<double>(left)) * (azimuth[left + 1] - azimuth[left]);
    const double radius = (shape_.start_m + corner.y * shape_.row_spacing_m) / layout_.metres_per_pixel;
    return {layout_.apex_x - radius * std::sin(angle), layout_.apex_y - radius * std::cos(angle)};
  }

 private:
  const PolarImage& shape_;
  FanLayout layout_;
};

double tenth(double x) { return std::round(10 * x) / 10; }

/// Returns the box [left, top, width, height] around all polygons, in pixels.
json box_of(const std::vector<json>& polygons) {
  double low[2] = {HUGE_VAL, HUGE_VAL}, high[2] = {-HUGE_VAL, -HUGE_VAL};
  for (const json& polygon : polygons)
    for (std::size_t i = 0; i < polygon.size(); ++i) {
      low[i % 2] = std::min(low[i % 2], polygon[i].get<double>());
      high[i % 2] = std::max(high[i % 2], polygon[i].get<double>());
    }
  return {tenth(low[0]), tenth(low[1]), tenth(high[0] - low[0]), tenth(high[1] - low[1])};
}

json polar_polygon(const Outline& outline) {
  json polygon = json::array();
  for (const Corner& c : outline) polygon.push_back(c.x), polygon.push_back(c.y);
  return polygon;
}

/// Converts an outline to a polygon. Edges along an arc are divided, because a straight line would cut the arc.
json cartesian_polygon(const Outline& outline, const Cartesian& cartesian) {
  json polygon = json::array();
  for (std::size_t i = 0; i < outline.size(); ++i) {
    const Corner from = outline[i], to = outline[(i + 1) % outline.size()];
    const int parts = std::max(1, (std::abs(to.x - from.x) + beams_per_edge - 1) / beams_per_edge);
    for (int p = 0; p < parts; ++p) {
      const auto [x, y] = cartesian.at({from.x + (to.x - from.x) * p / parts, from.y + (to.y - from.y) * p / parts});
      polygon.push_back(tenth(x)), polygon.push_back(tenth(y));
    }
  }
  return polygon;
}

struct Box {
  int x0 = 1 << 30, y0 = 1 << 30, x1 = 0, y1 = 0, pixels = 0;
};

}  // namespace

json instances_of(const Scene& scene) {
  json all = json::array();
  for (std::size_t i = 0; i < instance_count(scene); ++i) {
    if (i < scene.objects.size() && !scene.objects[i].visible) continue;
    all.push_back({{"instance", i + 1},
                   {"name", instance_name(scene, i)},
                   {"class", instance_class(scene, i)},
                   {"thing", is_thing(scene, i)}});
  }
  return all;
}

json layout_of(const Ping& ping) {
  if (ping.beam_azimuth_rad.size() < 2) return nullptr;
  const PolarImage shape = shape_of(ping);
  const FanLayout layout = Cartesian(shape).layout();
  return {{"width", layout.width},
          {"height", layout.height},
          {"apex", {layout.apex_x, layout.apex_y}},
          {"metres_per_pixel", layout.metres_per_pixel}};
}

json annotations_of(const PingLabels& labels, const Ping& ping, const Scene& scene) {
  std::vector<Box> boxes(labels.visible.size());
  const auto beams = static_cast<std::size_t>(labels.beams);
  const auto at = [&](int x, int y) {
    return labels.instance[static_cast<std::size_t>(y) * beams + static_cast<std::size_t>(x)];
  };
  // Finds the box of every instance in one pass, so that outlines() looks only at the samples in a box.
  for (int y = 0; y < labels.rows; ++y)
    for (int x = 0; x < labels.beams; ++x) {
      if (at(x, y) == 0) continue;
      Box& box = boxes[at(x, y) - 1u];
      box.x0 = std::min(box.x0, x), box.x1 = std::max(box.x1, x + 1);
      box.y0 = std::min(box.y0, y), box.y1 = std::max(box.y1, y + 1);
      ++box.pixels;
    }
  const PolarImage shape = shape_of(ping);
  json all = json::array();
  for (std::size_t i = 0; i < boxes.size(); ++i) {
    const Box& box = boxes[i];
    if (box.pixels == 0 || !is_thing(scene, i)) continue;
    std::vector<json> polar, cartesian;
    for (const Outline& outline :
         outlines(box.x0, box.y0, box.x1, box.y1, [&](int x, int y) { return at(x, y) == static_cast<int>(i + 1); })) {
      polar.push_back(polar_polygon(outline));
      if (labels.beams > 1) cartesian.push_back(cartesian_polygon(outline, Cartesian(shape)));
    }
    json one{{"instance", i + 1},
             {"name", instance_name(scene, i)},
             {"class", instance_class(scene, i)},
             {"bbox", {box.x0, box.y0, box.x1 - box.x0, box.y1 - box.y0}},
             {"area", box.pixels},
             {"visible", std::round(1e3 * static_cast<double>(labels.visible[i])) / 1e3},
             {"segmentation", polar}};
    if (labels.beams > 1) one["cartesian"] = {{"bbox", box_of(cartesian)}, {"segmentation", cartesian}};
    all.push_back(std::move(one));
  }
  return all;
}

}  // namespace sonar::render
