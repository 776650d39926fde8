#include "clients/sonarctl/control/control_commands.hpp"

#include <cstdio>
#include <thread>

#include "clients/sonarctl/commands.hpp"
#include "clients/sonarctl/control/status_text.hpp"
#include "clients/sonarctl/terminal.hpp"
#include "core/text/format.hpp"
#include "protocol/control/answers.hpp"

namespace sonar::clients {
namespace {

constexpr std::chrono::minutes scene_patience{6};  // the daemon's limit is five minutes
constexpr std::chrono::hours step_patience{24};    // until the pings are computed; Ctrl-C ends the wait

std::vector<std::string> lines_of(const std::string& text, int most) {
  std::vector<std::string> lines;
  for (std::size_t begin = 0; begin < text.size() && static_cast<int>(lines.size()) < most;) {
    const std::size_t end = text.find('\n', begin);
    lines.push_back(text.substr(begin, end - begin));
    begin = end == std::string::npos ? text.size() : end + 1;
  }
  return lines;
}

/// Sleeps in short pieces, so that Ctrl-C ends the wait.
void wait_s(double seconds) {
  const auto until = std::chrono::steady_clock::now() + std::chrono::milliseconds(static_cast<std::int64_t>(1000 * seconds));
  while (interrupted == 0 && std::chrono::steady_clock::now() < until) std::this_thread::sleep_for(std::chrono::milliseconds(20));
}

Result<void> watch(ControlClient& client, const StatusOptions& options) {
  const LiveScreen screen(!options.json && terminal_facts().is_terminal);
  while (interrupted == 0) {
    const auto status = client.status();
    if (!status && interrupted != 0) break;
    if (!status) return tl::unexpected(status.error());
    const bool read = options.json ? std::puts(control::json_of(**status).c_str()) >= 0 && std::fflush(stdout) == 0
                                   : screen.show(lines_of(text_from(**status), terminal_size().lines - 1));
    if (!read) break;  // output closed
    wait_s(options.period_s);
  }
  return {};
}

}  // namespace

Result<void> print_status(const StatusOptions& options) {
  auto client = ControlClient::open(options.control);
  if (!client) return tl::unexpected(client.error());
  if (options.watch) return watch(*client, options);
  const auto status = client->status();
  if (!status) return tl::unexpected(status.error());
  std::fputs(options.json ? (control::json_of(**status) + "\n").c_str() : text_from(**status).c_str(), stdout);
  return {};
}

Result<void> print_events(const EventsOptions& options) {
  auto client = ControlClient::open(options.control);
  if (!client) return tl::unexpected(client.error());
  if (const auto subscribed = client->request(options.wanted); !subscribed) return tl::unexpected(subscribed.error());
  const auto start = std::chrono::steady_clock::now();
  const auto over = [&] {
    const double elapsed_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    return interrupted != 0 || (options.seconds > 0 && elapsed_s >= options.seconds);
  };
  for (std::uint64_t printed = 0; !over() && (options.count == 0 || printed < options.count);) {
    const auto event = client->next_event(std::chrono::milliseconds(100));
    if (!event) return tl::unexpected(event.error());
    if (!*event) continue;
    ++printed;
    std::puts(options.json ? control::json_of(**event).c_str() : text_from(**event).c_str());
    if (std::fflush(stdout) != 0) break;  // output closed
  }
  return {};
}

Result<void> steer(const ControlOptions& control, ControlClient::Operation operation, const std::string& done) {
  auto client = ControlClient::open(control);
  if (!client) return tl::unexpected(client.error());
  if (const auto answer = client->request(std::move(operation), scene_patience); !answer) return tl::unexpected(answer.error());
  std::puts(done.c_str());
  return {};
}

Result<void> step_time(const StepOptions& options) {
  auto client = ControlClient::open(options.control);
  if (!client) return tl::unexpected(client.error());
  for (std::uint64_t n = 0; n < options.count && interrupted == 0; ++n) {
    const auto answer = client->request(control::Step{options.dt_s}, step_patience);
    if (!answer) return tl::unexpected(answer.error());
    if (!(*answer)->has_stepped()) return failure(ErrorKind::bad_data, "sonard answered a step without the time");
    const v1::Stepped& stepped = (*answer)->stepped();
    if (options.json)
      std::puts(control::json_of(stepped).c_str());
    else
      std::printf("%.9f s  %s\n", 1e-9 * static_cast<double>(stepped.now_ns()), text::counted(stepped.pings(), "ping").c_str());
    if (std::fflush(stdout) != 0) break;  // output closed
  }
  return {};
}

std::string scene_path_for(const Endpoint& daemon, const std::string& path) {
  std::error_code none;
  const bool same_computer = daemon.host.starts_with("127.") || daemon.host == "localhost";
  if (!same_computer || !std::filesystem::is_regular_file(path, none)) return path;
  const std::filesystem::path full = std::filesystem::absolute(path, none);
  return none ? path : full.lexically_normal().string();
}

Result<void> load_scene(const ControlOptions& control, const std::string& path) {
  const Result<Endpoint> at = parse_endpoint(control.address, {"127.0.0.1", control_port});
  if (!at) return tl::unexpected(at.error());
  const std::string sent = scene_path_for(*at, path);
  return steer(control, control::LoadScene{sent}, "scene " + sent + " is loaded");
}

Result<void> list_objects(const ControlOptions& control) {
  auto client = ControlClient::open(control);
  if (!client) return tl::unexpected(client.error());
  const auto status = client->status();
  if (!status) return tl::unexpected(status.error());
  for (const v1::ObjectStatus& object : (*status)->objects()) std::puts(text_from(object).c_str());
  return {};
}

}  // namespace sonar::clients
