#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <optional>
#include <utility>
#include <vector>

#include "core/text/format.hpp"
#include "protocol/norbit/messages.hpp"
#include "protocol/norbit/norbit.hpp"
#include "protocol/norbit/settings.hpp"

namespace sonar::norbit {
namespace {

using protocol::DeviceState;
using protocol::Reaction;
using text::format;

constexpr std::size_t longest_line = 512;
constexpr std::size_t events_per_call = 32;                  // limits the events that a hostile host can cause
constexpr auto end_of_line = std::chrono::milliseconds(20);  // silence that ends a line, because ROS sends no line end

/// A command that reads or changes a setting. Its reply ends with `comment`.
struct Command {
  std::string_view name;
  std::string (*values)(const Settings&);
  void (*set)(Settings&, const std::vector<double>&);
  std::size_t arguments;
  std::string_view comment;
  bool is_whole = false;  // true: its numbers have no fractions
};
constexpr std::array<Command, 6> commands{{
    {"set_power", [](const Settings& s) { return std::to_string(s.power); },
     [](Settings& s, const std::vector<double>& a) { s.power = static_cast<int>(std::clamp(a[0], -1.0, 2.0)); }, 1, "1: pings",
     true},
    {"set_range", [](const Settings& s) { return format("%g %g", s.start_m, s.stop_m); },
     [](Settings& s, const std::vector<double>& a) { s.start_m = a[0], s.stop_m = a[1]; }, 2, "m"},
    {"set_rate", [](const Settings& s) { return format("%g", s.rate_hz); },
     [](Settings& s, const std::vector<double>& a) { s.rate_hz = a[0]; }, 1, "Hz"},
    {"set_gain", [](const Settings& s) { return format("%g", s.gain_db); },
     [](Settings& s, const std::vector<double>& a) { s.gain_db = a[0]; }, 1, "dB"},
    {"set_resolution", [](const Settings& s) { return format("%d %d", s.samples, s.beams); },
     [](Settings& s, const std::vector<double>& a) {
       s.samples = static_cast<int>(std::clamp(a[0], -1.0, 1e6));
       s.beams = static_cast<int>(std::clamp(a[1], -1.0, 1e6));
     },
     2, "samples, beams", true},
    {"sound_velocity", [](const Settings& s) { return format("%g", s.sound_mps); },
     [](Settings& s, const std::vector<double>& a) { s.sound_mps = a[0]; }, 1, "m/s, -1: measured"},
}};

/// Returns the constant or read-only values of a command; empty if the command is unknown or has none.
std::string fixed_values(std::string_view name, const DeviceState& device) {
  const int mode = mode_of(*device.model);
  if (name == "set_mode" || name == "set_flip") return std::to_string(mode);
  if (name == "set_opening_angle") return format("%g", swath_deg);
  if (name == "set_tx") return format("%g %g %d %d", frequency_khz, bandwidth_khz, amplitude, pulse_us);
  if (name == "set_vga") return format("%g", 100 * gain_slope_db_per_m);
  if (name == "set_trigger_mode") return "2";
  for (const std::string_view one : {"set_time_source", "set_mf_decimation", "set_tx_beam_number"})
    if (name == one) return "1";
  if (name == "set_tp_rate") return "-1";
  if (name == "temperature") return format("%.1f", device.water.temperature_c);
  if (name == "serial") return std::to_string(device.id);
  if (name == "partno") return "12003";
  if (name == "revision") return "0";
  for (const std::string_view zero :
       {"set_gate_mode", "set_gate_tilt", "set_direction", "set_autogate_preset", "autogain", "set_sidescan_mode",
        "set_ntp_server", "set_snippet_rate", "set_tx_direction", "set_tx_opening_angle", "bit_log", "ntp_log"})
    if (name == zero) return "0";
  return {};
}

std::vector<std::string_view> words_of(std::string_view line) {
  std::vector<std::string_view> words;
  while (!line.empty()) {
    const std::size_t begin = std::min(line.find_first_not_of(" \t"), line.size());
    line.remove_prefix(begin);
    const std::size_t end = std::min(line.find_first_of(" \t"), line.size());
    if (end > 0) words.push_back(line.substr(0, end));
    line.remove_prefix(end);
  }
  return words;
}

/// Returns the numbers; nullopt if a word is not a finite number.
std::optional<std::vector<double>> numbers_of(std::span<const std::string_view> words) {
  std::vector<double> numbers;
  for (const std::string_view word : words) {
    double value = 0;
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
    if (error != std::errc{} || end != word.data() + word.size() || !std::isfinite(value)) return std::nullopt;
    numbers.push_back(value);
  }
  return numbers;
}

class CommandDialogue final : public protocol::Dialogue {
 public:
  CommandDialogue(const DeviceState& device, Time now) : device_(device), greets_at_(now) {}

