// The messages of a DVL, for recordings.
#include "protocol/dvl/dvl.hpp"
#include "protocol/dvl/reports.hpp"
#include "protocol/dvl/settings.hpp"

namespace sonar::dvl {
namespace {

// Messages are lines, so Framing::length is null, and a message ends with the line.
constexpr recording::Framing framing{.magic = {'{', '"'}, .header_size = 2};

bool is_json(BytesView message) { return recording::begins_with(message, {'{', '"'}) && message.size() <= longest_line; }

std::optional<recording::Sender> sender_of(const recording::RecordedMessage& message) {
  if (!is_json(message.bytes) || !read_line(message.bytes).velocity) return std::nullopt;
  return recording::Sender{.model = models().front(), .names_model = false};
}

/// Finds the ping in a message. Each report counts as a ping.
std::optional<recording::PingPart> ping_part(BytesView message) {
  if (recording::begins_with(message, {'w', 'r'})) return recording::PingPart{.port = serial_port};
  if (!is_json(message)) return std::nullopt;
  const Line line = read_line(message);
  return line.velocity || line.position ? std::optional(recording::PingPart{.port = tcp_port}) : std::nullopt;
}

/// Returns the recorded line, and the same report as sentences of the serial line.
std::vector<Bytes> answer(BytesView message, const VendorSettings* request) {
  std::vector<Bytes> lines{Bytes(message.begin(), message.end())};
  const Line line = read_line(message);
  const SerialOutput output = settings_from(request).serial_output;
  Bytes sentences;
  if (line.velocity)
    sentences = velocity_sentences(line.velocity->measured, line.velocity->since_last, line.velocity->sent_at, output);
  else if (line.position && output != SerialOutput::none)
    sentences = position_sentence(line.position->reckoning, line.position->at);
  if (!sentences.empty()) lines.push_back(std::move(sentences));
  return lines;
}

}  // namespace

recording::Codec codec() {
  return {.framing = &framing,
          .sender = sender_of,
          .ping_part = ping_part,
          .answer = answer,
          .replayed = [](const SonarModel& recorded) { return replayed_model(recorded); }};
}

}  // namespace sonar::dvl
