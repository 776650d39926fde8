// The keys of `expect:`.
#include <array>

#include "core/text/strict_yaml.hpp"
#include "tests/oracles/expectation.hpp"

namespace sonar::render {
namespace {

using text::Map;
using text::Node;
using text::Range;

struct MeasureName {
  std::string_view name, unit;
};
/// The names and units of the measures, in the order of Measure.
constexpr std::array<MeasureName, 8> measures{{{"peak_level_db", "dB"},
                                               {"peak_range_m", "m"},
                                               {"peak_bearing_deg", "deg"},
                                               {"mean_level_db", "dB"},
                                               {"energy_db", "dB"},
                                               {"strength_db", "dB"},
                                               {"coverage_percent", "%"},
                                               {"coverage_worst_db", "dB"}}};

Window read_window(Map& keys) {
  Window w;
  const auto range = keys.optional("range_m").numbers_or<2>({w.from_m, w.to_m}, Range::at_least(0));
  const auto azimuth = keys.optional("azimuth_deg").numbers_or<2>({w.from_deg, w.to_deg}, Range::between(-180, 180));
  return {range[0], range[1], azimuth[0], azimuth[1]};
}

Expectation read_one(const Node& node) {
  Map keys = node.map();
  Expectation e;
  e.place = node.location();
  e.oracle = static_cast<int>(keys.optional("oracle").integer_or(0, 0, 46));
  std::vector<std::string_view> names;
  for (const MeasureName& m : measures) names.push_back(m.name);
  e.measure = static_cast<Measure>(keys.required("measure").choice_index(std::move(names)));
  e.over = keys.optional("over").choice_or(Over::each,
                                           {{"each", Over::each}, {"slope", Over::slope}, {"difference", Over::difference}});
  if (e.over == Over::slope) e.against = keys.required("against").text(64);
  e.what = keys.optional("what").text_or(name_of(e.measure), 200);
  e.window = read_window(keys);
  if (const Node less = keys.optional("less")) {
    Map window = less.map();
    e.less = read_window(window);
  }
  const Node value = keys.optional("value"), least = keys.optional("at_least"), most = keys.optional("at_most");
  if (value.present() + least.present() + most.present() != 1) {
    node.fail("give the expected value: value and within, or at_least, or at_most");
    return e;
  }
  e.bound = least.present()  ? Expectation::Bound::at_least
            : most.present() ? Expectation::Bound::at_most
                             : Expectation::Bound::near;
  e.value = (value.present() ? value : least.present() ? least : most).text(1000);
  if (value.present()) e.within = keys.required("within").number(Range::at_least(0));
  return e;
}

}  // namespace

Result<std::vector<Expectation>> read_expectations(const std::string& text, const std::string& source, const Values& values) {
  const auto filled = substitute(text, values, source);
  if (!filled) return tl::make_unexpected(filled.error());
  const auto document = text::parse_yaml(*filled, source, {.error_kind = ErrorKind::config});
  if (!document) return tl::make_unexpected(document.error());
  Map root = document->root();
  root.entries();  // parse_render_file() reads the other keys
  std::vector<Expectation> all;
  for (const Node& node : root.required("expect").items(1, 100)) all.push_back(read_one(node));
  if (auto error = document->finish()) return tl::make_unexpected(*std::move(error));
  return all;
}

std::string name_of(Measure measure) { return std::string(measures[static_cast<std::size_t>(measure)].name); }

std::string unit_of(const Expectation& e) {
  const std::string unit(measures[static_cast<std::size_t>(e.measure)].unit);
  return e.over == Over::slope ? unit + "/decade" : unit;
}

}  // namespace sonar::render
