#include "protocol/control/control.hpp"

#include "protocol/control/messages.hpp"

namespace sonar::control {

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

Result<std::shared_ptr<const v1::Response>> decode_response(BytesView bytes) {
  auto message = std::make_shared<v1::Response>();
  if (!parse(*message, bytes)) return failure(ErrorKind::bad_data, "message is not a Response");
  if (const auto where = first_unreal_number(*message)) return failure(ErrorKind::bad_data, *where + " is NaN or infinite");
  if (const auto where = first_bad_orientation(*message))
    return failure(ErrorKind::bad_data, *where + " is not a quaternion of norm 1");
  if (message->has_event() && message->event().what_case() == v1::Event::WHAT_NOT_SET)
    return failure(ErrorKind::bad_data, "an event of an unknown kind");
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

}  // namespace sonar::control
