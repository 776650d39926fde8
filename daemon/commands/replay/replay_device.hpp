// The sonar that a recording comes from, as its status datagram shows it: taken from the recording, with the addresses of here.
#pragma once

#include "daemon/config/config.hpp"
#include "protocol/oculus/messages.hpp"
#include "protocol/recording/recording.hpp"

namespace sonar {

struct ReplayDevice {
  oculus::StatusMessage status;
  bool recorded_status = false;  // else made up from the device id

  /// 142 bytes: drivers connect to the address in it, and take nothing from a device of another id.
  protocol::Bytes status_at(Ipv4 ip, Ipv4 mask, Ipv4 client) const;
};

/// Looks through the front of the recording and rewinds it. bad_data when there is no message of a device in it.
Result<ReplayDevice> find_replay_device(recording::RecordingReader& reader, const std::string& file, std::uint16_t part_number);

}  // namespace sonar
