#include "clients/sonarctl/argument_checks.hpp"

#include <CLI/CLI.hpp>

#include "clients/sonarctl/net.hpp"
#include "core/image/colour_map.hpp"
#include "core/text/arguments.hpp"

namespace sonar::clients {
namespace {

template <class T>
std::string refusal(const Result<T>& parsed) {
  return parsed ? std::string() : parsed.error().text;
}

}  // namespace

CLI::Validator address() {
  return CLI::Validator([](std::string& given) { return refusal(parse_endpoint(given, {"127.0.0.1", 1})); }, "", "address");
}

CLI::Validator colour_map() {
  return CLI::Validator([](std::string& given) { return refusal(find_colour_map(given)); }, "", "colour map");
}

void add_frame_option(CLI::App& command, control::Frame& frame, const std::string& help) {
  const auto take = [&frame](const std::string& given) {
    frame = given == "ned" ? control::Frame::ned_frd : control::Frame::enu_flu;
  };
  command.add_option_function<std::string>("--frame", take, help)
      ->check(text::one_of({"enu", "ned"}))
      ->transform(text::in_small_letters());
}

}  // namespace sonar::clients
