#include "protocol/ping/locate.hpp"

#include "protocol/ping/omniscan_messages.hpp"
#include "protocol/ping/ping1d_messages.hpp"
#include "protocol/ping/s500_messages.hpp"

namespace sonar::ping {
namespace {

using protocol::Field;
using protocol::FieldName;
using protocol::Region;

/// Finds a field in the header of the first frame, else in message M, whose frame begins at `offset`.
template <class M>
std::optional<Field> in_frame(FieldName name, std::size_t offset, BytesView frames) {
  const auto header = wire::locate<Header>(name, frames);
  return header ? header : wire::locate<M>(name, frames, offset + header_size);
}

bool is_of(Id id, BytesView frame) {
  Header header;
  wire::Reader reader(frame);
  fields(reader, header);
  return reader.ok() && header.id == id;
}

/// Returns the offset of the frame with that message among the frames of a ping; nullopt if there is none. If `frames` is empty,
/// only the layout is requested, and the offset is 0.
std::optional<std::size_t> frame_of(Id id, BytesView frames) {
  std::size_t at = 0;
  while (!frames.empty() && at < frames.size() && !is_of(id, frames.subspan(at))) {
    Header header;
    wire::Reader reader(frames.subspan(at));
    fields(reader, header);
    if (!reader.ok()) return std::nullopt;
    at += header_size + header.length + sum_size;
  }
  return frames.empty() || at < frames.size() ? std::optional(at) : std::nullopt;
}

/// Returns a region of a frame whose payload is fields and then samples.
std::optional<Place> one_beam(Region region, BytesView frame, std::size_t fields_size) {
  if (region == Region::bearings) return std::nullopt;
  if (frame.empty()) return Place{};
  const std::size_t data = header_size + fields_size;
  if (frame.size() < data + sum_size) return std::nullopt;
  if (region == Region::header) return Place{0, header_size};
  return region == Region::metadata ? Place{header_size, fields_size} : Place{data, frame.size() - sum_size - data};
}

/// Returns a region of the frame with that message among the frames of a ping. The payload is the fields M and then samples.
template <class M>
std::optional<Place> samples_among(Id id, Region region, BytesView frames) {
  const auto at = frame_of(id, frames);
  if (!at) return std::nullopt;
  auto place = one_beam(region, frames.empty() ? frames : frames.subspan(*at), wire::wire_size<M>());
  if (place && !frames.empty()) place->first += *at;
  return place;
}

constexpr std::size_t attitude_size = header_size + wire::wire_size<AttitudeReport>() + sum_size;

/// Returns the offset of the frame of points (3012). Over TCP the frame follows the attitude report (504); over UDP it is a
/// separate datagram, with offset 0.
std::optional<std::size_t> atof_frame(BytesView frames) {
  const std::size_t at = frames.empty() || is_of(Id::attitude_report, frames) ? attitude_size : 0;
  const bool there = frames.empty() || (frames.size() > at && is_of(Id::atof_point_data, frames.subspan(at)));
  return there ? std::optional(at) : std::nullopt;
}

}  // namespace

std::optional<Field> locate_ping360(FieldName name, BytesView frame) {
  return is_of(Id::auto_device_data, frame) ? in_frame<AutoDeviceData>(name, 0, frame) : in_frame<DeviceData>(name, 0, frame);
}

std::optional<Place> locate_ping360(Region region, BytesView frame) {
  const bool scan = is_of(Id::auto_device_data, frame);
  return one_beam(region, frame, scan ? wire::wire_size<AutoDeviceData>() : wire::wire_size<DeviceData>());
}

std::optional<Field> locate_omniscan(FieldName name, BytesView frame) { return in_frame<OsMonoProfile>(name, 0, frame); }

std::optional<Place> locate_omniscan(Region region, BytesView frame) {
  return one_beam(region, frame, wire::wire_size<OsMonoProfile>());
}

std::optional<Field> locate_ping1d(FieldName name, BytesView frames) {
  if (const auto at = frame_of(Id::ping1d_profile, frames)) return in_frame<Profile>(name, *at, frames);
  if (const auto at = frame_of(Id::ping1d_distance, frames)) return in_frame<Distance>(name, *at, frames);
  return wire::locate<Header>(name, frames);
}

std::optional<Place> locate_ping1d(Region region, BytesView frames) {
  return samples_among<Profile>(Id::ping1d_profile, region, frames);
}

std::optional<Field> locate_s500(FieldName name, BytesView frames) {
  const auto at = frame_of(Id::s500_profile6, frames);
  return at ? in_frame<Profile6>(name, *at, frames) : wire::locate<Header>(name, frames);
}

std::optional<Place> locate_s500(Region region, BytesView frames) {
  return samples_among<Profile6>(Id::s500_profile6, region, frames);
}

std::optional<Field> locate_surveyor(FieldName name, BytesView frames) {
  const auto at = atof_frame(frames);
  return at ? in_frame<AtofPointData>(name, *at, frames) : wire::locate<Header>(name, frames);
}

std::optional<Place> locate_surveyor(Region region, BytesView frames) {
  if (region == Region::bearings) return std::nullopt;  // there is no table: each point has its own bearing
  if (frames.empty()) return Place{};
  const auto at = atof_frame(frames);
  const std::size_t fields_end = at.value_or(0) + header_size + wire::wire_size<AtofPointData>();
  if (!at || frames.size() < fields_end + sum_size) return std::nullopt;
  if (region == Region::header) return Place{0, header_size};
  return region == Region::metadata ? Place{header_size, fields_end - header_size}
                                    : Place{fields_end, frames.size() - sum_size - fields_end};
}

}  // namespace sonar::ping
