#include "tests/daemon/server/sonars/made_up_vendor.hpp"

#include <algorithm>
#include <array>
#include <cstdlib>
#include <iterator>
#include <optional>
#include <sstream>
#include <stdexcept>
#include <string>
#include <utility>

#include "core/text/ipv4.hpp"

namespace sonar::testing_daemon {
namespace {

using namespace std::chrono_literals;
using protocol::Bytes;
using protocol::BytesView;
using protocol::DeviceState;
using Kind = protocol::Port::Kind;

const std::array<protocol::Port, 8> port_table{
    {{.kind = Kind::tcp_stream, .number = command_port},
     {.kind = Kind::tcp_stream, .number = data_port},
     {.kind = Kind::udp_beacon, .number = beacon_port, .period = 10s, .on_change = true},
     {.kind = Kind::udp_answer, .number = udp_port},
     {.kind = Kind::udp_stream, .number = udp_port, .gap = 100us},
     {.kind = Kind::udp_stream, .group = {group_ip, group_port}},
     {.kind = Kind::http, .number = http_port},
     {.kind = Kind::udp_dialogue, .number = data_port}}};

Bytes bytes_of(const std::string& text) {
  const auto* const begin = reinterpret_cast<const std::byte*>(text.data());
  return {begin, begin + text.size()};
}
std::string text_of(BytesView bytes) { return {reinterpret_cast<const char*>(bytes.data()), bytes.size()}; }

struct RangeSetting final : VendorSettings {
  explicit RangeSetting(double m) : range_m(m) {}
  bool equals(const VendorSettings& other) const override { return range_m == static_cast<const RangeSetting&>(other).range_m; }
  double range_m;
};

double range_of(const DeviceState& device) {
  return device.settings ? static_cast<const RangeSetting&>(*device.settings).range_m : 5;
}

protocol::ChangeSettings settings_at(double range_m) {
  PingSettings settings;
  settings.range_m = range_m;
  settings.range_bin_count = 100;
  settings.range_bin_m = range_m / 100;
  settings.beam_count = 32;
  settings.rate_hz = 20;
  return {settings, std::make_shared<RangeSetting>(range_m), "range " + std::to_string(range_m) + " m"};
}

std::optional<protocol::Endpoint> endpoint_of(const std::string& text) {
  const std::size_t colon = text.find(':');
  const auto ip = text::parse_ipv4(text.substr(0, colon));
  if (!ip || colon == std::string::npos) return std::nullopt;
  return protocol::Endpoint{*ip, static_cast<std::uint16_t>(std::atoi(text.c_str() + colon + 1))};
}

/// Carries out a line; the reply is "ok" or a refusal.
protocol::Reaction run_command(const std::string& line, const DeviceState& device) {
  std::istringstream words(line);
  std::string command, reply = "ok";
  words >> command;
  protocol::Reaction reaction;
  if (command == "range") {
    double range_m = 0;
    if (words >> range_m && range_m > 0 && range_m <= 50)
      reaction.events.push_back(settings_at(range_m));
    else
      reply = "no: a range is above 0 and up to 50";
  } else if (command == "receivers") {
    protocol::SetReceivers wanted;
    for (std::string word; words >> word;)
      if (const auto to = endpoint_of(word)) wanted.to.push_back(*to);
    reaction.events.push_back(std::move(wanted));
  } else if (command == "quiet") {
    // no other behaviour
  } else if (command == "ping") {
    reaction.events.push_back(protocol::RequestPing{});
  } else if (command == "quit") {
    reaction.events.push_back(protocol::Close{"quit"});
  } else if (command == "who") {
    reply = device.name + " " + std::to_string(static_cast<int>(range_of(device)));
  } else {
    reply = "no: unknown command";
  }
  reaction.replies.push_back(bytes_of(reply + "\n"));
  return reaction;
}

class LineDialogue final : public protocol::Dialogue {
 public:
  LineDialogue(const DeviceState& device, bool sends_pings) : device_(device), sends_pings_(sends_pings) {}
  protocol::Reaction on_bytes(BytesView received, Time) override {
    protocol::Reaction all;
    for (const char c : text_of(received)) {
      if (c != '\n') {
        if (line_.size() < 200) line_ += c;
        continue;
      }
      protocol::Reaction one = run_command(limit_silence(std::exchange(line_, {})), device_);
      std::move(one.events.begin(), one.events.end(), std::back_inserter(all.events));
      std::move(one.replies.begin(), one.replies.end(), std::back_inserter(all.replies));
    }
    return all;
  }
  protocol::Reaction on_tick(Time, bool) override { return {}; }
  Time next_tick() const override { return Time::max(); }
  void on_ping_queued(Time) override {}
  std::optional<std::chrono::milliseconds> longest_silence() const override { return longest_silence_; }
  bool hosts_fall_silent() const override { return falls_silent_; }
  protocol::Delivery on_ping(const VendorSettings*, std::size_t, Time) override {
    if (!sends_pings_) return {};
    return {{Bytes{}}, {}};
  }

 private:
  std::string limit_silence(const std::string& line) {
    std::istringstream words(line);
    std::string command;
    int seconds = 0;
    if (!(words >> command >> seconds) || (command != "silence" && command != "listens")) return line;
    longest_silence_ = std::chrono::seconds(seconds);
    falls_silent_ = command == "listens";
    return "quiet";
  }

