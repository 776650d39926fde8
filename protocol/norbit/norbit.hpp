// NORBIT WBMS and its forward-looking version: the device, the driver, and the codec for recordings.
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "protocol/host.hpp"
#include "protocol/norbit/messages.hpp"
#include "protocol/recorded/message_splitter.hpp"
#include "protocol/vendor.hpp"

namespace sonar::norbit {

const protocol::Vendor& vendor();
/// Makes the dialogue at a port. The command port reads lines of text, the others ignore all bytes. `device` must outlive it.
std::unique_ptr<protocol::Dialogue> make_dialogue(const protocol::Port& port, const protocol::DeviceState& device, Time now);

inline constexpr protocol::HostPort host_ports[]{{protocol::HostPort::Kind::tcp, bathymetry_port},
                                                 {protocol::HostPort::Kind::tcp, column_port},
                                                 {protocol::HostPort::Kind::tcp, command_port}};

/// Assumed: samples are amplitudes, which the maker's program shows in decibels. A square root looks similar and needs no lower
/// limit.
inline constexpr Shades shades{.gamma = 0.5f};

Result<std::unique_ptr<protocol::Host>> make_host(const protocol::Wanted& wanted);
recording::Codec codec();

// Converts a ping to packets, and splits packets into their parts.

/// Finds the boundaries of packets in a stream.
extern const recording::Framing framing;

Bytes encode_bathymetry(const Ping& ping, const protocol::DeviceState& device);
Bytes encode_column(const Ping& ping, const protocol::DeviceState& device);

struct Bathymetry {
  BathymetryFront front;
  std::vector<Beam> beams;
  double range_m(const Beam& beam) const;
};
struct Column {
  ColumnFront front;
  BytesView pixels, directions;  // pixels: row by row, near first; each row in the order of the directions
  double sample_m() const;
};
/// Returns nullopt if `packet` is not a whole packet of this type, or if its checksum is wrong.
std::optional<Bathymetry> read_bathymetry(BytesView packet);
/// Returns nullopt like read_bathymetry(), and if the pixels do not have 16 bits or there are more than 1024 beams.
std::optional<Column> read_column(BytesView packet);

/// Corrects the checksums of the packets whose bytes differ from those in `before`.
void reseal(BytesView before, Bytes& packets);

std::optional<protocol::Field> locate(protocol::FieldName name, BytesView packets);
std::optional<std::pair<std::size_t, std::size_t>> locate(protocol::Region region, BytesView packets);

}  // namespace sonar::norbit
