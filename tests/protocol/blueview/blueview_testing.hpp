// The side of a host, for tests: requests as bytes, decoded replies, and a device that answers the requests.
#pragma once

#include <string>
#include <vector>

#include "protocol/blueview/blueview.hpp"
#include "protocol/blueview/frames.hpp"
#include "protocol/blueview/head_settings.hpp"
#include "protocol/blueview/models.hpp"

namespace sonar::blueview::test {

inline Time at_s(double s) { return Time{} + nanoseconds_from(1.7e9 + s); }

inline protocol::DeviceState device(const std::string& profile = "blueview-p900-90", protocol::OptionValues options = {}) {
  protocol::DeviceState d;
  d.name = "front";
  d.id = 7001;
  d.model = protocol::find_profile(profile)->model;
  d.water = {12, 30, 8.0, 0};
  d.options = *protocol::check_options(vendor(), options);
  d.settings = vendor().initial_settings(d).vendor_settings;
  return d;
}

inline wire::Bytes request(FrameType type, std::uint32_t id, const wire::Bytes& payload = {}) {
  return make_frame(type, id, payload);
}

inline wire::Bytes hello(std::uint16_t version = 1) {
  wire::Bytes p;
  const Put put(p);
  put("proto", version);
  put("abi", std::uint16_t{4});
  put_text(p, "test");
  return request(FrameType::hello, 1, p);
}
inline wire::Bytes set(std::uint32_t id, std::int32_t head, Key key, const Value& value) {
  wire::Bytes p;
  const Put put(p);
  put("head", head);
  put("key", key);
  put_value(p, value);
  return request(FrameType::set, id, p);
}
inline wire::Bytes get(std::uint32_t id, std::int32_t head, Key key) {
  wire::Bytes p;
  const Put put(p);
  put("head", head);
  put("key", key);
  return request(FrameType::get, id, p);
}
inline wire::Bytes two_numbers(FrameType type, std::uint32_t id, std::int32_t head, std::uint32_t number) {
  wire::Bytes p;
  const Put put(p);
  put("head", head);
  put("number", number);
  return request(type, id, p);
}
inline wire::Bytes ping(std::uint32_t id, std::int32_t head = 0, std::uint32_t timeout_ms = 1000) {
  return two_numbers(FrameType::ping, id, head, timeout_ms);
}

struct Reply {
  FrameHeader header;
  wire::Bytes payload;
};
inline Reply reply_from(const wire::Bytes& bytes) {
  Reply reply;
  wire::Reader reader(bytes);
  fields(reader, reply.header);
  const auto rest = reader.block("payload", reader.remaining());
  reply.payload.assign(rest.begin(), rest.end());
  return reply;
}
inline std::int32_t error_code_of(const Reply& reply) {
  std::int32_t code = 0;
  wire::Reader reader(reply.payload);
  reader("code", code);
  return reply.header.type == FrameType::error ? code : 0;
}

}  // namespace sonar::blueview::test
