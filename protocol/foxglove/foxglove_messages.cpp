#include "protocol/foxglove/foxglove_messages.hpp"

#include <set>

#include <google/protobuf/descriptor.h>
#include <google/protobuf/descriptor.pb.h>
#include <google/protobuf/message.h>

#include "control.pb.h"
#include "core/base/base64.hpp"
#include "foxglove.pb.h"
#include "view.pb.h"

namespace sonar::foxglove {
namespace {

namespace pb = ::google::protobuf;
namespace fg = ::foxglove;

Bytes bytes_of(const pb::MessageLite& message) {
  Bytes bytes(message.ByteSizeLong());
  message.SerializeToArray(bytes.data(), static_cast<int>(bytes.size()));
  return bytes;
}

void fill(pb::Timestamp& out, Time at) {
  const auto since = at.time_since_epoch();
  const auto whole = std::chrono::floor<std::chrono::seconds>(since);
  out.set_seconds(whole.count());
  out.set_nanos(static_cast<std::int32_t>((since - whole).count()));
}
void fill(auto& out, Vec3d v) {
  out.set_x(v.x);
  out.set_y(v.y);
  out.set_z(v.z);
}
void fill(fg::Quaternion& out, Quatd q) {
  out.set_x(q.x);
  out.set_y(q.y);
  out.set_z(q.z);
  out.set_w(q.w);
}
void fill(fg::Pose& out, const Pose& pose) {
  fill(*out.mutable_position(), pose.position_m);
  fill(*out.mutable_orientation(), pose.orientation);
}

/// Adds a file after the files that it imports, each file once, because readers need this order.
void add_with_imports(const pb::FileDescriptor& file, std::set<std::string>& known, pb::FileDescriptorSet& out) {
  if (!known.insert(file.name()).second) return;
  for (int i = 0; i < file.dependency_count(); ++i) add_with_imports(*file.dependency(i), known, out);
  file.CopyTo(out.add_file());
}

fg::SceneEntity& entity(fg::SceneUpdate& update, Time at, const std::string& id, const std::string& frame) {
  fg::SceneEntity& entity = *update.add_entities();
  fill(*entity.mutable_timestamp(), at);
  entity.set_id(id);
  entity.set_frame_id(frame);
  entity.set_frame_locked(true);
  return entity;
}

using Stamp = std::function<Time(Time)>;

/// Changes all times in a message and its sub-messages: google.protobuf.Timestamp, and our own fields whose names end in _ns.
void change_stamps(pb::Message& message, const Stamp& stamp) {
  if (auto* const at = dynamic_cast<pb::Timestamp*>(&message)) {
    const Time was{std::chrono::seconds(at->seconds()) + std::chrono::nanoseconds(at->nanos())};
    return fill(*at, stamp(was));
  }
  const pb::Reflection& fields = *message.GetReflection();
  std::vector<const pb::FieldDescriptor*> set;
  fields.ListFields(message, &set);
  for (const pb::FieldDescriptor* field : set) {
    const bool is_message = field->cpp_type() == pb::FieldDescriptor::CPPTYPE_MESSAGE && !field->is_map();
    if (is_message && field->is_repeated())
      for (int i = 0; i < fields.FieldSize(message, field); ++i)
        change_stamps(*fields.MutableRepeatedMessage(&message, field, i), stamp);
    else if (is_message)
      change_stamps(*fields.MutableMessage(&message, field), stamp);
    else if (field->type() == pb::FieldDescriptor::TYPE_SFIXED64 && field->name().ends_with("_ns"))
      fields.SetInt64(&message, field,
                      stamp(Time(std::chrono::nanoseconds(fields.GetInt64(message, field)))).time_since_epoch().count());
  }
}

}  // namespace

// Recorded messages are replayed with the times of the playback, so all their stamps change.
Bytes with_stamps(const Channel& of, BytesView message, const Stamp& stamp) {
  const auto* const type = pb::DescriptorPool::generated_pool()->FindMessageTypeByName(of.schema.name);
  if (of.encoding == "cdr") return with_stamp(message, stamp);
  const std::unique_ptr<pb::Message> read(pb::MessageFactory::generated_factory()->GetPrototype(type)->New());
  read->ParseFromArray(message.data(), static_cast<int>(message.size()));
  change_stamps(*read, stamp);
  return bytes_of(*read);
}

Bytes descriptor_set(const std::string& name) {
  // These messages are looked up only by name, so the calls prevent the linker from dropping their files.
  fg::RawImage::descriptor();
  v1::PingGeometry::descriptor();
  v1::Picture::descriptor();
  v1::DaemonStatus::descriptor();
  const pb::Descriptor* const message = pb::DescriptorPool::generated_pool()->FindMessageTypeByName(name);
  if (message == nullptr) return {};
  pb::FileDescriptorSet set;
  std::set<std::string> known;
  add_with_imports(*message->file(), known, set);
  return bytes_of(set);
}

Schema protobuf_schema(const std::string& name) { return {name, "protobuf", base64(descriptor_set(name))}; }

// Viewers show no integers of more than 16 bits, so these are converted to floats from 0 to 1.
Image image_of(std::size_t beams, std::size_t rows, int bits, std::uint32_t max_code, std::shared_ptr<const Bytes> codes) {
  const auto width = static_cast<std::size_t>(bits / 8);
  Image image{static_cast<std::uint32_t>(beams), static_cast<std::uint32_t>(rows), width == 1 ? "mono8" : "mono16", width,
              std::move(codes)};
  if (width <= 2) return image;
  const auto parts = std::make_shared<Bytes>();
  parts->reserve(image.samples->size() / width * sizeof(float));
  wire::Writer writer(*parts);
  for (std::size_t i = 0; i < image.samples->size() / width; ++i) {
    const auto part = static_cast<float>(static_cast<double>(sample_code(*image.samples, i, width)) / max_code);
    writer("sample", part);
  }
  image.encoding = "32FC1";
  image.bytes_per_sample = sizeof(float);
  image.samples = parts;
  return image;
}

Image image_of(const std::shared_ptr<const Ping>& ping) {
  const PingSettings& s = ping->request.settings;
  return image_of(static_cast<std::size_t>(s.beam_count), static_cast<std::size_t>(s.range_bin_count), s.format.bits,
                  s.format.max_code, std::shared_ptr<const Bytes>(ping, &ping->samples));
}

Bytes image_head(Time at, const std::string& frame, const Image& image) {
  fg::RawImage message;
  fill(*message.mutable_timestamp(), at);
  message.set_frame_id(frame);
  message.set_width(image.width);
  message.set_height(image.height);
  message.set_encoding(image.encoding);
  message.set_step(static_cast<std::uint32_t>(image.width * image.bytes_per_sample));
  // The samples, field `data`, are written last. The head ends with the key and length of this field, so that the samples need
  // not be copied.
  Bytes head = bytes_of(message);
  constexpr unsigned length_delimited = 2;
  head.push_back(static_cast<std::byte>(fg::RawImage::kDataFieldNumber << 3 | length_delimited));
  std::size_t left = image.samples->size();
  for (; left >= 0x80; left >>= 7) head.push_back(static_cast<std::byte>(0x80 | (left & 0x7F)));
  head.push_back(static_cast<std::byte>(left));
  return head;
}

Bytes raw_image(Time at, const std::string& frame, const Image& image) {
  Bytes whole = image_head(at, frame, image);
  whole.insert(whole.end(), image.samples->begin(), image.samples->end());
  return whole;
}

Bytes transforms(std::span<const Transform> all) {
  fg::FrameTransforms message;
  for (const Transform& t : all) {
    fg::FrameTransform& out = *message.add_transforms();
    fill(*out.mutable_timestamp(), t.at);
    out.set_parent_frame_id(t.parent);
    out.set_child_frame_id(t.child);
    fill(*out.mutable_translation(), t.child_in_parent.position_m);
    fill(*out.mutable_rotation(), t.child_in_parent.orientation);
  }
  return bytes_of(message);
}

Bytes pose_in_frame(Time at, const std::string& frame, const Pose& pose) {
  fg::PoseInFrame message;
  fill(*message.mutable_timestamp(), at);
  message.set_frame_id(frame);
  fill(*message.mutable_pose(), pose);
  return bytes_of(message);
}

Bytes scene_update(Time at, const Model& model) {
  fg::SceneUpdate update;
  fg::SceneEntity& out = entity(update, at, model.id, model.frame);
  for (const auto& [key, value] : model.metadata) {
    fg::KeyValuePair& pair = *out.add_metadata();
    pair.set_key(key);
    pair.set_value(value);
  }
  fg::ModelPrimitive& shape = *out.add_models();
  fill(*shape.mutable_pose(), model.in_frame);
  fill(*shape.mutable_scale(), Vec3d{1, 1, 1});
  shape.set_media_type("model/gltf-binary");
  shape.set_data(model.glb.data(), model.glb.size());
  return bytes_of(update);
}

Bytes scene_update(Time at, const Lines& lines) {
  fg::SceneUpdate update;
  fg::LinePrimitive& out = *entity(update, at, lines.id, lines.frame).add_lines();
  out.set_type(fg::LinePrimitive::LINE_LIST);
  fill(*out.mutable_pose(), Pose{});
  out.set_thickness(1);
  out.set_scale_invariant(true);
  for (const Vec3d& point : lines.points) fill(*out.add_points(), point);
  fg::Color& colour = *out.mutable_color();
  colour.set_r(1);
  colour.set_g(0.75);
  colour.set_b(0.25);
  colour.set_a(0.6);
  return bytes_of(update);
}

Bytes scene_deletion(Time at, const std::string& id) {
  fg::SceneUpdate update;
  fg::SceneEntityDeletion& deletion = *update.add_deletions();
  fill(*deletion.mutable_timestamp(), at);
  deletion.set_id(id);
  return bytes_of(update);
}

Bytes log_line(Time at, Severity severity, const std::string& message, const std::string& name) {
  fg::Log line;
  fill(*line.mutable_timestamp(), at);
  line.set_level(static_cast<fg::Log::Level>(severity));
  line.set_message(message);
  line.set_name(name);
  return bytes_of(line);
}

// A point has 16 bytes: three floats, and the intensity with three bytes of padding.
Bytes cloud(Time at, const std::string& frame, std::span<const CloudPoint> points) {
  constexpr std::uint32_t stride = 16;
  fg::PointCloud message;
  fill(*message.mutable_timestamp(), at);
  message.set_frame_id(frame);
  fill(*message.mutable_pose(), Pose{});
  message.set_point_stride(stride);
  for (const auto& [name, offset, type] :
       {std::tuple("x", 0u, fg::PackedElementField::FLOAT32), std::tuple("y", 4u, fg::PackedElementField::FLOAT32),
        std::tuple("z", 8u, fg::PackedElementField::FLOAT32), std::tuple("intensity", 12u, fg::PackedElementField::UINT8)}) {
    fg::PackedElementField& field = *message.add_fields();
    field.set_name(name);
    field.set_offset(offset);
    field.set_type(type);
  }
  Bytes data;
  data.reserve(points.size() * stride);
  wire::Writer writer(data);
  for (const CloudPoint& p : points) {
    writer("x", p.x);
    writer("y", p.y);
    writer("z", p.z);
    const std::uint32_t intensity_and_padding = p.intensity;
    writer("intensity", intensity_and_padding);
  }
  message.set_data(data.data(), data.size());
  return bytes_of(message);
}

// Viewers get a geometry only when it changes. With `number` = 0 the geometries of two pings can be compared.
Bytes geometry(const Ping& ping, std::uint32_t number) {
  const PingSettings& s = ping.request.settings;
  v1::PingGeometry message;
  message.set_number(number);
  message.set_row_spacing_m(s.range_bin_m);
  message.set_range_start_m(s.range_start_m);
  message.set_full_scale(s.format.max_code);
  message.mutable_azimuth_rad()->Add(ping.beam_azimuth_rad.begin(), ping.beam_azimuth_rad.end());
  message.mutable_row_gain()->Add(ping.row_gain.begin(), ping.row_gain.end());
  return bytes_of(message);
}

Bytes truth(const Ping& ping) {
  const PingSettings& s = ping.request.settings;
  v1::PingTruth message;
  fill(*message.mutable_timestamp(), ping.request.fired_at);
  message.set_number(static_cast<std::uint32_t>(ping.request.number));
  message.mutable_azimuth_rad()->Add(ping.beam_azimuth_rad.begin(), ping.beam_azimuth_rad.end());
  for (const BeamTruth& beam : ping.truth) message.add_range_m(beam.object == BeamTruth::nothing ? 0.0f : beam.range_m);
  message.set_range_start_m(s.range_start_m);
  message.set_range_end_m(s.range_m);
  return bytes_of(message);
}

Bytes picture(const SonarPicture& picture, std::span<const TimeMark> times) {
  v1::Picture message;
  message.set_kind(std::string(name_of(picture.kind)));
  message.set_range_start_m(picture.image.start_m);
  message.set_range_m(picture.range_m());
  if (!picture.image.azimuth_rad.empty()) {
    message.set_port_rad(picture.image.azimuth_rad.front());
    message.set_starboard_rad(picture.image.azimuth_rad.back());
  }
  message.set_head_rad(picture.head_rad);
  message.set_elevation_rad(picture.elevation_rad);
  constexpr std::array<const char*, 3> columns = {"none", "sent", "model"};
  if (picture.kind == PictureKind::points) message.set_column(columns[static_cast<std::size_t>(picture.column)]);
  message.set_nothing_detected(picture.nothing_detected());
  message.set_gamma(static_cast<double>(picture.image.shades.gamma));
  message.set_per_mille(static_cast<std::uint32_t>(picture.image.shades.per_mille));
  for (const auto& [part, age_s] : times) {
    v1::TimeMark& mark = *message.add_time_marks();
    mark.set_part(part);
    mark.set_age_s(age_s);
  }
  return bytes_of(message);
}

Bytes findings(std::span<const doctor::Finding> all) {
  v1::Findings message;
  for (const doctor::Finding& finding : all) {
    v1::Finding& out = *message.add_findings();
    out.set_level(static_cast<v1::Finding::Level>(finding.level));
    out.set_check(finding.check);
    out.set_text(finding.text);
    out.set_cure(finding.cure);
    out.set_sonar(finding.sonar);
    out.set_client(finding.client);
  }
  return bytes_of(message);
}

Schema figures_schema() {
  std::string text;
  for (const std::string_view name : figure_names) text.append("float64 ").append(name).append("\n");
  return {"sonard_msgs/msg/SonarFigures", "ros2msg", text};
}

wire::Bytes figures(const std::array<double, figure_names.size()>& values) {
  wire::Bytes out{std::byte{0}, std::byte{1}, std::byte{0}, std::byte{0}};  // plain CDR, little-endian
  wire::Writer writer(out);
  for (const double value : values) writer("figure", value);
  return out;
}

wire::Bytes with_stamp(wire::BytesView figures, const std::function<Time(Time)>& stamp) {
  constexpr std::size_t at = 4;  // offset of the first field, stamp_s, after the head of CDR
  wire::Reader reader(figures.subspan(at));
  double stamp_s = 0;
  reader("stamp_s", stamp_s);
  stamp_s = seconds(stamp(Time(nanoseconds_from(stamp_s))).time_since_epoch());
  wire::Bytes out(figures.begin(), figures.begin() + at);
  wire::Writer writer(out);
  writer("stamp_s", stamp_s);
  out.insert(out.end(), figures.begin() + at + sizeof stamp_s, figures.end());
  return out;
}

}  // namespace sonar::foxglove
