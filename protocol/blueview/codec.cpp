// The messages and files of BlueView, for recordings.
#include <algorithm>

#include "protocol/blueview/blueview.hpp"
#include "protocol/blueview/frames.hpp"
#include "protocol/blueview/models.hpp"

namespace sonar::blueview {
namespace {

std::optional<FrameHeader> header_of(wire::BytesView bytes) {
  FrameHeader header;
  wire::Reader reader(bytes);
  fields(reader, header);
  return reader.ok() && header.magic == magic && header.payload_length <= longest_payload ? std::optional(header) : std::nullopt;
}

std::optional<std::size_t> length_of(wire::BytesView bytes, recording::Origin, bool) {
  const auto header = header_of(bytes);
  return header ? std::optional(header_size + header->payload_length) : std::nullopt;
}

/// Returns the sender of a message. Only the greeting states the model. For other messages the model is the first of this make,
/// and names_model is false.
std::optional<recording::Sender> sender_of(const recording::RecordedMessage& message) {
  const auto header = header_of(message.bytes);
  if (!header || message.by != recording::Carrier::stream) return std::nullopt;
  recording::Sender sender{.model = models().front(), .names_model = false};
  wire::Reader reader(message.bytes.size() > header_size ? wire::BytesView(message.bytes).subspan(header_size)
                                                         : wire::BytesView());
  std::uint16_t version = 0;
  reader("proto", version);
  const std::string name = header->type == FrameType::hello_ok ? read_text(reader, "model") : std::string();
  const auto found = std::find_if(models().begin(), models().end(), [&name](const auto& model) { return model->name == name; });
  if (found != models().end()) sender = {.model = *found};
  return sender;
}

std::optional<recording::PingPart> ping_part(wire::BytesView message) {
  const auto header = header_of(message);
  const bool is_ping = header && header->type == FrameType::ping_data && message.size() == header_size + header->payload_length;
  return is_ping ? std::optional(recording::PingPart{}) : std::nullopt;
}

constexpr recording::Framing framing{{magic[0], magic[1]}, header_size, length_of};

}  // namespace

recording::Codec codec() {
  return {.framing = &framing,
          .sender = sender_of,
          .message =
              [](wire::BytesView payload) {
                return make_frame(FrameType::ping_data, 0, payload);  // id 0: not the answer to a request
              },
          .ping_part = ping_part,
          .answer =
              [](wire::BytesView message, const VendorSettings*) {
                const auto payload = message.subspan(header_size);  // the dialogue makes the header
                return std::vector<wire::Bytes>{wire::Bytes(payload.begin(), payload.end())};
              }};
}

}  // namespace sonar::blueview
