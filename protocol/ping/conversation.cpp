#include "protocol/ping/conversation.hpp"

namespace sonar::ping {
namespace {

constexpr std::size_t longest_reason = 80;   // limit for a nack, so that an answer is little longer than a request
constexpr std::size_t most_beyond = 128;     // bytes by which the answers to a datagram may exceed it before the rest is ignored
constexpr std::size_t notices_per_call = 8;  // bounds the log output that a hostile host can cause

}  // namespace

protocol::Option silence_option() {
  return {option_name::silence_s, {}, "60", "seconds without a message after which a UDP host counts as gone", 5, 600, "never"};
}
protocol::Option type_option(std::string_view usual, std::string_view meaning) {
  return {option_name::device_type, {}, usual, meaning, 0, 255, {}, true};
}

protocol::Reaction Conversation::on_bytes(protocol::BytesView received, Time now) {
  protocol::Reaction reaction;
  framer_.append(received);
  if (by_datagrams_) return on_datagram(received.size(), now);
  while (const auto frame = framer_.next()) on_frame(*frame, now, reaction);
  return reaction;
}

/// Answers with one datagram that is only a little longer than the received one. The sender's address may be forged; the answer
/// then goes to another computer, which long answers would flood.
protocol::Reaction Conversation::on_datagram(std::size_t size, Time now) {
  protocol::Reaction reaction;
  Bytes answers;
  std::size_t frames = 0;
  while (const auto frame = framer_.next()) {
    // A frame with a wrong sum is refused if it is the whole datagram. Otherwise it may be a false start within another frame.
    const bool is_all = header_size + frame->header.length + sum_size == size;
    if (!frame->sum_is_right && !is_all) continue;
    const std::size_t before = reaction.replies.size();
    on_frame(*frame, now, reaction);
    ++frames;
    for (std::size_t i = before; i < reaction.replies.size(); ++i)
      answers.insert(answers.end(), reaction.replies[i].begin(), reaction.replies[i].end());
    if (answers.size() > size + most_beyond) break;  // the rest of the requests is ignored
  }
  framer_.drop_rest();
  if (frames > 1 && !answers.empty()) reaction.replies = {std::move(answers)};
  return reaction;
}

std::optional<std::chrono::milliseconds> Conversation::longest_silence() const {
  const double s = number_option(device_.options, option_name::silence_s);
  return by_datagrams_ && s > 0 ? std::optional(std::chrono::milliseconds(static_cast<int>(1000 * s))) : std::nullopt;
}

/// Answers the requests that every device of the family answers, and passes other requests to the product.
void Conversation::on_frame(const Frame& frame, Time now, protocol::Reaction& reaction) {
  if (is_of_device(frame.header.id)) return;  // answering it would let two devices answer each other without end
  if (!frame.sum_is_right) return refuse(frame, "wrong checksum", reaction);
  if (frame.header.id == Id::general_request) return on_general_request(frame, now, reaction);
  if (frame.header.id == Id::set_device_id) return set_id(frame, reaction);
  if (!on_request(frame, now, reaction)) refuse(frame, "unknown message", reaction);
}

void Conversation::on_general_request(const Frame& frame, Time now, protocol::Reaction& reaction) {
  Id wanted{};
  wire::Reader reader(frame.payload);
  reader("requested_id", wanted);
  if (!reader.ok()) return refuse(frame, reader.failure_text(), reaction);
  answer(wanted, now, reaction);
}

void Conversation::answer(Id wanted, Time now, protocol::Reaction& reaction) {
  if (comes_with_pings(wanted) || on_wanted(wanted, now, reaction)) return;
  Bytes answer;
  if (wanted == Id::device_information)
    answer = framed_message(wanted, id_, identity_);
  else if (wanted == Id::protocol_version)
    answer = framed_message(wanted, id_, ProtocolVersion{});
  else
    answer = message_now(wanted, now);
  // The nack has the id of the missing message, because the host waits for that message.
  reaction.replies.push_back(answer.empty() ? nack(wanted, id_, "unknown message") : std::move(answer));
}

// The ack already has the new id.
void Conversation::set_id(const Frame& frame, protocol::Reaction& reaction) {
  std::uint8_t id = 0;
  wire::Reader reader(frame.payload);
  reader("device_id", id);
  if (!reader.ok() || id == 0 || id == 255) return refuse(frame, "device_id must be 1 to 254", reaction);
  id_ = id;
  on_new_id(reaction);
  reaction.replies.push_back(ack(frame.header.id, id_));
}

void Conversation::refuse(const Frame& frame, const std::string& why, protocol::Reaction& reaction) const {
  reaction.replies.push_back(nack(frame.header.id, id_, std::string_view(why).substr(0, longest_reason)));
  if (reaction.events.size() < notices_per_call)
    reaction.events.emplace_back(
        protocol::Notice{"refused a host's message " + std::to_string(static_cast<int>(frame.header.id)) + ": " + why});
}

}  // namespace sonar::ping
