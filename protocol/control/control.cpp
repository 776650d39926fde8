#include "protocol/control/control.hpp"

#include "protocol/control/messages.hpp"

namespace sonar::control {
namespace {

/// Removes a varint from the front of `bytes`. Returns nullopt if the varint does not end within them, or is longer than 10
/// bytes.
std::optional<std::uint64_t> take_varint(BytesView& bytes) {
  std::uint64_t value = 0;
  for (std::size_t i = 0; i < bytes.size() && i < 10; ++i) {
    const auto byte = std::to_integer<std::uint64_t>(bytes[i]);
    value |= (byte & 0x7f) << (7 * i);
    if ((byte & 0x80) != 0) continue;
    bytes = bytes.subspan(i + 1);
    return value;
  }
  return std::nullopt;
}

}  // namespace

Result<PoseSample> decode_pose_datagram(BytesView datagram) {
  v1::PoseUpdate message;
  if (datagram.size() > largest_datagram) return failure(ErrorKind::bad_data, "pose datagram is longer than 1200 bytes");
  if (datagram.empty() || !parse(message, datagram)) return failure(ErrorKind::bad_data, "datagram is not a PoseUpdate message");
  return from(message);
}

tl::expected<Request, RefusedRequest> decode_request(BytesView bytes) {
  v1::Request message;
  if (!parse(message, bytes)) return tl::unexpected(RefusedRequest{0, "message is not a Request", false, false});
  return from(message);
}

bool is_unasked_pose(BytesView rest) {
  // Reads only the keys of the outermost message, which are `field number << 3 | wire type` (protobuf encoding guide), and skips
  // the values. Request has only varints and messages.
  constexpr std::uint64_t varint = 0, with_length = 2;
  bool has_id = false, is_pose = false;
  while (!rest.empty()) {
    const auto key = take_varint(rest);
    const auto value = key && (*key & 7) <= with_length ? take_varint(rest) : std::nullopt;
    if (!value) return false;
    const std::uint64_t field = *key >> 3;
    if ((*key & 7) == varint) {
      if (field == v1::Request::kIdFieldNumber) has_id = *value != 0;
      continue;
    }
    if ((*key & 7) != with_length || *value > rest.size()) return false;
    // If a request has several operations, protobuf keeps the last one.
    is_pose = field == v1::Request::kPoseFieldNumber || field == v1::Request::kObjectFieldNumber;
    rest = rest.subspan(static_cast<std::size_t>(*value));
  }
  return is_pose && !has_id;
}

Bytes encode_response(v1::Response response) {
  repair_texts(response);
  return serialized(response);
}

Bytes encode_pose_datagram(const PoseSample& sample) {
  v1::PoseUpdate message;
  fill(message, sample);
  return serialized(message);
}

Bytes encode_request(const Request& request) {
  v1::Request message;
  fill(message, request);
  return serialized(message);
}

// Clients check responses as strictly as the daemon checks requests, so that tools never compute with NaN.
Result<std::shared_ptr<const v1::Response>> decode_response(BytesView bytes) {
  auto message = std::make_shared<v1::Response>();
  if (!parse(*message, bytes)) return failure(ErrorKind::bad_data, "message is not a Response");
  if (const auto where = first_unreal_number(*message)) return failure(ErrorKind::bad_data, *where + " is NaN or infinite");
  if (const auto where = first_bad_orientation(*message))
    return failure(ErrorKind::bad_data, *where + " is not a quaternion of norm 1");
  if (message->has_event() && message->event().what_case() == v1::Event::WHAT_NOT_SET)
    return failure(ErrorKind::bad_data, "the event is of an unknown kind");
  return message;
}

v1::Status status_of(StatusCode code, const std::string& text) {
  v1::Status status;
  status.set_code(static_cast<v1::Status::Code>(code));
  status.set_text(text);
  return status;
}

v1::Response response_of(std::uint64_t id, StatusCode code, const std::string& text) {
  v1::Response response;
  response.set_id(id);
  *response.mutable_status() = status_of(code, text);
  return response;
}

namespace {
constexpr std::size_t longest_length_field = 5;  // bytes of a varint of 32 bits
}

Result<std::optional<std::vector<std::byte>>> DelimitedParser::next() {
  // Each call reads the length again until the whole message has arrived; the limit is checked before any memory is reserved.
  std::uint64_t length = 0;
  std::size_t used = 0;
  while (true) {
    if (used == longest_length_field)
      return failure(ErrorKind::bad_data, "control stream: the length in front of a message has more than 5 bytes");
    if (start_ + used == buffer_.size()) return std::optional<std::vector<std::byte>>{};
    const auto byte = std::to_integer<std::uint64_t>(buffer_[start_ + used]);
    length |= (byte & 0x7f) << (7 * used);
    ++used;
    if ((byte & 0x80) == 0) break;
  }
  if (length > most_)
    return failure(ErrorKind::bad_data, "control stream: a message of " + std::to_string(length) +
                                            " bytes exceeds the limit of " + std::to_string(most_));
  if (buffer_.size() - start_ - used < length) return std::optional<std::vector<std::byte>>{};
  const auto first = buffer_.begin() + static_cast<std::ptrdiff_t>(start_ + used);
  std::vector<std::byte> message(first, first + static_cast<std::ptrdiff_t>(length));
  start_ += used + static_cast<std::size_t>(length);
  // The front is erased rarely, so that the rest is not moved for each small message.
  if (start_ == buffer_.size() || start_ > (64u << 10)) {
    buffer_.erase(buffer_.begin(), buffer_.begin() + static_cast<std::ptrdiff_t>(start_));
    start_ = 0;
  }
  return std::optional(std::move(message));
}

// A varint of protobuf has 7 bits per byte, the lowest first; the top bit means that another byte follows.
std::vector<std::byte> delimited(std::span<const std::byte> message) {
  std::vector<std::byte> out;
  out.reserve(message.size() + longest_length_field);
  std::uint64_t rest = message.size();
  do {
    const auto low = static_cast<std::uint8_t>(rest & 0x7f);
    rest >>= 7;
    out.push_back(static_cast<std::byte>(rest != 0 ? low | 0x80u : low));
  } while (rest != 0);
  out.insert(out.end(), message.begin(), message.end());
  return out;
}

}  // namespace sonar::control
