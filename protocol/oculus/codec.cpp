// The messages and files of Oculus, for recordings.
#include <algorithm>
#include <array>

#include "protocol/oculus/decode.hpp"
#include "protocol/oculus/models.hpp"
#include "protocol/oculus/oculus.hpp"
#include "protocol/oculus/oculus_log.hpp"

namespace sonar::oculus {
namespace {

using recording::Origin;
using recording::RecordedMessage;

bool is_known(MessageType type) {
  using enum MessageType;
  switch (type) {
    case status:
    case fire:
    case full_ping_result:
    case ping_result:
    case user_config:
    case log:
    case dummy:
      return true;
  }
  return false;
}

/// Returns the length of the message with this header. The magic number has only two bytes, so samples may contain it; `strict`
/// also requires a known type of message.
std::optional<std::size_t> length_of(wire::BytesView header, Origin from, bool strict) {
  const MessageHeader read = header_of(header);
  if (strict && !is_known(read.type)) return std::nullopt;
  return message_length(read, from == Origin::device ? Sender::device : Sender::client);
}

/// Returns the sender of a message. Only a status message states the model.
std::optional<recording::Sender> sender_of(const RecordedMessage& message) {
  if (!framing.begins_message(message.bytes, Origin::device)) return std::nullopt;
  const MessageHeader header = header_of(message.bytes);
  const auto found = std::find_if(models().begin(), models().end(), [&header](const auto& model) {
    return header.type == MessageType::status && model->part_number == header.part_number;
  });
  const bool is_named = found != models().end();
  return recording::Sender{is_named ? *found : models().front(), header.source, is_named};
}

/// Returns the samples of a ping result without the row gains between them.
std::optional<recording::Samples> samples_of(wire::BytesView message) {
  if (message.size() < header_size || header_of(message).type != MessageType::ping_result) return std::nullopt;
  const auto ping = decode_ping(message);
  if (!ping || !ping->has_image) return std::nullopt;
  const auto codes = std::make_shared<wire::Bytes>();
  for (std::size_t row = 0; row < ping->rows(); ++row) {
    const wire::BytesView samples = ping->row_samples(row);
    codes->insert(codes->end(), samples.begin(), samples.end());
  }
  return recording::Samples{ping->beams(), ping->rows(), static_cast<int>(8 * ping->bytes_per_sample()), codes};
}

constexpr std::array<recording::FileKind, 1> kinds{{{
    .ending = ".oculus",
    .name = ".oculus log",
    .holds = "Oculus messages",
    .begins =
        [](wire::BytesView front) {
          return recording::begins_with(front, {0x44, 0x33, 0x22, 0x11}) ||
                 recording::begins_with(front, {'S', 'Q', 'L', 'i', 't', 'e', ' ', 'f'});  // a log of version 2
        },
    .read = recording::read_oculus_log,
    .write = recording::write_oculus_log,
}}};

}  // namespace

const recording::Framing framing{{magic & 0xFF, magic >> 8}, header_size, length_of};

recording::Codec codec() { return {&framing, kinds, sender_of, samples_of}; }

}  // namespace sonar::oculus
