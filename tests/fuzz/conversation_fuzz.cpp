// Fuzzes conversations with Oculus and BlueView in virtual time. Clients connect, send requests, read slowly and disconnect, in
// the order of a script of bytes. The first byte selects make, product and options, the second byte the outbox and the rules for
// clients. Commands follow: a letter and its arguments.
#include "protocol/blueview/frames.hpp"
#include "protocol/oculus/fire.hpp"
#include "tests/fuzz/byte_script.hpp"
#include "tests/fuzz/sonar_clients.hpp"

namespace {

using namespace sonar;
using fuzz::Script;
using fuzz::SonarClients;

struct Choice {
  const char* profile;
  protocol::OptionValues options;
};
const Choice& chosen(std::uint8_t number) {
  static const std::vector<Choice> choices{
      {"oculus-m1200d", {}},
      {"oculus-m750d", {{"boot_text", "on"}, {"before_first_fire", "pings"}}},
      {"oculus-m3000d", {{"reply_version", "2"}, {"dummy_period_ms", "10"}, {"out_of_range", "ignore"}}},
      {"blueview-m900-2250-130", {}},
      {"blueview-p900-90", {{"heads_base", "strict"}, {"compression", "deflate"}}},
      {"blueview-p900-130", {{"heads_base", "1"}}},
  };
  return choices[number % choices.size()];
}

protocol::Bytes fire_message(Script& script) {
  static constexpr double ranges[]{0, 0.1, 1, 2, 5, 10, 20, 40, 100, -1, 1e9};
  oculus::FireRequest fire;
  fire.version = script.byte() % 4;
  fire.settings.mode = script.byte();
  fire.settings.ping_rate = static_cast<oculus::PingRate>(script.byte());
  fire.settings.flags = script.byte();
  fire.settings.range = ranges[script.byte() % 11];
  fire.settings.gain_percent = script.byte();
  fire.settings.sound_speed_mps = 10 * script.byte();
  fire.extension.flags = std::uint32_t{script.byte()} << 8;
  return oculus::make_fire(fire);
}

blueview::Value value_of(Script& script, blueview::Key key) {
  const auto small = static_cast<float>(script.byte()) * 0.25f;
  if (key == blueview::Key::range) return blueview::FloatPair{small, small + static_cast<float>(script.byte()) * 0.01f};
  if (key == blueview::Key::name) return std::string(script.byte(), 'n');
  if (script.byte() % 2 == 0) return small;
  return static_cast<std::int32_t>(script.byte());
}

protocol::Bytes blueview_message(Script& script, char letter) {
  using blueview::FrameType;
  protocol::Bytes payload;
  const blueview::Put put(payload);
  const auto number = static_cast<std::uint32_t>(script.byte());
  const std::uint32_t id = number + 1;
  if (letter == 'h') {
    put("proto", static_cast<std::uint16_t>(number % 8 == 7 ? 2 : 1));
    put("abi", std::uint16_t{4});
    blueview::put_text(payload, "fuzz");
    return blueview::make_frame(FrameType::hello, id, payload);
  }
  put("head", static_cast<std::int32_t>(number % 4) - 1);
  if (letter == 'p' || letter == 'b') {
    put("number", 10 * static_cast<std::uint32_t>(script.byte()));
    return blueview::make_frame(letter == 'p' ? FrameType::ping : FrameType::subscribe, id, payload);
  }
  const auto key = static_cast<blueview::Key>(script.byte() % 15);
  put("key", key);
  if (letter == 's') blueview::put_value(payload, value_of(script, key));
  return blueview::make_frame(letter == 's' ? FrameType::set : FrameType::get, id, payload);
}

/// Sends bytes; with `split` in two pieces.
void send(SonarClients& talk, std::size_t place, protocol::BytesView bytes, bool split) {
  const std::size_t cut = split ? bytes.size() / 3 : 0;
  talk.receive(place, bytes.first(cut));
  talk.receive(place, bytes.subspan(cut));
}

void run_step(SonarClients& talk, Script& script) {
  const char letter = static_cast<char>(script.byte());
  if (letter == 'P') return talk.fire();
  const std::uint8_t first = script.byte();
  if (letter == 'w') return talk.wait(std::chrono::milliseconds(first < 200 ? first : (first - 199) * 250));
  const std::size_t place = first % SonarClients::places;
  const bool split = first >= 128;
  switch (letter) {
    case 'c':
      return talk.connect(place);
    case 'o':
      return talk.connect(place, Role::observer);
    case 'f':
      return send(talk, place, fire_message(script), split);
    case 'h':
    case 's':
    case 'g':
    case 'p':
    case 'b':
      return send(talk, place, blueview_message(script, letter), split);
    case 'r':
      return send(talk, place, std::as_bytes(script.piece(script.byte())), split);
    case 't':
      return talk.tick(place);
    case 'W':
      return talk.write(place, std::size_t{4} * script.byte());
    case 'T':
      return talk.write(place, ~std::size_t{0});
    case 'F':
      return talk.finish(place);
    case 'x':
      return talk.disconnect(place);
    default:
      return;
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size < 3 || size > 2048) return 0;
  Script script(data, size);
  const Choice& choice = chosen(script.byte());
  const std::uint8_t rules = script.byte();
  const auto profile = protocol::find_profile(choice.profile).value();
  SonarConfig sonar;
  sonar.name = "front";
  sonar.profile = profile;
  sonar.mount = {};
  sonar.device_id = 7001;
  sonar.options = protocol::check_options(*profile.vendor, choice.options).value();
  sonar.outbox = {.depth = 1 + rules % 3, .when_full = rules >= 128 ? WhenFull::drop_newest : WhenFull::replace_oldest};
  sonar.max_clients = 3 - rules / 3 % 3;
  sonar.when_full = static_cast<WhenClientsFull>(rules / 9 % 3);
  SonarClients talk(std::move(sonar));
  while (!script.ended()) run_step(talk, script);
  talk.end();
  return 0;
}