  const DeviceState& device_;
  bool sends_pings_, falls_silent_ = false;
  std::optional<std::chrono::milliseconds> longest_silence_;
  std::string line_;
};

class MadeUpVendor final : public protocol::Vendor {
 public:
  MadeUpVendor() {
    auto model = std::make_shared<SonarModel>(*protocol::vendors().front()->models().front());
    model->profile = "made-up";
    model->name = "Made-up sonar";
    models_ = {std::move(model)};
  }
  std::string_view name() const override { return "made-up"; }
  std::span<const std::shared_ptr<const SonarModel>> models() const override { return models_; }
  std::span<const protocol::Port> ports() const override { return port_table; }
  int default_max_clients() const override { return 2; }
  protocol::PingsBy pings_by() const override { return protocol::PingsBy::either; }
  protocol::ChangeSettings initial_settings(const DeviceState&) const override { return settings_at(5); }
  Result<protocol::ChangeSettings> apply_override(const protocol::SettingsOverride& wanted,
                                                  const DeviceState& device) const override {
    return settings_at(wanted.range_m.value_or(range_of(device)));
  }
  double gain_percent(const DeviceState&) const override { return 50; }
  bool pings_before_first_request(const DeviceState&) const override { return true; }
  Bytes beacon(const DeviceState& device, Time) const override {
    return bytes_of(device.name + (device.connected_client == protocol::Ipv4{} ? " free" : " busy"));
  }
  protocol::Reaction on_datagram(const protocol::Port&, BytesView datagram, const DeviceState& device, Time) const override {
    if (text_of(datagram) == "fault") throw std::runtime_error("a mistake in the vendor's code");
    return run_command(text_of(datagram), device);
  }
  protocol::ResourceReply on_http(const protocol::Port&, const protocol::ResourceRequest& request, const DeviceState& device,
                                  Time) const override {
    if (request.path != "/range" && request.path != "/receivers") return {404, "not found\n", "text/plain"};
    if (request.method == "GET" && request.path == "/range")
      return {200, std::to_string(static_cast<int>(range_of(device))), "application/json"};
    if (request.method != "PUT") return {405, "", "", request.path == "/range" ? "GET, HEAD, PUT" : "PUT"};
    protocol::Reaction reaction = run_command(request.path.substr(1) + " " + request.body, device);
    if (reaction.events.empty()) return {400, text_of(reaction.replies.front()), "text/plain"};
    return {204, "", "", "", std::move(reaction.events)};
  }
  bool is_request(const protocol::Port&, BytesView datagram) const override {
    return !datagram.empty() && datagram.back() == std::byte{'\n'};
  }
  std::unique_ptr<protocol::Dialogue> converse(const protocol::Port& port, const DeviceState& device, Time) const override {
    return std::make_unique<LineDialogue>(device, port.number == data_port);
  }
  std::shared_ptr<const Bytes> frame(const Ping& ping, const DeviceState&) const override {
    Bytes bytes = bytes_of("PING " + std::to_string(static_cast<std::uint32_t>(ping.request.number)) + " " +
                           std::to_string(ping.samples.size()) + "\n");
    bytes.insert(bytes.end(), ping.samples.begin(), ping.samples.end());
    return std::make_shared<const Bytes>(std::move(bytes));
  }
  std::vector<Bytes> datagrams(const protocol::Port& port, const Ping& ping, const DeviceState& device) const override {
    if (port.kind == Kind::tcp_stream)  // each of the two ports sends its own part of a ping
      return port.number == data_port ? std::vector<Bytes>{*frame(ping, device)} : std::vector<Bytes>{};
    const std::string number = std::to_string(static_cast<std::uint32_t>(ping.request.number));
    if (port.group.port != 0) return {bytes_of(number)};
    std::vector<Bytes> all;
    const std::size_t parts = (ping.samples.size() + part_bytes - 1) / part_bytes;
    for (std::size_t part = 0; part < parts; ++part) {
      Bytes bytes = bytes_of("PING " + number + " " + std::to_string(part) + " " + std::to_string(parts) + "\n");
      const std::size_t begin = part * part_bytes, end = std::min(begin + part_bytes, ping.samples.size());
      bytes.insert(bytes.end(), ping.samples.begin() + static_cast<std::ptrdiff_t>(begin),
                   ping.samples.begin() + static_cast<std::ptrdiff_t>(end));
      all.push_back(std::move(bytes));
    }
    return all;
  }

  std::optional<std::pair<std::size_t, std::size_t>> region(protocol::Region region, BytesView ping) const override {
    if (region != protocol::Region::header && region != protocol::Region::image) return {};
    const auto line = static_cast<std::size_t>(std::find(ping.begin(), ping.end(), std::byte{'\n'}) - ping.begin());
    const std::size_t image_at = std::min(line + 1, ping.size());
    if (region == protocol::Region::header) return std::pair{std::size_t{0}, image_at};
    return std::pair{image_at, ping.size() - image_at};
  }

 private:
  std::vector<std::shared_ptr<const SonarModel>> models_;
};

}  // namespace

const protocol::Vendor& made_up_vendor() {
  static const MadeUpVendor only;
  return only;
}

}  // namespace sonar::testing_daemon
