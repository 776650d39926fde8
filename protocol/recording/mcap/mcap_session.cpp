#include "protocol/recording/mcap/mcap_session.hpp"

#include <algorithm>
#include <set>

#include "core/text/format.hpp"
#include "protocol/foxglove/foxglove_messages.hpp"
#include "protocol/recorded/message_splitter.hpp"
#include "protocol/sender.hpp"

namespace sonar::recording {
namespace {

constexpr std::size_t most_names = 16;
constexpr const char* world = "world";  // name of the frame of poses

Bytes bytes_of(const std::string& text) {
  Bytes bytes(text.size());
  std::transform(text.begin(), text.end(), bytes.begin(), [](char c) { return static_cast<std::byte>(c); });
  return bytes;
}

/// Reads the channels with the vendor's bytes, whose encoding is the name of a make. Their metadata state the sonar, the sender
/// and the carrier of a message.
class McapRecordingReader final : public RecordingReader {
 public:
  McapRecordingReader(mcap::Reader reader, std::string sonar)
      : reader_(std::move(reader)), requested_(std::move(sonar)), sonar_(requested_) {}

  std::optional<RecordedMessage> next() override {
    while (auto message = reader_.next()) {
      const mcap::Channel& channel = reader_.channels().at(message->channel);
      const protocol::Make* const make = protocol::find_make(channel.message_encoding);
      if (make == nullptr) continue;
      const auto metadata = [&channel](const char* key) {
        const auto found = channel.metadata.find(key);
        return found == channel.metadata.end() ? std::string() : found->second;
      };
      const std::string sonar = metadata("sonar");
      if (!chosen_ && requested_.empty()) sonar_ = sonar;
      chosen_ = true;
      if (sonar != sonar_) {
        if (others_.size() < most_names) others_.insert(sonar);
        continue;
      }
      if (profile_.empty()) profile_ = metadata("profile");
      RecordedMessage found{message->logged_at, metadata("from") == "client" ? Origin::client : Origin::device,
                            metadata("carrier") == "udp" ? Carrier::datagram : Carrier::stream, std::move(message->data)};
      if (found.from == Origin::device && found.by == Carrier::stream) find_junk(*make, found.bytes, message->at);
      return found;
    }
    if (junk_) junk_->end(reader_.damages());
    return std::nullopt;
  }
  std::optional<Error> damage() const override { return reader_.damage(); }
  std::string note() const override {
    const std::string names = text::joined(others_);
    return names.empty() ? "" : "the file holds other sonars too: " + names;
  }
  void rewind() override {
    reader_.rewind();
    junk_.reset();
  }
  std::string profile() const override { return profile_; }

 private:
  void find_junk(const protocol::Make& make, BytesView bytes, std::uint64_t at) {
    if (!junk_) junk_.emplace(common_framing(make));
    junk_->take(
        bytes, [at] { return "the record at byte " + std::to_string(at); }, reader_.damages());
  }

