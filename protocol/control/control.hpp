// Bytes and JSON of the control protocol. Requests are plain structs: the daemon decodes them; tools and tests encode them.
// Answers and events are protobuf's classes (protocol/control/answers.hpp); this header only declares them, because they take a
// second to compile.
#pragma once

#include <algorithm>
#include <cstddef>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/result.hpp"
#include "protocol/control/operations.hpp"

namespace google::protobuf {
class Message;
}
namespace sonar::v1 {
class Response;
}

namespace sonar::control {

/// Start of the answer of `sonard replay` to GET /healthz, with which doctor recognises a replay; the file's name follows.
inline constexpr std::string_view health_of_replay = "ok: replays ";

/// Reads a datagram with a PoseUpdate. A malformed datagram is refused with one sentence (see checked()).
Result<PoseSample> decode_pose_datagram(BytesView datagram);
/// Reads a message of the stream, without its length prefix. If the message is not protobuf, the refusal has id 0.
tl::expected<Request, RefusedRequest> decode_request(BytesView message);
/// True if a message of the stream is a pose without an id, which gets no answer. This is much faster than decode_request(),
/// because the pose is not decoded.
bool is_unasked_pose(BytesView message);
/// Encodes a response. Replaces bytes of its texts that are not UTF-8 with '?'.
Bytes encode_response(v1::Response response);

/// Encodes the datagram of a pose, for senders, in the frame `sent_in`.
Bytes encode_pose_datagram(const PoseSample& sample);
Bytes encode_request(const Request& request);
/// Reads a response. Errors: bad_data if the bytes are not a Response, a number is NaN or infinite, the norm of an
/// orientation is not 1, or the kind of an event is unknown.
Result<std::shared_ptr<const v1::Response>> decode_response(BytesView message);

// ---- requests and messages in protobuf's JSON mapping, for HTTP and for users

/// Reads a request from JSON. `op` is the name of a member of Request.op, such as "sonar" or "set_object"; `json` is the message
/// of that member. `name`: the sonar or object of the message, if it is given elsewhere, for example in a path. Errors, in one
/// sentence: text that is not JSON, an unknown key, a wrong type, and the errors of decode_request().
Result<Request> request_from_json(std::string_view op, std::string_view json, std::string_view name = {});
/// Writes a message as one line of JSON, without the newline. Keys are the names of control.proto; zeros and empty lists are
/// written too. 64-bit numbers are strings, as protobuf's mapping requires.
std::string json_of(const google::protobuf::Message& message);
std::string json_of(StatusCode code, const std::string& text);  // {"code":"REFUSED","text":"..."}

// Framing of the control stream: a varint length, then that number of bytes. The stream may arrive in any pieces. Source:
// protobuf encoding guide, "varint"; the limit of the length is ours (control.proto).

class DelimitedParser {
 public:
  static constexpr std::size_t largest_message = 1u << 20;

  /// `most`: limit for a message [bytes], at most largest_message.
  explicit DelimitedParser(std::size_t most = largest_message) : most_(std::min(most, largest_message)) {}
  void feed(std::span<const std::byte> received) { buffer_.insert(buffer_.end(), received.begin(), received.end()); }
  /// Returns the next whole message; nullopt if more bytes are needed. After an error the rest of the stream cannot be read.
  Result<std::optional<std::vector<std::byte>>> next();

 private:
  std::size_t most_;
  std::vector<std::byte> buffer_;  // never longer than one message and one read
  std::size_t start_ = 0;          // start of the next message
};

/// Returns length and message, ready to be sent.
std::vector<std::byte> delimited(std::span<const std::byte> message);

}  // namespace sonar::control
