// Writes a session as an MCAP file: the vendor's messages, a picture of each ping, and poses and ground truth if they are
// known. The vendor's messages can be replayed; the rest is for viewers.
#pragma once

#include <memory>

#include "protocol/host.hpp"
#include "protocol/recorded/recorded_message.hpp"
#include "protocol/recording/mcap/mcap_json.hpp"
#include "protocol/recording/mcap/mcap_reader.hpp"
#include "protocol/recording/mcap/mcap_writer.hpp"

namespace sonar::recording {

/// Topics: /NAME/device (TCP), /NAME/client (either) and /NAME/status (UDP), opaque; /NAME/image, /NAME/pose, /tf, /NAME/labels,
/// /NAME/share and /NAME/caster in the live view's protobuf (protocol/foxglove/foxglove_messages.hpp); /NAME/truth,
/// /NAME/instances and /faults in JSON.
class McapSession final : public RecordingWriter {
 public:
  /// `make`: the make whose messages are written. Messages that hold samples (Codec::samples) are also written as images.
  /// `profile`: profile of the sonar, for messages that do not state their model; empty: unknown.
  McapSession(std::unique_ptr<Sink> sink, std::string sonar, const protocol::Make& make = protocol::makes().front(),
              std::string profile = {});

  Result<void> write(const RecordedMessage& message) override;
  /// Writes the pose of the sonar at time `of`, also as the frame NAME of /tf. `at` must not decrease (see RecordingWriter).
  Result<void> write_pose(Time at, Time of, const Pose& sonar_in_world);
  /// Writes the image of a ping whose messages hold no samples.
  Result<void> write_image(Time at, const std::shared_ptr<const Ping>& ping);
  Result<void> write_image(Time at, const Samples& samples);
  /// Writes the ground truth; moving bodies also as the frames object/NAME of /tf.
  Result<void> write_truth(Time at, const mcap::PingTruth& truth);
  /// Writes the labels of the samples as pictures, and the instances in the labels.
  Result<void> write_labels(Time at, const mcap::PingTruth& truth, const PingLabels& labels);
  /// Writes a fault; `json`: a FaultEntry of control.proto.
  Result<void> write_fault(Time at, const std::string& json) { return write_json(faults_, at, json); }
  Result<void> close() override { return writer_.close(); }

 private:
  std::uint16_t vendor_channel(const char* topic, const char* from, const char* carrier);
  std::uint16_t protobuf_channel(const std::string& topic, const std::string& message);
  std::uint16_t json_channel(const std::string& topic, const mcap::JsonSchema& schema);
  Result<void> write_json(std::uint16_t channel, Time at, const std::string& text);

  mcap::Writer writer_;
  std::string sonar_, profile_;
  const protocol::Make* make_;
  std::uint16_t device_, client_, status_, image_, pose_, tf_, truth_, labels_, share_, caster_, instances_, faults_;
};

/// Reads the vendor's messages of the named sonar; without a name, of the first sonar. Errors: bad_data if the source is not an
/// MCAP file.
Result<std::unique_ptr<RecordingReader>> read_mcap(std::unique_ptr<Source> source, std::string sonar = {});

}  // namespace sonar::recording
