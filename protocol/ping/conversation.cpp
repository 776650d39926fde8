#include "protocol/ping/conversation.hpp"

namespace sonar::ping {
namespace {

constexpr std::size_t longest_reason = 80;   // limit for a nack, so that an answer is little longer than a request
constexpr std::size_t notices_per_call = 8;  // bounds the log output that a hostile host can cause

}  // namespace

protocol::Option silence_option() {
  return {option_name::silence_s,
          {},
          "60",
          "a host by UDP of which nothing is heard for so long is given up, seconds",
          5,
          600,
          "never"};
}
protocol::Option type_option(std::string_view usual, std::string_view meaning) {
  return {option_name::device_type, {}, usual, meaning, 0, 255};
}

protocol::Reaction Conversation::on_bytes(protocol::BytesView received, Time now) {
  protocol::Reaction reaction;
  framer_.append(received);
  while (const auto frame = framer_.next()) {
    // Sends one answer per datagram, because the address of its sender may be forged.
    const bool is_all = header_size + frame->header.length + sum_size == received.size();
    if (!by_datagrams_ || frame->sum_is_right || is_all) on_frame(*frame, now, reaction);
    if (by_datagrams_ && frame->sum_is_right) break;
  }
  if (by_datagrams_) framer_.drop_rest();
  return reaction;
}

std::optional<std::chrono::milliseconds> Conversation::longest_silence() const {
  const double s = number_option(device_.options, option_name::silence_s);
  return by_datagrams_ && s > 0 ? std::optional(std::chrono::milliseconds(static_cast<int>(1000 * s))) : std::nullopt;
}

void Conversation::on_frame(const Frame& frame, Time now, protocol::Reaction& reaction) {
  if (is_of_device(frame.header.id)) return;
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
  // The nack has the number of the missing message, because the host waits for that one.
  reaction.replies.push_back(answer.empty() ? nack(wanted, id_, "unknown message") : std::move(answer));
}

void Conversation::set_id(const Frame& frame, protocol::Reaction& reaction) {
  std::uint8_t id = 0;
  wire::Reader reader(frame.payload);
  reader("device_id", id);
  if (!reader.ok() || id == 0 || id == 255) return refuse(frame, "device ids are 1 to 254", reaction);
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
