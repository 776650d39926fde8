// Measures the latency of a whole daemon and the cost of its clients. The daemon runs in a thread of this process as `sonard run`
// would; the clients use the protocols of Oculus and BlueView over loopback.
#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <cstdio>
#include <list>
#include <numeric>
#include <string>
#include <thread>
#include <utility>

#include "clients/sonarctl/ping_stream.hpp"
#include "daemon/config/load_config.hpp"
#include "protocol/blueview/link.hpp"
#include "protocol/oculus/decode.hpp"
#include "tests/bench/findings.hpp"
#include "tests/bench/service.hpp"

namespace sonar::bench {
namespace {

using nlohmann::json;

constexpr std::uint16_t data_port = 52100;
constexpr int patience_s = 20;

/// Returns `count` sonars of a product on one vehicle, as a configuration lists them.
std::string sonars_of(const std::string& profile, int count) {
  std::string list;
  for (int i = 0; i < count; ++i)
    list += "  - {name: sonar" + std::to_string(i) + ", profile: " + profile +
            ", clients: {max: 16}, bind_ip: " + own_address(i) + ", status_to: ['" + own_address(i) +
            ":9'], mount: {frame: FLU, xyz_m: [0, " + std::to_string(i) + ", 0]}}\n";
  return list;
}

oculus::FireRequest fire_p3a(bool triggered) {
  oculus::FireRequest fire;
  fire.settings.mode = 2;
  fire.settings.ping_rate = oculus::PingRate::hz40;
  fire.settings.flags = oculus::flag::range_in_metres | oculus::flag::simple_result | oculus::flag::beams_512;
  if (triggered) fire.settings.flags |= oculus::flag::network_trigger;
  fire.settings.range = 10;
  fire.settings.gain_percent = 50;
  return fire;
}

Result<std::unique_ptr<Service>> start(const ScenePointer& scene, const BenchOptions& options,
                                       const std::string& sonars = sonars_of("oculus-m1200d", 1)) {
  const std::string address = own_address();
  auto config = parse_config(
      "world: {scene: local-search.yaml}\n"
      "vehicles:\n  - {name: rov, initial_pose: {frame: ENU_FLU, xyz_m: [0, 0, -8], rpy_deg: [0, 14.3, 0]}}\n"
      "sonars:\n" +
          sonars + "poses: {protobuf: '" + address + ":0', json: '" + address + ":0'}\ncontrol: {stream: off, http: off}\n",
      "bench", options.scene_folder);
  if (!config) return tl::make_unexpected(config.error());
  config->engine = options.engine;
  return Service::start(*std::move(config), scene, options);
}
tcp::endpoint data_of() { return {asio::ip::make_address(own_address()), data_port}; }
udp::endpoint poses_of(Service& service) { return {asio::ip::make_address(own_address()), service.app().poses().json().port}; }

/// Compares the settings of the grid only, because the echo has the gain that the device chose.
bool answers(const oculus::FireRequest& fire, const oculus::DecodedPing& ping) {
  const oculus::FireSettings& echo = ping.head.fixed.fire;
  return echo.mode == fire.settings.mode && echo.range == fire.settings.range && echo.flags == fire.settings.flags &&
         echo.gamma == fire.settings.gamma;
}

class Client {
 public:
  Client(asio::io_context& io, const tcp::endpoint& to) : socket_(io) {
    socket_.connect(to);
    socket_.set_option(tcp::no_delay(true));
    const timeval limit{patience_s, 0};
    ::setsockopt(socket_.native_handle(), SOL_SOCKET, SO_RCVTIMEO, &limit, sizeof limit);
  }
  void fire(const oculus::FireRequest& fire) { asio::write(socket_, asio::buffer(oculus::make_fire(fire))); }
  /// Returns when the last byte of the next ping, or of the next that echoes `fire`, was received; 0 = end or time limit.
  double next_ping(const oculus::FireRequest* fire = nullptr) {
    for (;;) {
      while (auto message = decoder_.next())
        if (const auto* ping = std::get_if<oculus::DecodedPing>(&*message)) {
          if (fire != nullptr && !answers(*fire, *ping)) {
            ++skipped;
            continue;
          }
          rows = static_cast<int>(ping->rows());
          return read_at_s_;
        }
      error_code ec;
      const std::size_t n = socket_.read_some(asio::buffer(buffer_), ec);
      if (ec) return 0;
      read_at_s_ = now_s();
      decoder_.append(std::span(buffer_).first(n));
    }
  }
  void close() {
    error_code ec;
    socket_.shutdown(tcp::socket::shutdown_both, ec);
  }
  int rows = 0;
  int skipped = 0;  // number of pings with other settings

