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
  const auto set_frame = [&frame](const std::string& given) {
    frame = given == "ned" ? control::Frame::ned_frd : control::Frame::enu_flu;
  };
  command.add_option_function<std::string>("--frame", set_frame, help)
      ->check(text::one_of({"enu", "ned"}))
      ->transform(text::in_small_letters());
}

void add_control_options(CLI::App& command, std::string& control, std::filesystem::path& token_file) {
  command.add_option("--control", control, "HOST:PORT of sonard's control stream (default 127.0.0.1:14770)")->check(address());
  command.add_option("--token-file", token_file, "the daemon's control.token_file, if it has one");
}

void DeviceArguments::add_to(CLI::App& command, const std::string& port_help) {
  command.add_option("ADDRESS", address, "address of the sonar, HOST or HOST:PORT (default 127.0.0.2)")
      ->check(clients::address());
  command.add_option("--port", port, port_help)->check(text::whole_number(1, 65535));
  command.add_flag("--discover", discover, "use the address in the status broadcast on udp 52102");
  command
      .add_option("--wait", patience_s,
                  "time for which the connection is retried [s]; if above 10, also the time to wait for pings")
      ->check(text::number(0))
      ->capture_default_str();
}

}  // namespace sonar::clients
