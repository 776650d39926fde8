// The dialogue on the serial line.
#include <algorithm>
#include <array>
#include <charconv>
#include <utility>
#include <vector>

#include "core/text/decimal.hpp"
#include "core/text/format.hpp"
#include "protocol/dvl/dialogue.hpp"
#include "protocol/dvl/dvl.hpp"
#include "protocol/dvl/reports.hpp"

namespace sonar::dvl {
namespace {

using protocol::Reaction;
using text::format;

constexpr std::size_t longest_sentence = 512;                  // our choice
constexpr std::size_t events_per_call = 32;                    // limits the events that a hostile host can cause
constexpr auto longest_pause = std::chrono::milliseconds(10);  // longest time between the bytes of a sentence (DOC)
constexpr std::string_view no_sentence = "wr?", wrong_checksum = "wr!", done = "wra", failed = "wrn";

using Words = std::vector<std::string_view>;

Words split(std::string_view options) {
  Words words;
  while (true) {
    const std::size_t comma = options.find(',');
    words.push_back(options.substr(0, comma));
    if (comma == std::string_view::npos) return words;
    options.remove_prefix(comma + 1);
  }
}

/// Returns the sentence without its checksum, which is optional; nullopt if the checksum is wrong.
std::optional<std::string_view> without_checksum(std::string_view sentence) {
  const std::size_t star = sentence.rfind('*');
  if (star == std::string_view::npos) return sentence;
  const std::string_view given = sentence.substr(star + 1);
  unsigned value = 0;
  const auto [end, error] = std::from_chars(given.data(), given.data() + given.size(), value, 16);
  const std::string_view body = sentence.substr(0, star);
  const bool fits = given.size() == 2 && error == std::errc{} && end == given.data() + 2 && value == crc8(body);
  return fits ? std::optional(body) : std::nullopt;
}

/// Returns the parameters of set_config from words in the order of the sentence; an empty word sets nothing. Returns nullopt if a
/// word is invalid.
std::optional<Json> parameters_from(const Words& words) {
  constexpr std::array<const char*, 6> names{"speed_of_sound",   "mounting_rotation_offset",
                                             "acoustic_enabled", "dark_mode_enabled",
                                             "range_mode",       "periodic_cycling_enabled"};
  constexpr std::size_t fewest = 4, range_mode = 4;  // earlier versions had no range mode
  if (words.size() < fewest || words.size() > names.size()) return std::nullopt;
  Json parameters = Json::object();
  for (std::size_t i = 0; i < words.size(); ++i) {
    if (words[i].empty()) continue;
    const auto number = text::parse_decimal(words[i]);
    const bool is_truth = words[i] == "y" || words[i] == "n";
    if (i < 2 ? !number : i != range_mode && !is_truth) return std::nullopt;
    if (i < 2)
      parameters[names[i]] = *number;
    else if (i == range_mode)
      parameters[names[i]] = std::string(words[i]);
    else
      parameters[names[i]] = words[i] == "y";
  }
  return parameters;
}

std::string configuration_sentence(const Settings& s) {
  const auto letter = [](bool yes) { return yes ? 'y' : 'n'; };
  return format("wrc,%g,%g,%c,%c,%s,%c", s.speed_of_sound_mps, s.mounting_rotation_deg, letter(s.acoustics), letter(s.dark),
                s.range_mode.c_str(), letter(s.cycles));
}

class SerialDialogue final : public Session {
 public:
  using Session::Session;

  Reaction on_bytes(BytesView received, Time now) override {
    Reaction reaction;
    for (const std::byte b : received) {
      const char c = std::to_integer<char>(b);
      if (c == '\r' || c == '\n')
        end_sentence(now, reaction);
      else if (sentence_.size() <= longest_sentence)
        sentence_ += c;
    }
    breaks_off_at_ = sentence_.empty() ? Time::max() : now + longest_pause;
    return reaction;
  }
  Reaction on_tick(Time now, bool ping_pending) override {
    Reaction reaction = Session::on_tick(now, ping_pending);
    if (now < breaks_off_at_) return reaction;
    breaks_off_at_ = Time::max();
    refuse(std::exchange(sentence_, {}), no_sentence, reaction);
    return reaction;
  }
  Time next_tick() const override { return std::min(Session::next_tick(), breaks_off_at_); }

 private:
  Bytes position_report(Time stamp) const override {
    const Settings s = settings();
    return s.serial_output == SerialOutput::none ? Bytes{} : position_sentence(extrapolated(s.reckoning, stamp), stamp);
  }