 private:
  tcp::socket socket_;
  std::vector<std::byte> buffer_ = std::vector<std::byte>(1 << 18);
  oculus::Decoder decoder_;
  double read_at_s_ = 0;
};

Error broken(const char* what) { return {ErrorKind::unavailable, std::string("the bench's daemon ") + what}; }

}  // namespace

Result<json> find_latency(const ScenePointer& scene, const BenchOptions& options) {
  auto service = start(scene, options);
  if (!service) return tl::make_unexpected(service.error());
  asio::io_context io;
  Client client(io, data_of());
  udp::socket poses(io, udp::v4());
  std::vector<double> latency_ms;
  const int triggers = std::max(200, 2 * options.pings), warm_up = 10;
  for (int k = 0; k < triggers + warm_up; ++k) {
    const double t = k / 40.0;  // NED: the vehicle moves north at 8 m depth
    char pose[160];
    const int length = std::snprintf(pose, sizeof pose, "{\"position\":[%.4f,%.4f,8],\"attitude\":[0,-0.25,%.4f]}\n",
                                     0.35 * std::sin(t), 0.9 * t, pi / 2 + 0.3 * std::sin(t));
    const double begin = now_s();
    poses.send_to(asio::buffer(pose, static_cast<std::size_t>(length)), poses_of(**service));
    client.fire(fire_p3a(true));
    const double end = client.next_ping();
    if (end == 0) return tl::make_unexpected(broken("sent no ping within 20 s"));
    if (k >= warm_up) latency_ms.push_back(1e3 * (end - begin));
    std::this_thread::sleep_for(std::chrono::milliseconds(25));  // the period of the highest ping rate
  }
  client.close();
  const Times times(latency_ms);
  std::printf("P5   pose and trigger to last byte, %d rows, %d threads: median %.2f ms, p99 %.2f, worst %.2f of %d\n",
              client.rows, options.threads.back(), times.median, times.p99, times.max, triggers);
  std::fflush(stdout);
  return json{
      {"case", "P3a"}, {"rows", client.rows}, {"threads", options.threads.back()}, {"triggers", triggers}, {"latency", times}};
}

namespace {

/// One of `settings_in_grid` combinations of settings that a driver may request; neighbours differ in most settings.
constexpr int settings_in_grid = 144;
struct GridSetting {
  oculus::FireRequest fire;
  double period_ms;  // the period that rate and range allow
  std::string text;
};
GridSetting grid_setting(int k) {
  int i = k * 55 % settings_in_grid;
  const auto one_of = [&i](auto... values) {
    const std::array all{values...};
    const auto at = static_cast<std::size_t>(i) % all.size();
    i /= static_cast<int>(all.size());
    return all[at];
  };
  oculus::FireRequest fire = fire_p3a(false);
  oculus::FireSettings& s = fire.settings;
  const bool high = one_of(true, false);
  s.mode = high ? 2 : 1;
  s.range = one_of(0.5, 1.5, 2.0, 3.0, 5.0, 10.0) * (high ? 1 : 3);
  const auto [rate, rate_hz] = one_of(std::pair{oculus::PingRate::hz40, 40.0}, std::pair{oculus::PingRate::hz15, 15.0},
                                      std::pair{oculus::PingRate::hz10, 10.0});
  s.ping_rate = rate;
  const int beams = one_of(512, 256);
  if (beams == 256) s.flags = static_cast<std::uint8_t>(s.flags & ~oculus::flag::beams_512);
  if (one_of(true, false)) s.flags |= oculus::flag::gain_assist;
  s.salinity_ppt = k % 3 == 0 ? 35 : 0;
  s.gain_percent = 20 + k % 5 * 15;
  s.gamma = static_cast<std::uint8_t>(k % 2 == 0 ? 127 : 255);
  char text[80];
  std::snprintf(text, sizeof text, "mode %d, %g m, %d beams, %g Hz", s.mode, s.range, beams, rate_hz);
  return {fire, 1e3 * std::max(1 / rate_hz, 2 * s.range / 1500 + 0.002), text};
}

}  // namespace

Result<json> find_first_pings(const ScenePointer& scene, const BenchOptions& options, bool& holds) {
  auto service = start(scene, options);
  if (!service) return tl::make_unexpected(service.error());
  asio::io_context io;
  Client client(io, data_of());
  constexpr double allowed_median = 3, allowed_slowest = 5;  // they were 3.9 and 3 before tables of shared noise were cheap
  constexpr int warm_pings = 3;
  std::vector<double> first_ms, late_ms, first_cpu_ms, warm_cpu_ms;
  double warm_ms = 0;
  std::string slowest;
  // The last setting is requested once at the start, because the first ping of a daemon takes longer with any setting.
  for (int k = -1; k < settings_in_grid; ++k) {
    const GridSetting setting = grid_setting(k < 0 ? settings_in_grid - 1 : k);
    const double begin_s = now_s(), used_s = processor_s();
    client.skipped = 0;
    client.fire(setting.fire);
    const double first_s = client.next_ping(&setting.fire), first_used_s = processor_s();
    bool is_sent = first_s != 0;
    for (int i = 0; i < warm_pings && is_sent; ++i) is_sent = client.next_ping() != 0;
    if (!is_sent) return tl::make_unexpected(broken("sent no ping within 20 s"));
    const double before_ms = std::exchange(warm_ms, 1e3 * (processor_s() - first_used_s) / warm_pings);
    if (k < 0) continue;
    warm_cpu_ms.push_back(warm_ms);
    // Pings with the former settings, which are computed before the change, do not belong to the first ping.
    first_cpu_ms.push_back(1e3 * (first_used_s - used_s) - client.skipped * before_ms);
    first_ms.push_back(1e3 * (first_s - begin_s));
    late_ms.push_back(first_ms.back() - 2 * setting.period_ms);
    if (late_ms.back() == *std::max_element(late_ms.begin(), late_ms.end())) slowest = setting.text;
  }
  client.close();
  const Times first(first_ms), late(late_ms), first_cpu(first_cpu_ms), warm_cpu(warm_cpu_ms);
  const auto beyond = std::count_if(late_ms.begin(), late_ms.end(), [](double ms) { return ms > 50; });
  const double median = first_cpu.median / warm_cpu.median, most = first_cpu.max / warm_cpu.max;
  holds = median <= allowed_median && most <= allowed_slowest;
  std::printf(
      "P14  first ping after a change, %d settings, %d threads: median %.1f ms, slowest %.1f ms; beyond two periods at most "
      "%.1f ms (%s), by more than 50 ms %d\n     processor ms: median %.1f, %.1f times a warm ping's (at most %g); slowest %.1f, "
      "%.1f times the "
      "costliest "
      "warm ping's (at most %g)%s\n",
      settings_in_grid, options.threads.back(), first.median, first.max, late.max, slowest.c_str(), static_cast<int>(beyond),
      first_cpu.median, median, allowed_median, first_cpu.max, most, allowed_slowest, holds ? "" : ": MISSED");
  std::fflush(stdout);
  return json{{"settings", settings_in_grid},
              {"threads", options.threads.back()},
              {"first", first},
              {"beyond_two_periods_ms", late.max},
              {"slowest", slowest},
              {"beyond_by_more_than_50_ms", beyond},
              {"first_cpu", first_cpu},
              {"warm_cpu", warm_cpu},
              {"median_ratio", median},
              {"slowest_ratio", most},
              {"holds", holds}};
}

Result<json> find_cost_of_clients(const ScenePointer& scene, int clients, double seconds, const BenchOptions& options) {
  auto service = start(scene, options);
  if (!service) return tl::make_unexpected(service.error());
  asio::io_context io;
  std::list<Client> all;
  for (int i = 0; i < clients; ++i) all.emplace_back(io, data_of());
  all.front().fire(fire_p3a(false));
  std::atomic<std::uint64_t> received{0};
  std::vector<std::thread> readers;
  for (Client& client : all)
    readers.emplace_back([&client, &received] {
      while (client.next_ping() != 0) ++received;
    });
  const auto wait_s = [](double s) { std::this_thread::sleep_for(std::chrono::duration<double>(s)); };
  wait_s(1);
  const double begin = now_s(), used = (*service)->sender_s();
  const std::uint64_t before = received;
  wait_s(seconds);
  const double took_s = now_s() - begin, share = ((*service)->sender_s() - used) / took_s;
  const double rate_hz = static_cast<double>(received - before) / took_s / clients;
  (*service)->stop();
  for (std::thread& reader : readers) reader.join();
  const DeviceFigures f = (*service)->figures();
  const std::uint64_t slow = f.dropped_by[static_cast<std::size_t>(DropReason::slow)];
  std::printf("P8   %d clients: %.1f pings/s each, %llu dropped, %llu ticks skipped; the sender uses %.1f %% of a processor\n",
              clients, rate_hz, static_cast<unsigned long long>(slow), static_cast<unsigned long long>(f.skipped_ticks),
              100 * share);
  std::fflush(stdout);
  return json{{"clients", clients},    {"pings_per_second", rate_hz},
              {"dropped", slow},       {"skipped_ticks", f.skipped_ticks},
              {"sender_share", share}, {"seconds", took_s}};
}

Result<json> find_rates_of_sonars(const ScenePointer& scene, int sonars, double seconds, const BenchOptions& options) {
  constexpr std::chrono::seconds patience(patience_s);
  auto service = start(scene, options, sonars_of("blueview-p900-90", sonars));
  if (!service) return tl::make_unexpected(service.error());
  std::vector<clients::PingStream> streams;
  for (int i = 0; i < sonars; ++i) {
    clients::Wanted fast;
    fast.settings.rate_hz = 15;  // the product's highest
    auto stream = clients::PingStream::open({own_address(i), 0}, clients::find_make("blueview"), fast, patience);
    if (!stream) return tl::make_unexpected(stream.error());
    streams.push_back(*std::move(stream));
  }
  std::vector<std::atomic<std::uint64_t>> received(streams.size());
  std::atomic<bool> enough = false;
  std::vector<std::thread> readers;
  for (std::size_t i = 0; i < streams.size(); ++i)
    readers.emplace_back([&, i] {
      while (!enough && streams[i].next(patience).what == clients::Wait::data) ++received[i];
    });
  const auto counts = [&] { return std::vector<std::uint64_t>(received.begin(), received.end()); };
  const auto wait_s = [](double s) { std::this_thread::sleep_for(std::chrono::duration<double>(s)); };
  wait_s(1);
  const double begin = now_s();
  const std::vector<std::uint64_t> before = counts();
  do wait_s(seconds);
  while (counts() == before && now_s() < begin + patience_s);
  const double took_s = now_s() - begin;
  std::vector<double> rates;
  for (const std::uint64_t n : counts()) rates.push_back(static_cast<double>(n - before[rates.size()]) / took_s);
  enough = true;
  for (std::thread& reader : readers) reader.join();
  const auto [lowest, highest] = std::minmax_element(rates.begin(), rates.end());
  const double total = std::accumulate(rates.begin(), rates.end(), 0.0);
  if (total == 0) return tl::make_unexpected(broken("sent no pings"));
  std::printf("P13  %d sonars of P1, %d threads: %.1f pings/s together, the slowest %.1f, the fastest %.1f\n", sonars,
              options.threads.back(), total, *lowest, *highest);
  std::fflush(stdout);
  return json{
      {"sonars", sonars}, {"threads", options.threads.back()}, {"total", total}, {"lowest", *lowest}, {"highest", *highest}};
}

}  // namespace sonar::bench