  mcap::Reader reader_;
  std::string requested_, sonar_, profile_;
  bool chosen_ = false;
  std::optional<JunkReport> junk_;  // uses the framing of the first message's make
  std::set<std::string> others_;
};

}  // namespace

// All channels are defined here, but a channel is written into the file only with its first message.
McapSession::McapSession(std::unique_ptr<Sink> sink, std::string sonar, const protocol::Make& make, std::string profile)
    : writer_(std::move(sink)), sonar_(std::move(sonar)), profile_(std::move(profile)), make_(&make) {
  device_ = vendor_channel("device", "device", "tcp");
  client_ = vendor_channel("client", "client", make.is_by_udp() ? "udp" : "tcp");
  status_ = vendor_channel("status", "device", "udp");
  image_ = protobuf_channel("/" + sonar_ + "/image", "foxglove.RawImage");
  pose_ = protobuf_channel("/" + sonar_ + "/pose", "foxglove.PoseInFrame");
  tf_ = protobuf_channel("/tf", "foxglove.FrameTransforms");
  truth_ = json_channel("/" + sonar_ + "/truth", mcap::truth_schema());
  labels_ = protobuf_channel("/" + sonar_ + "/labels", "foxglove.RawImage");
  share_ = protobuf_channel("/" + sonar_ + "/share", "foxglove.RawImage");
  caster_ = protobuf_channel("/" + sonar_ + "/caster", "foxglove.RawImage");
  instances_ = json_channel("/" + sonar_ + "/instances", mcap::label_schema());
  faults_ = json_channel("/faults", mcap::fault_schema());
}

std::uint16_t McapSession::vendor_channel(const char* topic, const char* from, const char* carrier) {
  mcap::Channel channel;
  channel.topic = std::string("/") + sonar_ + "/" + topic;
  channel.message_encoding = make_->name();
  channel.metadata = {{"vendor", channel.message_encoding}, {"sonar", sonar_}, {"from", from}, {"carrier", carrier}};
  if (!profile_.empty()) channel.metadata["profile"] = profile_;
  return writer_.add_channel(std::move(channel));
}

std::uint16_t McapSession::protobuf_channel(const std::string& topic, const std::string& message) {
  mcap::Channel channel;
  channel.schema = writer_.add_schema(message, "protobuf", foxglove::descriptor_set(message));
  channel.topic = topic;
  channel.message_encoding = "protobuf";
  return writer_.add_channel(std::move(channel));
}

std::uint16_t McapSession::json_channel(const std::string& topic, const mcap::JsonSchema& schema) {
  mcap::Channel channel;
  channel.schema = writer_.add_schema(schema.name, "jsonschema", bytes_of(schema.text));
  channel.topic = topic;
  channel.message_encoding = "json";
  return writer_.add_channel(std::move(channel));
}

Result<void> McapSession::write(const RecordedMessage& message) {
  const std::uint16_t channel = message.from == Origin::client ? client_ : message.by == Carrier::datagram ? status_ : device_;
  if (Result<void> written = writer_.write(channel, message.at, message.bytes); !written) return written;
  if (channel != device_ || make_->codec.samples == nullptr) return {};
  const auto samples = make_->codec.samples(message.bytes);
  return samples ? write_image(message.at, *samples) : Result<void>{};
}

Result<void> McapSession::write_pose(Time at, Time of, const Pose& sonar_in_world) {
  const foxglove::Transform frame{of, world, sonar_, sonar_in_world};
  if (Result<void> put = writer_.write(pose_, at, foxglove::pose_in_frame(of, world, sonar_in_world)); !put) return put;
  return writer_.write(tf_, at, foxglove::transforms({&frame, 1}));
}

Result<void> McapSession::write_image(Time at, const std::shared_ptr<const Ping>& ping) {
  return writer_.write(image_, at, foxglove::raw_image(at, sonar_, foxglove::image_of(ping)));
}

/// Writes an image. Messages do not state their full scale, so it is the largest code of their bits.
Result<void> McapSession::write_image(Time at, const Samples& samples) {
  const auto image =
      foxglove::image_of(samples.beams, samples.rows, samples.bits, 0xFFFFFFFFu >> (32 - samples.bits), samples.codes);
  return writer_.write(image_, at, foxglove::raw_image(at, sonar_, image));
}

Result<void> McapSession::write_truth(Time at, const mcap::PingTruth& truth) {
  std::vector<foxglove::Transform> bodies;
  for (std::size_t i = 0; truth.names != nullptr && i < std::min(truth.names->bodies.size(), truth.bodies_in_world.size()); ++i)
    bodies.push_back({truth.fired_at, world, "object/" + truth.names->bodies[i], truth.bodies_in_world[i]});
  if (!bodies.empty())
    if (Result<void> put = writer_.write(tf_, at, foxglove::transforms(bodies)); !put) return put;
  return write_json(truth_, at, mcap::truth_json(truth));
}

// Labels are images with the rows and beams of the ping, so that viewers can lay them over its image.
Result<void> McapSession::write_labels(Time at, const mcap::PingTruth& truth, const PingLabels& labels) {
  const auto put = [&](std::uint16_t channel, const auto& values) {
    const BytesView bytes = std::as_bytes(std::span(values));
    const foxglove::Image image =
        foxglove::image_of(static_cast<std::size_t>(labels.beams), static_cast<std::size_t>(labels.rows),
                           static_cast<int>(8 * sizeof values[0]), 0, std::make_shared<Bytes>(bytes.begin(), bytes.end()));
    return writer_.write(channel, at, foxglove::raw_image(at, sonar_, image));
  };
  if (Result<void> done = put(labels_, labels.instance); !done) return done;
  if (Result<void> done = put(share_, labels.share); !done) return done;
  if (Result<void> done = put(caster_, labels.caster); !done) return done;
  return write_json(instances_, at, mcap::instances_json(truth, labels));
}

Result<void> McapSession::write_json(std::uint16_t channel, Time at, const std::string& text) {
  return writer_.write(channel, at, bytes_of(text));
}

Result<std::unique_ptr<RecordingReader>> read_mcap(std::unique_ptr<Source> source, std::string sonar) {
  auto reader = mcap::Reader::open(std::move(source));
  if (!reader) return tl::unexpected(reader.error());
  return std::make_unique<McapRecordingReader>(std::move(*reader), std::move(sonar));
}

}  // namespace sonar::recording