  void end_sentence(Time now, Reaction& reaction) {
    const std::string sentence = std::exchange(sentence_, {});
    if (sentence.empty()) return;  // LF after CR
    const auto body = without_checksum(sentence);
    if (!body) return refuse(sentence, wrong_checksum, reaction);
    const bool is_command = sentence.size() <= longest_sentence && body->size() >= 3 && body->starts_with("wc") &&
                            (body->size() == 3 || (*body)[3] == ',');
    if (!is_command) return refuse(sentence, no_sentence, reaction);
    if (reaction.events.size() >= events_per_call) return say(failed, reaction);
    const std::string answer = answer_to((*body)[2], body->size() == 3 ? Words{} : split(body->substr(4)), now, reaction);
    if (answer == no_sentence) return refuse(sentence, no_sentence, reaction);
    say(answer, reaction);
  }

  /// Carries out the command with this letter (DOC). `words`: the words after the letter.
  std::string answer_to(char letter, const Words& words, Time now, Reaction& reaction) {
    const auto result = [&](const char* command, const Json& parameters = nullptr) {
      return *execute(command, parameters, now, reaction);
    };
    const auto acknowledged = [](const Outcome& outcome) { return std::string(outcome.error.empty() ? done : failed); };
    if (words.size() == 1 && letter == 'p') return select_output(words[0], reaction);
    if (words.size() == 1 && letter == 'n') return acknowledged(result("set_time_ntp", {{"ntp_address", std::string(words[0])}}));
    if (words.size() == 1 && letter == 'm' && text::parse_decimal(words[0])) return acknowledged(result("set_time_manual"));
    if (words.size() == 1 && letter == 'T' && text::parse_decimal(words[0]))
      return result("force_sync_ntp").error.empty() ? "wrT,y" : "wrT,n";
    if (letter == 's') {
      const auto parameters = parameters_from(words);
      return parameters ? acknowledged(result("set_config", *parameters)) : std::string(no_sentence);
    }
    if (!words.empty()) return std::string(no_sentence);
    switch (letter) {
      case 'v':
        return "wrv,2.8.0";  // version of the protocol in the software version that version_info() states
      case 'w':
        return product();
      case 'c':
        return configuration_sentence(settings_after(reaction));
      case 'r':
        return acknowledged(result("reset_dead_reckoning"));
      case 'x':
        return acknowledged(result("trigger_ping"));
      case 'g':
        return acknowledged(result("calibrate_gyro"));
      case 'N':
        return "wrN," + settings_after(reaction).ntp_address;
      case 't':
        return time_status(stamp_of(now), settings_after(reaction));
      default:
        return std::string(no_sentence);
    }
  }

  std::string select_output(std::string_view word, Reaction& reaction) const {
    if (word == "2" || word == "6") return std::string(failed);  // PD6 and PD4 are not emulated
    Settings s = settings_after(reaction);
    if (word == "0")
      s.serial_output = SerialOutput::none;
    else if (word == "1")
      s.serial_output = SerialOutput::old_and_new;
    else if (word == "3")
      s.serial_output = SerialOutput::new_ones;
    else
      return std::string(failed);
    reaction.events.emplace_back(change_to(s, device()));
    return std::string(done);
  }

  std::string product() const {
    const Json info = version_info(device());
    return format("wrw,%s,%s,%s", device().model->profile.c_str(), info["version_short"].get<std::string>().c_str(),
                  info["chipid"].get<std::string>().c_str());
  }
  /// Returns the sentence as in the table of DOC, with microseconds, and y or n; its examples have seconds, and 0 or 1.
  std::string time_status(Time now, const Settings& s) const {
    return format("wrs,%lld,y,%s,%lld", static_cast<long long>(microseconds(now)), s.ntp_address.c_str(),
                  static_cast<long long>(std::chrono::duration_cast<std::chrono::seconds>(now - device().powered_up_at).count()));
  }

  static void refuse(const std::string& sentence, std::string_view answer, Reaction& reaction) {
    if (reaction.events.size() < events_per_call)
      reaction.events.emplace_back(protocol::Notice{(answer == wrong_checksum ? "wrong checksum: " : "no command: ") +
                                                    text::printable(sentence.substr(0, 80))});
    say(answer, reaction);
  }
  static void say(std::string_view answer, Reaction& reaction) { reaction.replies.push_back(sentence_line(answer)); }

  std::string sentence_;
  Time breaks_off_at_ = Time::max();  // time at which an incomplete sentence is dropped
};

}  // namespace

std::unique_ptr<protocol::Dialogue> converse_in_sentences(const protocol::DeviceState& device, Time now) {
  return std::make_unique<SerialDialogue>(device, now);
}

}  // namespace sonar::dvl
