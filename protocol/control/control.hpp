// Bytes and JSON of the control protocol. Requests are plain structs: the daemon decodes them; tools and tests encode them.
// Answers and events are protobuf's classes (protocol/control/answers.hpp), which this header only names: they take a second to
// compile.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "core/base/result.hpp"
#include "protocol/control/request.hpp"

namespace google::protobuf {
class Message;
}
namespace sonar::v1 {
class Response;
}

namespace sonar::control {

/// How the answer of `sonard replay` to GET /healthz begins; the name of the file follows. Doctor recognises a replay by it.
inline constexpr std::string_view health_of_replay = "ok: replays ";

/// Reads a datagram with a PoseUpdate. A malformed one is refused with one sentence (see checked()).
Result<PoseSample> decode_pose_datagram(BytesView datagram);
/// Reads a message of the stream, without its length. The refusal of a message that is not protobuf has id 0.
tl::expected<Request, RefusedRequest> decode_request(BytesView message);
/// Whether a message of the stream is a pose without an id, which gets no answer. It does not decode the pose, so it takes much
/// less time than decode_request().
bool is_unasked_pose(BytesView message);
/// The bytes of a response. Bytes of its texts that are not UTF-8 become '?'.
Bytes encode_response(v1::Response response);

/// The datagram of a pose, for senders. The pose is sent in the frame `sent_in`.
Bytes encode_pose_datagram(const PoseSample& sample);
Bytes encode_request(const Request& request);
/// Reads a response. bad_data: the bytes are not a Response, a number is NaN or infinite, an orientation has another norm than 1,
/// or an event is of an unknown kind.
Result<std::shared_ptr<const v1::Response>> decode_response(BytesView message);

// ---- requests and messages in protobuf's JSON mapping, for HTTP and for users

/// Reads a request from JSON. `op` is the name of a member of Request.op ("sonar", "set_object"), `json` its message. `name`: the
/// sonar or object that the message is about, if it is given elsewhere, as in a path. Text that is not JSON, an unknown key, a
/// wrong type, and whatever decode_request() refuses are refused with one sentence.
Result<Request> request_from_json(std::string_view op, std::string_view json, std::string_view name = {});
/// A message as one line of JSON, without its newline. Names are those of control.proto; numbers that are 0 and empty lists are
/// written too. 64-bit numbers are strings, as protobuf's mapping demands.
std::string json_of(const google::protobuf::Message& message);
std::string json_of(StatusCode code, const std::string& text);  // {"code":"REFUSED","text":"..."}

}  // namespace sonar::control
