#include "protocol/recording/mcap/mcap_json.hpp"

#include <cmath>
#include <nlohmann/json.hpp>
#include <set>

namespace sonar::recording::mcap {
namespace {

using Json = nlohmann::ordered_json;

/// Writes JSON. Replaces bytes that are not UTF-8, which names of scenes may contain, so that no name makes a recording fail.
std::string text_of(const Json& json) { return json.dump(-1, ' ', false, Json::error_handler_t::replace); }

Json json_of(Time at) {
  const auto since = at.time_since_epoch();
  const auto whole = std::chrono::floor<std::chrono::seconds>(since);
  return {{"sec", whole.count()}, {"nsec", (since - whole).count()}};
}

Json json_of(const Pose& pose) {
  const Vec3d& p = pose.position_m;
  const Quatd& q = pose.orientation;
  return {{"position", {{"x", p.x}, {"y", p.y}, {"z", p.z}}}, {"orientation", {{"x", q.x}, {"y", q.y}, {"z", q.z}, {"w", q.w}}}};
}

/// Returns the objects that the beams hit, each once.
Json objects_hit(const PingTruth& truth) {
  std::set<std::uint32_t> hit;
  for (const BeamTruth& beam : truth.beams)
    if (truth.names != nullptr && beam.object < truth.names->objects.size()) hit.insert(beam.object);
  Json objects = Json::array();
  for (const std::uint32_t object : hit) objects.push_back({{"index", object}, {"name", truth.names->objects[object]}});
  return objects;
}

Json moving_bodies(const PingTruth& truth) {
  Json bodies = Json::array();
  for (std::size_t i = 0; truth.names != nullptr && i < truth.names->bodies.size() && i < truth.bodies_in_world.size(); ++i)
    bodies.push_back({{"name", truth.names->bodies[i]}, {"pose", json_of(truth.bodies_in_world[i])}});
  return bodies;
}

}  // namespace

// Beams refer to objects with numbers. The names are listed once, so that the text of 512 beams is short.
std::string truth_json(const PingTruth& truth) {
  Json ranges_m = Json::array(), objects = Json::array();
  for (const BeamTruth& beam : truth.beams) {
    const bool hit = beam.object != BeamTruth::nothing;
    ranges_m.push_back(hit ? beam.range_m : 0.0f);
    objects.push_back(hit ? Json(beam.object) : Json(-1));
  }
  return text_of({{"timestamp", json_of(truth.fired_at)},
                  {"ping", truth.ping},
                  {"sonar_in_world", json_of(truth.sonar_in_world)},
                  {"range_m", std::move(ranges_m)},
                  {"object", std::move(objects)},
                  {"objects", objects_hit(truth)},
                  {"bodies", moving_bodies(truth)}});
}

// Only the instances that occur in the labels are listed. 0 is "no instance".
std::string instances_json(const PingTruth& truth, const PingLabels& labels) {
  std::set<std::size_t> named(labels.instance.begin(), labels.instance.end());
  named.insert(labels.caster.begin(), labels.caster.end());
  named.erase(0);
  Json instances = Json::array();
  for (const std::size_t i : named) {
    if (truth.names == nullptr || i > truth.names->instances.size()) continue;
    const SceneNames::Instance& of = truth.names->instances[i - 1];
    Json one{{"instance", i}, {"name", of.name}, {"class", of.of_class}};
    const float visible = i <= labels.visible.size() ? labels.visible[i - 1] : -1;
    if (visible >= 0) one["visible"] = std::round(1e3 * static_cast<double>(visible)) / 1e3;
    instances.push_back(std::move(one));
  }
  return text_of({{"timestamp", json_of(truth.fired_at)}, {"ping", truth.ping}, {"instances", std::move(instances)}});
}

// ---- the schemas

namespace {

Json type(const char* name) { return {{"type", name}}; }
Json object(Json properties) { return {{"type", "object"}, {"properties", std::move(properties)}}; }
Json array(Json items) { return {{"type", "array"}, {"items", std::move(items)}}; }
Json timestamp() { return object({{"sec", type("integer")}, {"nsec", type("integer")}}); }
Json pose() {
  Json position{{"x", type("number")}, {"y", type("number")}, {"z", type("number")}};
  Json orientation = position;
  orientation["w"] = type("number");
  return object({{"position", object(std::move(position))}, {"orientation", object(std::move(orientation))}});
}

JsonSchema schema(const char* title, const char* description, Json properties) {
  return {title,
          text_of({{"title", title}, {"description", description}, {"type", "object"}, {"properties", std::move(properties)}})};
}

}  // namespace

JsonSchema truth_schema() {
  return schema(
      "sonard.PingTruth",
      "Poses of the sonar and of the moving bodies; per beam (port first) range and index of the first object, -1 = none",
      {{"timestamp", timestamp()},
       {"ping", type("integer")},
       {"sonar_in_world", pose()},
       {"range_m", array(type("number"))},
       {"object", array(type("integer"))},
       {"objects", array(object({{"index", type("integer")}, {"name", type("string")}}))},
       {"bodies", array(object({{"name", type("string")}, {"pose", pose()}}))}});
}

JsonSchema label_schema() {
  return schema(
      "sonard.PingInstances",
      "What the numbers in labels and casters of a ping are; visible: of objects with a label, the part of their energy "
      "that nothing in the way takes",
      {{"timestamp", timestamp()},
       {"ping", type("integer")},
       {"instances", array(object({{"instance", type("integer")},
                                   {"name", type("string")},
                                   {"class", type("string")},
                                   {"visible", type("number")}}))}});
}

JsonSchema fault_schema() {
  const auto text = type("string");  // also the type of 64-bit numbers, as in protobuf's JSON
  return schema("sonard.FaultEntry", "What a fault on purpose did: FaultEntry of control.proto",
                {{"seq", text},
                 {"utc_ns", text},
                 {"mono_ns", text},
                 {"time_ns", text},
                 {"event", text},
                 {"fault", text},
                 {"do", text},
                 {"kind", text},
                 {"sonar", text},
                 {"client", text},
                 {"client_number", text},
                 {"ping", type("integer")},
                 {"offset", text},
                 {"bytes_before", text},
                 {"bytes_after", text},
                 {"with", type("object")}});
}

}  // namespace sonar::recording::mcap
