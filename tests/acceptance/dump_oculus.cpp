// Prints the messages that protocol/oculus decodes from a file of raw bytes: a JSON line for each, with the vendor's names of
// fields, so that dissector_test.py can compare our decoder with tshark. Usage: dump_oculus device|client|status FILE.
#include <cstdio>
#include <fstream>
#include <iterator>
#include <optional>
#include <string>

#include "protocol/oculus/decode.hpp"
#include "tests/protocol/oculus/json_of.hpp"

namespace sonar::oculus::tests {
namespace {

using Json = nlohmann::json;

std::optional<wire::Bytes> bytes_of_file(const char* path) {
  std::ifstream file(path, std::ios::binary);
  if (!file) return std::nullopt;
  wire::Bytes bytes;
  for (auto at = std::istreambuf_iterator<char>(file); at != std::istreambuf_iterator<char>(); ++at)
    bytes.push_back(static_cast<std::byte>(*at));
  return bytes;
}

std::string hex_from(wire::BytesView bytes) {
  static constexpr char digits[] = "0123456789abcdef";
  std::string text;
  for (const std::byte b : bytes) {
    text += digits[std::to_integer<unsigned>(b) >> 4];
    text += digits[std::to_integer<unsigned>(b) & 15u];
  }
  return text;
}

/// The decoder stores both versions in the long form; fields that the short form does not have are omitted.
Json fields_of(const DecodedPing& ping) {
  Json object = json_of(ping.head.fixed);
  if (ping.head.fixed.header.version >= 2) return object;
  for (const char* name : {"extension", "heading", "pitch", "roll", "spare"}) object.erase(name);
  object["pingStartTime"] = ping.head.ping_start_counter;
  return object;
}

Json line_of(const DecodedPing& ping) {
  Json line{{"kind", "ping"}, {"fields", fields_of(ping)}, {"bearings", ping.bearings_cdeg}, {"rowGains", ping.row_gains}};
  line["violations"] = ping.violations;
  if (!ping.has_image) return line;
  std::string samples;
  for (std::size_t row = 0; row < ping.rows(); ++row) samples += hex_from(ping.row_samples(row));
  line["samples"] = samples;
  return line;
}
Json line_of(const DummyMessage& dummy) { return {{"kind", "dummy"}, {"fields", json_of(dummy)}}; }
Json line_of(const UserConfigMessage& config) { return {{"kind", "config"}, {"fields", json_of(config)}}; }
Json line_of(const LogText& log) { return {{"kind", "log"}, {"fields", {{"header", json_of(log.header)}}}, {"text", log.text}}; }
Json line_of(const OtherMessage& other) { return {{"kind", "other"}, {"fields", {{"header", json_of(other.header)}}}}; }

void dump_device(const wire::Bytes& bytes) {
  Decoder decoder;
  decoder.append(bytes);
  while (const auto message = decoder.next())
    std::puts(std::visit([](const auto& m) { return line_of(m); }, *message).dump().c_str());
}

void dump_client(const wire::Bytes& bytes) {
  Framer framer(Sender::client);
  framer.append(bytes);
  while (const auto message = framer.next()) {
    const MessageHeader header = header_of(*message);
    if (const auto fire = parse_fire(*message); header.type == MessageType::fire && fire) {
      Json fields{{"header", json_of(header)}, {"fire", json_of(fire->settings)}};
      if (fire->version >= 2) fields["extension"] = json_of(fire->extension);
      std::puts(Json{{"kind", "fire"}, {"fields", fields}}.dump().c_str());
    } else {
      std::puts(std::visit([](const auto& m) { return line_of(m); }, decode_message(*message)).dump().c_str());
    }
  }
}

/// Reads successive datagrams of 142 bytes.
void dump_status(const wire::Bytes& bytes) {
  for (std::size_t at = 0; at + status_size <= bytes.size(); at += status_size)
    if (const auto status = decode_status(wire::BytesView(bytes).subspan(at, status_size)))
      std::puts(Json{{"kind", "status"}, {"fields", json_of(*status)}}.dump().c_str());
}

}  // namespace
}  // namespace sonar::oculus::tests

int main(int count, char** arguments) {
  using namespace sonar::oculus::tests;
  const std::string what = count == 3 ? arguments[1] : "";
  const auto dump = what == "device" ? dump_device : what == "client" ? dump_client : what == "status" ? dump_status : nullptr;
  const auto bytes = dump != nullptr ? bytes_of_file(arguments[2]) : std::nullopt;
  if (!bytes) {
    std::fputs("usage: dump_oculus device|client|status FILE\n", stderr);
    return 64;
  }
  dump(*bytes);
  return 0;
}
