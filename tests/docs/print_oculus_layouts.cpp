// Prints the layouts of all Oculus messages as a Markdown page: `ninja -C build/release docs` writes it into the build folder.
#include <iostream>

#include "protocol/oculus/messages.hpp"
#include "tests/docs/layout_table.hpp"

namespace {

using namespace sonar;
using namespace sonar::oculus;
using docs::layout_table;

const docs::Meanings header{
    {"oculusId", "0x4F53: bytes `53 4F`"},
    {"srcDeviceId", "device: its id, the same in status and stream (ENS and BLU drop others); client: 0"},
    {"dstDeviceId", "device: 0 (CAP); client: 0 or the device's id (ENS), ignored"},
    {"msgId", "type of the message"},
    {"msgVersion", "fire message: 0, 1 or 2; ping: that of its fire message; else 0"},
    {"payloadSize", "bytes after the header; often 0 from clients"},
    {"partNumber", "status: the product (read by BAS); else 0"},
};
const docs::Meanings fire{
    {"masterMode", "1 low frequency, 2 high; others count as 1"},
    {"pingRate", "maximum: 0 = 10 Hz, 1 = 15, 2 = 40, 3 = 5, 4 = 2, 5 = standby; others count as 10 Hz"},
    {"networkSpeed", "Mbit/s, 0 and 255 no limit; option `honour_network_speed`"},
    {"gammaCorrection", "exponent of the samples = value / 255; 0 means 1"},
    {"flags", "bits: see the page"},
    {"range", "metres (flag bit 0) or per cent of the mode's maximum"},
    {"gainPercent", "0.96 dB per effective per cent"},
    {"speedOfSound", "m/s; 0: computed from temperature, pressure and requested salinity (UNESCO)"},
    {"salinity", "0 to 40 ppt; versions 0 and 1 end here"},
    {"extFlags", "bits: see the page"},
    {"reserved0", "echoed"},
    {"beaconLocatorFrequency", "echoed"},
    {"reserved1", "echoed; version 2 ends here"},
};
const docs::Meanings status{
    {"deviceId", "serial number, not 0"},
    {"deviceType", "1 imaging sonar"},
    {"partNumber", "the product (`protocol/oculus/models.cpp`); every driver knows 1032, 1041 and 1042"},
    {"status",
     "bits 0-2: 0, 1 boot loader, 2 main firmware starts, 3 runs; 3-5: reason for a pause; 7: \"main\" connection (option "
     "`status_bit7`); 14 over-temperature warning; 15 shutdown; 16 transmitter failure"},
    {"firmwareVersion0", "major 8 bits, minor 8, build 16"},
    {"firmwareDate0", "0"},
    {"firmwareVersion1", "as firmwareVersion0"},
    {"firmwareDate1", "0"},
    {"bitfileVersion", "as firmwareVersion0"},
    {"bitfileDate", "0"},
    {"ipAddr", "where clients connect; octets in reading order"},
    {"ipMask", "its network mask"},
    {"connectedIpAddr", "the client; 0.0.0.0: none"},
    {"macAddr", "of the network interface"},
    {"temperature", "deg C; all eight are that of the water"},
    {"pressure", "bar, absolute; VND discards longer datagrams, ENS and APL shorter ones"},
};
const docs::Meanings both_results{
    {"pingId", "one more for each ping, across clients"},
    {"status", "0 (CAP)"},
    {"frequency", "Hz; APL's node derives beam widths from it"},
    {"temperature", "deg C; drivers warn at 30 and command standby at 35"},
    {"pressure", "bar, absolute"},
    {"speedOfSoundUsed", "m/s"},
    {"dataSize", "bytes per sample minus 1; 24 bit is never sent"},
    {"rangeResolution", "m per row"},
    {"nRanges", "rows"},
    {"nBeams", "columns"},
    {"imageOffset", "2048, from the start of the message"},
    {"imageSize", "bytes, row gains included"},
    {"messageSize", "bytes, header included"},
};
docs::Meanings with(docs::Meanings meanings, const docs::Meanings& more) {
  meanings.insert(more.begin(), more.end());
  return meanings;
}
const docs::Meanings user_config{
    {"ipAddr", "a plain integer: 192.168.1.2 is 0xC0A80102, on the wire `02 01 A8 C0`"},
    {"ipMask", "likewise"},
    {"dhcpEnable", "0 or 1"},
};

std::string rest_of_ping(std::size_t fixed) {
  return "Then, from " + std::to_string(fixed) + ", `i16 x nBeams` bearings, 0.01 deg; zeros up to " +
         std::to_string(image_offset) + " (a real device leaks old memory there); the image, row by row.\n\n";
}

}  // namespace

int main() {
  std::cout
      << "# Oculus: layouts of the messages\n\nLittle-endian, byte-packed, the vendor's names. What they mean for a "
         "client: docs/protocols/oculus.md; tags such as ENS: docs/decisions/0025-oculus-evidence.md.\n\n"
      << "## Header of every message\n\n"
      << layout_table<MessageHeader>(header) << "## Fire message (0x15), versions 0 to 2\n\n"
      << layout_table<FireMessageV2>(fire, {"header."}) << "## Status (0x01)\n\n"
      << layout_table<StatusMessage>(status, {"header."}) << "## Ping result (0x23), versions 0 and 1\n\n"
      << layout_table<PingResultV1>(with(both_results, {{"pingStartTime", "a counter; option `ping_start_time_unit`"}}),
                                    {"header.", "fire."})
      << rest_of_ping(ping_v1_size) << "## Ping result (0x23), version 2\n\n"
      << layout_table<PingResultV2>(
             with(both_results,
                  {{"heading", "deg"}, {"pitch", "deg"}, {"roll", "deg"}, {"pingStartTime", "s since power-up"}, {"spare", "0"}}),
             {"header.", "fire.", "extension."})
      << rest_of_ping(ping_v2_size) << "## User configuration (0x55)\n\n"
      << layout_table<UserConfigMessage>(user_config, {"header."});
  return std::cout.flush() ? 0 : 1;
}
