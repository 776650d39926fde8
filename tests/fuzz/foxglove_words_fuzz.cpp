// Fuzzes JSON that viewers send. Accepted values are within their limits, and a refusal is one sentence; both can be sent back as
// a status.
#include <nlohmann/json.hpp>
#include <string_view>

#include "protocol/foxglove/foxglove_words.hpp"
#include "tests/fuzz/byte_script.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace sonar::foxglove;
  using sonar::fuzz::require;
  const std::string text(reinterpret_cast<const char*>(data), size);
  std::string stray;
  const auto word = word_of_viewer(text, &stray);
  if (!word) {
    require(!word.error().text.empty() && word.error().text.find('\n') == std::string::npos);
    return 0;
  }
  require(stray.size() <= 64 && nlohmann::json::accept(status(StatusLevel::warning, stray)));
  if (const auto* set = std::get_if<SetParameters>(&*word)) {
    require(set->parameters.size() <= most_parameters);
    const auto json = nlohmann::json::parse(parameter_values(set->parameters, set->request));
    require(json["parameters"].size() == set->parameters.size());
  }
  if (const auto* get = std::get_if<GetParameters>(&*word)) require(get->names.size() <= most_parameters);
  if (const auto* unknown = std::get_if<UnknownWord>(&*word))
    require(nlohmann::json::accept(status(StatusLevel::warning, unknown->op)));
  return 0;
}