  Reaction on_bytes(BytesView received, Time now) override {
    Reaction reaction;
    greet(now, reaction);
    for (const std::byte b : received) {
      const char c = std::to_integer<char>(b);
      if (c == '\r' || c == '\n')
        end_line(reaction);
      else if (line_.size() < longest_line)
        line_ += c;
    }
    // Simulated time may not advance while a host waits for the reply, so in simulated time each piece of bytes ends a line.
    ends_at_ = line_.empty() ? Time::max() : now + end_of_line;
    if (device_.simulated_time) end_line(reaction);
    return reaction;
  }
  Reaction on_tick(Time now, bool) override {
    Reaction reaction;
    greet(now, reaction);
    if (now >= ends_at_) end_line(reaction);
    return reaction;
  }
  Time next_tick() const override { return std::min(greets_at_, ends_at_); }
  void on_ping_queued(Time) override {}
  protocol::Delivery on_ping(const VendorSettings*, std::size_t, Time) override { return {}; }

 private:
  void greet(Time now, Reaction& reaction) {
    if (now < greets_at_) return;
    greets_at_ = Time::max();
    say("Sonar is ready to accept commands", reaction);
  }
  void end_line(Reaction& reaction) {
    const std::string line = std::exchange(line_, {});
    ends_at_ = Time::max();
    const auto words = words_of(line);
    if (words.empty()) return;
    if (reaction.events.size() < events_per_call) return run(words, reaction);
    if (reaction.events.size() == events_per_call) notice("too many commands at once: the rest is ignored", reaction);
  }

  void run(const std::vector<std::string_view>& words, Reaction& reaction) {
    std::string_view name = words.front();
    std::vector<std::string_view> given(words.begin() + 1, words.end());
    if (name == "exit") return reaction.events.emplace_back(protocol::Close{"it sent exit"}), void();
    if (name == "on" || name == "off") given = {name == "on" ? "1" : "0"}, name = "set_power";
    if (name == "set_default") {
      reaction.events.emplace_back(change_to(Settings{}, device_));
      return say("set_default", reaction);
    }
    const auto known = std::find_if(commands.begin(), commands.end(), [&](const Command& c) { return c.name == name; });
    if (known != commands.end()) return set(*known, given, reaction);
    const std::string fixed = fixed_values(name, device_);
    if (fixed.empty()) {
      const std::string shown = text::printable(name.substr(0, 40));
      notice("unknown command " + shown, reaction);
      return say(shown + " # unknown command", reaction);
    }
    say(std::string(name) + " " + fixed + (given.empty() ? "" : " # fixed"), reaction);
  }

  void set(const Command& command, const std::vector<std::string_view>& given, Reaction& reaction) {
    Settings s = settings_from(protocol::settings_after(reaction, device_.settings.get()));
    std::string comment(command.comment);
    if (!given.empty()) {
      Settings wanted = s;
      const auto numbers = numbers_of(given);
      std::string why = format("it has %zu numbers", command.arguments);
      const auto is_whole = [](double number) { return std::trunc(number) == number; };
      if (numbers && command.is_whole && !std::ranges::all_of(*numbers, is_whole)) {
        why = "its numbers have no fractions";
      } else if (numbers && numbers->size() == command.arguments) {
        command.set(wanted, *numbers);
        why = complaint(wanted);
      }
      if (why.empty()) {
        s = wanted;
        reaction.events.emplace_back(change_to(s, device_));
      } else {
        comment = "unchanged: " + why;
        notice(std::string(command.name) + " is refused: " + why, reaction);
      }
    }
    say(std::string(command.name) + " " + command.values(s) + " # " + comment, reaction);
  }

  static void notice(std::string text, Reaction& reaction) { reaction.events.emplace_back(protocol::Notice{std::move(text)}); }
  static void say(std::string text, Reaction& reaction) {
    text += "\r\n";
    const auto bytes = std::as_bytes(std::span(text));
    reaction.replies.emplace_back(bytes.begin(), bytes.end());
  }

  const DeviceState& device_;
  Time greets_at_{}, ends_at_ = Time::max();
  std::string line_;
};

class DataDialogue final : public protocol::Dialogue {
 public:
  Reaction on_bytes(BytesView received, Time) override {
    return {{protocol::Notice{std::to_string(received.size()) + " bytes at a port where drivers send none"}}, {}};
  }
  Reaction on_tick(Time, bool) override { return {}; }
  Time next_tick() const override { return Time::max(); }
  void on_ping_queued(Time) override {}
};

}  // namespace

std::unique_ptr<protocol::Dialogue> make_dialogue(const protocol::Port& port, const DeviceState& device, Time now) {
  if (port.number == command_port) return std::make_unique<CommandDialogue>(device, now);
  return std::make_unique<DataDialogue>();
}

}  // namespace sonar::norbit
