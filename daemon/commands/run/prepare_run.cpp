#include "daemon/commands/run/prepare_run.hpp"

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <thread>
#include <utility>

#include "core/text/format.hpp"
#include "cuda/cuda_status.hpp"
#include "daemon/emulator/world/world_parts.hpp"
#include "daemon/server/connections/token.hpp"
#include "daemon/server/engine/choose_engine.hpp"
#include "daemon/server/faults/fault_log.hpp"
#include "daemon/server/http/page.hpp"
#include "daemon/server/system/log.hpp"
#include "daemon/server/system/real_time.hpp"
#include "protocol/host.hpp"

namespace sonar {
namespace {

int compute_threads(const EngineConfig& engine) {
  if (engine.threads > 0) return engine.threads;
  return std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
}

Result<FoundConfig> read_config(const RunCommand& command, bool& json) {
  // `json` is the format of errors: the format of the command line while the file is read, then that of the configuration.
  json = command.log_format == "json";
  auto found = find_config(command.config, command.demo);
  if (!found) return found;
  json = false;  // errors in the command line are plain text
  if (const auto r = override_config(found->config, command); !r) return tl::make_unexpected(r.error());
  json = found->config.log.json;
  return found;
}

/// Opens the files of the server, to find errors before the scene is loaded. The server opens them again.
Result<void> check_files(const Config& config, std::string& token_warning) {
  if (!config.control.token_file.empty())
    if (const auto token = Token::read(config.control.token_file, token_warning); !token)
      return tl::make_unexpected(token.error());
  if (!config.faults.journal.empty()) return JournalFile::check(config.faults.journal);
  return {};
}

/// Makes engines, each with its own log, because they log from their own threads.
EngineFactory engine_factory(const Config& config, Parallel& pool) {
  return [&pool, engine = config.engine, log_options = config.log](ScenePointer scene) {
    const auto own_log = std::make_shared<Log>(log_options);
    return choose_engine(engine.device, std::move(scene), pool, {engine.simd},
                         [own_log](const std::string& what) { own_log->warning(what); });
  };
}

}  // namespace

Result<PreparedRun> prepare_run(const RunCommand& command, bool& json,
                                const std::function<LoadProgress::Say(const Config&)>& say_with) {
  auto found = read_config(command, json);
  if (!found) return tl::make_unexpected(found.error());
  PreparedRun run;
  run.found = *std::move(found);
  const Config& config = run.found.config;
  if (const auto r = check_files(config, run.token_warning); !r) return tl::make_unexpected(r.error());
  // The checks above are fast. Loading the scene may take minutes, so progress is logged from here.
  const LoadProgress loading(say_with(config));
  const auto scene = load_scene(config.scene, config.origin);
  if (!scene) return tl::make_unexpected(scene.error());
  if (std::string why = why_not_movable(**scene, config); !why.empty()) return failure(ErrorKind::config, std::move(why));
  run.scene = *scene;
  run.pool = std::make_unique<Parallel>(compute_threads(config.engine), compute_niceness);
  run.make_engine = engine_factory(config, *run.pool);
  Result<std::unique_ptr<PingEngine>> engine;
  // The engine is started here, so that sonard ends before it opens a port if the device cannot compute.
  compute_apart([&] { engine = start_engine(run.make_engine, run.scene); });
  if (!engine) return tl::make_unexpected(engine.error());
  run.engine = *std::move(engine);
  return run;
}

namespace {

using text::format;

std::string address_text(const Endpoint& e) { return text_of(e); }

/// Returns the folder of the drop-in SDK library, installed with this program or built beside it; empty if there is none.
std::filesystem::path sdk_library_folder() {
  std::error_code ec;
  const auto program = std::filesystem::read_symlink("/proc/self/exe", ec);
  // The first folder is that of an installed program, the second that of a build.
  for (const char* folder : {"../lib/sonard", ".."}) {
    const auto place = (program.parent_path() / folder / "bvt4/lib").lexically_normal();
    if (!ec && std::filesystem::exists(place / "libbvtsdk.so", ec)) return place;
  }
  return {};
}

/// Returns lines that explain how a program connects to a sonar that needs our library.
std::string library_lines(const protocol::Make& make, std::string at, unsigned port) {
  const std::string folder = sdk_library_folder().string();
  if (port != make.ports.front().number) at += format(":%u", port);
  std::string call(make.driver_call);
  if (const std::size_t place = call.find("{at}"); place != std::string::npos) call.replace(place, 4, at);
  return "  driver  " + call + ": " +
         (folder.empty() ? "package sonard-bvtsdk" : "LD_LIBRARY_PATH=" + folder + " (SDK 3.x: bvt3)") +
         ", docs/bvtsdk.md\n  look    sonarctl view " + at + " --png ping.png\n";
}

std::string sonar_lines(const Device& device) {
  const PingSettings s = device.sonar().initial_settings();
  const SonarModel& model = *device.sonar().state().model;
  const FrequencyMode& mode = model.modes[static_cast<std::size_t>(s.mode)];
  std::string text = "sonar     " + device.config().name + "  " + model.name + "  " +
                     text::frequency_text(static_cast<double>(mode.centre_hz)) +
                     format("  %s  %.4g m", text::counted(s.beam_count, "beam").c_str(), s.range_m) +
                     (s.rate_hz > 0 && !s.triggered ? format("  %g Hz\n", static_cast<double>(s.rate_hz)) : "\n");
  for (const protocol::DriverAddress& address : device.addresses())
    text += "  " + protocol::line_of(address.protocol, text_of(address.at), address.carries, address.sonar_speaks_first) + "\n";
  if (device.sonar().state().advertise_ip != device.config().bind_ip)
    text += "  advertised as " + text_of(device.sonar().state().advertise_ip) + "\n";
  if (const protocol::Make& make = protocol::make_of_profile(model.profile); !make.driver_call.empty())
    text += library_lines(make, text_of(device.sonar().state().advertise_ip), device.data_endpoint().port);
  return text;
}

std::string pose_line(const App& app) {
  const Endpoint protobuf = app.poses().protobuf(), json = app.poses().json();
  std::string text = "pose      ";
  text += protobuf.port != 0 ? "udp " + address_text(protobuf) + " (protobuf)" : "protobuf off";
  text += json.port != 0 ? "  udp and tcp " + address_text(json) + " (json)" : "  json off";
  for (const std::string& endpoint : app.mavlink().endpoints()) text += "  " + endpoint + " (mavlink)";
  text += "  | source: " + std::string(app.world().source_of(0)) + "\n";
  return text;
}

std::string control_line(const App& app) {
  const Endpoint stream = app.control().stream(), http = app.control().http();
  std::string text = "control   ";
  text += stream.port != 0 ? "tcp " + address_text(stream) : "tcp off";
  text += http.port != 0 ? "   http http://" + address_text(http) : "   http off";
  return text + (app.config().control.token_file.empty() ? "\n" : "   token needed\n");
}

/// Returns the line with the address of the page; empty in builds without the page.
std::string page_line(const App& app) {
  const Endpoint http = app.control().http();
  if (http.port == 0 || app.config().limits.viewers == 0 || page_files().empty()) return {};
  // A browser cannot open 0.0.0.0, so the page is shown at the loopback address.
  const std::string host = http.ip == Ipv4{} ? "127.0.0.1:" + std::to_string(http.port) : address_text(http);
  return "open      http://" + host + "   the live view, in a browser\n";
}

/// Returns the line with the address for viewers whose page comes from another server. The key is valid until sonard stops.
std::string view_line(const App& app) {
  const Endpoint http = app.control().http();
  const std::string& key = app.view().secrets().key();
  if (http.port == 0 || app.config().limits.viewers == 0) return {};
  return "view      ws://" + address_text(http) + "/" + (key.empty() ? "?token=TOKEN" : "?key=" + key) +
         "   Foxglove, Lichtblick: docs/live-view.md\n";
}

/// Returns the largest resident memory so far [MB]; 0 if the system does not report it.
double peak_memory_mb() {
  std::ifstream status("/proc/self/status");
  std::string word;
  while (status >> word) {
    double kb = 0;
    if (word == "VmHWM:" && status >> kb) return kb / 1024;
  }
  return 0;
}

}  // namespace

std::string banner(const App& app, const BannerFacts& facts) {
  const std::string cuda = app.config().engine.device == EngineDevice::cpu ? cuda_presence() : cuda_status();
  std::string text = "sonard " SONARD_VERSION "  (" + app.engine_description() + ", CUDA: " + cuda + ")\n";
  text += page_line(app);
  text += "config    " + facts.config_line + "\n";
  text += "scene     " + app.scene().name +
          format("   %zu triangles, %zu materials, %zu moving, built in %.0f ms\n", app.scene().triangle_count(),
                 app.scene().materials.size(), app.scene().body_names.size(), facts.scene_ms);
  for (const Device& d : app.devices()) text += sonar_lines(d);
  text += pose_line(app);
  text += control_line(app);
  text += view_line(app);
  text += "seed      " + std::to_string(app.config().seed) + "   reproducible";
  if (const ClockMode clock = app.config().clock; clock != ClockMode::realtime)
    text += ", " + std::string(name_of(clock)) + " clock";
  return text + "\n";
}

std::string ready_line(const App& app, double seconds) {
  std::string to;
  for (const SonarConfig& sonar : app.config().sonars)
    to +=
        (to.empty() ? "" : ", ") + text_of(sonar.advertise_ip) + (app.config().sonars.size() > 1 ? " (" + sonar.name + ")" : "");
  return format("ready in %.2f s. Connect your driver to %s.   Ctrl-C stops.\n", seconds, to.c_str());
}

std::string summary(const App& app) {
  std::string text;
  for (const Device& d : app.devices()) {
    const DeviceFigures f = d.figures();
    text += "sonar " + d.config().name +
            format("  %llu pings, %llu served, %llu dropped, %llu skipped of %llu ticks, %llu clients",
                   static_cast<unsigned long long>(f.pings), static_cast<unsigned long long>(f.served),
                   static_cast<unsigned long long>(f.dropped), static_cast<unsigned long long>(f.skipped_ticks),
                   static_cast<unsigned long long>(f.ticks), static_cast<unsigned long long>(f.clients));
    if (f.pings > 0) text += format(", %.1f ms per ping", 1e3 * f.simulation_s / static_cast<double>(f.pings));
    text += "\n";
  }
  const PoseCounters& p = app.world().counters();
  if (p.accepted + p.refused + p.late > 0)
    text += format("poses  %llu accepted, %llu refused, %llu late, %llu replaced, %llu over the rate\n",
                   static_cast<unsigned long long>(p.accepted), static_cast<unsigned long long>(p.refused),
                   static_cast<unsigned long long>(p.late), static_cast<unsigned long long>(p.replaced),
                   static_cast<unsigned long long>(p.over_rate));
  return text + format("resident memory %.0f MB at most\n", peak_memory_mb());
}

std::string digest_lines(const App& app) {
  std::string text;
  for (const Device& d : app.devices())
    for (const StreamDigest& s : d.digests())
      text += "sha256 " + s.sha256 +
              format("  %s client %llu  %llu bytes\n", d.config().name.c_str(), static_cast<unsigned long long>(s.client),
                     static_cast<unsigned long long>(s.bytes));
  return text;
}

}  // namespace sonar
