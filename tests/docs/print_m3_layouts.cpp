// Prints the layout of an M3's packet as a Markdown page: `ninja -C build/release docs` writes it into the build folder.
#include <iostream>

#include "protocol/m3/messages.hpp"
#include "tests/docs/layout_table.hpp"

namespace {

using namespace sonar::m3;
using sonar::docs::layout_table;
using sonar::docs::Meanings;

const Meanings head{
    {"sync", "0x8000 each"},
    {"data_type", "0x1002: complex samples"},
    {"reserved", "0"},
    {"reserved_words", "0"},
    {"body_size", "size of data header and samples: 8512 + 8 beams samples (PKT: 1,311,040 for 128 beams of 1272)"},
};
const Meanings foot{{"body_size", "the same size"}, {"reserved_words", "0"}};
// "=": the value of the real packet (PKT) and ours; "PKT" and "here" differ.
const Meanings data{
    {"version", "version of the header = 14"},
    {"sonar_id", "id of the sonar = 0"},
    {"sonar_info", "information on the sonar; PKT 419954710, 0 ..; here serial number, 0 .. (unknown)"},
    {"time_s", "time of the ping: s of UTC; here when it fires"},
    {"time_ms", "its milliseconds"},
    {"sound_speed", "m/s; PKT 1469; here the water's at the head"},
    {"samples", "samples of each beam; PKT 1272; here as in \"Window\" of the page"},
    {"near", "near range [m]; PKT 1"},
    {"far", "far range [m]; PKT 10"},
    {"window_start", "start of the sampling window [s]; PKT 0.001307"},
    {"window_length", "its length [s]; PKT 0.013024"},
    {"beams", "beams = 128"},
    {"processing", "0, standard"},
    {"beam_angles", "angles of the beams [degrees], rising = -59.53125 to 59.53125 by 0.9375; then 0"},
    {"sample_interval", "interval of the samples [s]; PKT 10.24e-6"},
    {"image_destination", "= 0"},
    {"pulse_type", "= 0"},
    {"azimuth_processing", "= 1"},
    {"mode_id", "id of the mode = 118"},
    {"hybrid_pings", "= 1"},
    {"hybrid_index", "= 0"},
    {"phase_length", "length of the phase sequence = 1"},
    {"phase_index", "= 0"},
    {"images", "= 1"},
    {"image_index", "= 0"},
    {"frequency", "Hz = 500000"},
    {"pulse_length", "us; PKT 20"},
    {"ping_number", "number of the ping; PKT 8722"},
    {"filter_bandwidth", "Hz; PKT 48828; here half of the sampling rate"},
    {"resolution", "m; PKT 0.0145; here 1450 m/s pulse / 2"},
    {"ping_rate", "Hz; PKT 15"},
    {"application", "= Imaging 3"},
    {"pulse_name", "PKT 'Tone Burst 20us'; here with the pulse's length"},
    {"back.gain.a", "gain law, A; PKT 20"},
    {"back.gain.b", "B; PKT 100"},
    {"back.gain.c", "C; PKT -16; here by `--gain`"},
    {"back.gain.limit", "L; PKT 100"},
    {"heading", "degrees; here of the vehicle"},
    {"magnetic_variation", "degrees"},
    {"back.pitch", "degrees; here of the vehicle"},
    {"back.roll", "degrees; here of the vehicle"},
    {"depth", "m; here of the head"},
    {"temperature", "PKT 30.75; here of the water"},
    {"offset", "of the head [m]: x to starboard, y ahead, z up (REF) = 0"},
    {"rotation", "of the head [degrees] = 0"},
    {"mounting", "0, forward"},
    {"latitude", "= 0"},
    {"longitude", "= 0"},
    {"transmit_start", "begin of the pulse [s] = 25e-6"},
    {"head_sensors", "sensors of the head = 1"},
    {"head_status", "1, 2: too hot; = 0"},
    {"sound_speed_source", "= 1"},
    {"time_mode", "= 1"},
    {"own_heading", "heading of the head itself [degrees]; here of the sonar"},
    {"own_pitch", "its pitch"},
    {"own_roll", "its roll"},
    {"first_element", "= 0"},
    {"last_element", "= 63"},
    {"text_1", "free; here empty"},
    {"text_2", "free; here empty"},
    {"local_time", "local time zone [h]; PKT -1; here 0"},
    {"speed", "knots; PKT -1; here 0"},
    {"heave", "m = 0"},
    {"ping_near", "near range of the ping [m]; PKT 1"},
    {"ping_far", "far range of the ping [m]; PKT 10"},
    {"altitude", "m = 0"},
    {"geoid_height", "m = 0"},
    {"sound_speeds", "measured, filtered, applied, threshold; PKT 1469 x 3, 2.5; here the same law"},
    {"depth_tracking", "100, 75, 1, 0 .."},
    {"position_quality", "= 0"},
    {"scan_3d", "= 0"},
    {"scan_axis", "= 0"},
    {"sonar_class", "= 17"},
    {"transmitters", "= 0"},
    {"vehicle_altitude", "= 0"},
    {"conductivity", "= 0"},
    {"back.reserved", "0"},
};

}  // namespace

int main() {
  std::cout
      << "# M3: layout of a packet\n\nLittle-endian. \"=\" is the value of the real packet (PKT) and ours; where \"PKT\" and "
         "\"here\" stand, they differ. Rotators are 0. Sources: docs/protocols/m3.md.\n\n## Head\n\n"
      << layout_table<PacketHead>(head) << "## Data header, from offset 56 of the packet\n\n"
      << layout_table<DataHeader>(data) << "Then the samples.\n\n## Foot, the last 44 bytes\n\n"
      << layout_table<PacketFoot>(foot);
  return std::cout.flush() ? 0 : 1;
}
