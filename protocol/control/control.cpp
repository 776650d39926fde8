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

Bytes encode_response(const Response& response) {
  v1::Response message;
  fill(message, response);
  return serialized(message);
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

Result<Response> decode_response(BytesView bytes) {
  v1::Response message;
  if (!parse(message, bytes)) return failure(ErrorKind::bad_data, "message is not a Response");
  return from(message);
}

}  // namespace sonar::control
