#include "core/scene/files/gdal_metadata.hpp"

#include <cmath>
#include <string>

#include "core/base/trimmed.hpp"
#include "core/scene/files/geo_keys.hpp"
#include "core/scene/files/height_values.hpp"

namespace sonar {
namespace {

constexpr auto npos = std::string_view::npos;

/// The value of an attribute in the text between "<Item" and ">".
std::string_view attribute(std::string_view tag, std::string_view name) {
  for (std::size_t at = tag.find(name); at != npos; at = tag.find(name, at + 1)) {
    const std::size_t equals = at + name.size();
    if (at == 0 || tag[at - 1] != ' ' || equals + 1 >= tag.size() || tag[equals] != '=') continue;
    const char quote = tag[equals + 1];
    const std::size_t end = tag.find(quote, equals + 2);
    if ((quote == '"' || quote == '\'') && end != npos) return tag.substr(equals + 2, end - equals - 2);
  }
  return {};
}

std::optional<std::uint16_t> unit_called(std::string_view word) {
  if (word == "ft" || word == "foot" || word == "feet" || word == "international foot") return unit_foot;
  if (word == "US survey foot" || word == "ftUS" || word == "us-ft") return unit_us_survey_foot;
  if (word == "km" || word == "kilometre" || word == "kilometer") return unit_kilometre;
  return word == "m" || word == "metre" || word == "meter" || word == "metres" || word == "meters"
             ? std::optional<std::uint16_t>(unit_metre)
             : std::nullopt;
}

}  // namespace

GdalMetadata gdal_metadata_of(std::string_view text) {
  GdalMetadata metadata;
  constexpr std::string_view begin = "<Item";
  for (std::size_t at = text.find(begin); at != npos; at = text.find(begin, at + 1)) {
    const std::size_t close = text.find('>', at);
    if (close == npos) break;
    const std::string_view tag = text.substr(at + begin.size(), close - at - begin.size());
    const std::string_view sample = attribute(tag, "sample"), role = attribute(tag, "role"),
                           value = trimmed(text.substr(close + 1, text.find('<', close) - close - 1), " \t\r\n");
    if (!sample.empty() && sample != "0") continue;
    const auto number = [&] { return height_number(value).value_or(NAN); };
    if (role == "unittype") metadata.height_unit = unit_called(value);
    if (role == "scale") metadata.scale = number();
    if (role == "offset") metadata.offset = number();
  }
  return metadata;
}

}  // namespace sonar
