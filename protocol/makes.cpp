#include "protocol/aris/aris.hpp"
#include "protocol/aris/host.hpp"
#include "protocol/blueview/blueview.hpp"
#include "protocol/blueview/host.hpp"
#include "protocol/dvl/dvl.hpp"
#include "protocol/dvl/host.hpp"
#include "protocol/host.hpp"
#include "protocol/m3/host.hpp"
#include "protocol/m3/m3.hpp"
#include "protocol/micron/host.hpp"
#include "protocol/micron/micron.hpp"
#include "protocol/norbit/host.hpp"
#include "protocol/norbit/norbit.hpp"
#include "protocol/oculus/host.hpp"
#include "protocol/oculus/oculus.hpp"
#include "protocol/ping/host.hpp"
#include "protocol/ping/omniscan.hpp"
#include "protocol/ping/ping1d.hpp"
#include "protocol/ping/ping360.hpp"
#include "protocol/ping/s500.hpp"
#include "protocol/ping/surveyor.hpp"
#include "protocol/waterlinked/host.hpp"
#include "protocol/waterlinked/waterlinked.hpp"

namespace sonar::protocol {

// One row for each make. Other code outside the folders of the makes names none, except the files that check_floors.py lists
// (MAY_NAME_MAKES, NAME_MAKES). The first row is the make of the demo without a name and of unknown profiles. A user may give the
// first of `ports` another number.
std::vector<Make> product_makes() {
  return {
      {.device = &oculus::vendor(),
       .title = "an Oculus",
       .request = "fire message",
       .remedy = "send a fire message (type 0x15)",
       .ports = oculus::host_ports,
       .host = oculus::make_host,
       .codec = oculus::codec(),
       .announced = oculus::announced,
       .usual_settings = "--mode 2 --range 10 --gain 50 --rate 10",
       .demo_profile = "oculus-m1200d"},
      {.device = &blueview::vendor(),
       .title = "a BlueView sonar",
       .request = "request for a ping",
       .remedy = "send a request for a ping, or a subscription",
       .ports = blueview::host_ports,
       .host = blueview::make_host,
       .codec = blueview::codec(),
       .search = &blueview::search,
       .driver_call = "BVTSonar_Open(sonar, \"NET\", \"{at}\") with sonard's libbvtsdk",
       .own_faults = 'B',
       .each_ping_requested = true,
       .shades = blueview::shades},
      {.device = &aris::vendor(),
       .title = "an ARIS",
       .request = "command",
       .remedy = "send SET_FRAMESTREAM_RECEIVER and SET_ACOUSTICS",
       .ports = aris::host_ports,
       .host = aris::make_host,
       .codec = aris::codec(),
       .own_numbers = true,
       .demo_profile = "aris-3000",
       .demo_mount = RollPitchYaw{0, 40 * pi / 180, 0}},  // looks down to the bed, because its window ends at 3.4 m
      {.device = &waterlinked::vendor(),
       .title = "a Sonar 3D-15",
       .request = "request",
       .remedy = "post true to /acoustics/enabled and a mode to /udp, below /api/v1/integration",
       .ports = waterlinked::host_ports,
       .host = waterlinked::make_host,
       .codec = waterlinked::codec(),
       .demo_name = "3d15",
       .picture = PictureKind::range_image},
      {.device = &ping::ping360::vendor(),
       .title = "a Ping360",
       .request = "request",
       .remedy = "send auto_transmit (2602), or transducer (2601) with transmit 1",
       .ports = ping::ping360::host_ports,
       .host = ping::ping360::make_host,
       .codec = ping::ping360::codec(),
       .own_numbers = true,
       .scans = true,
       .picture = PictureKind::sweep},
      {.device = &ping::surveyor::vendor(),
       .title = "a Surveyor",
       .request = "request",
       .remedy = "send set_ping_parameters (3023) with ping_enable 1",
       .ports = ping::surveyor::host_ports,
       .host = ping::surveyor::make_host,
       .codec = ping::surveyor::codec(),
       .own_numbers = true,
       .demo_name = "surveyor",
       .demo_mount = RollPitchYaw{0, pi / 2, 0},  // it looks down
       .picture = PictureKind::points},
      {.device = &ping::omniscan::vendor(),
       .title = "an Omniscan",
       .request = "request",
       .remedy = "send os_ping_params (2197) with enable 1",
       .ports = ping::omniscan::host_ports,
       .host = ping::omniscan::make_host,
       .codec = ping::omniscan::codec(),
       .usual_settings = "--rate 10",
       .own_numbers = true,
       .shares_port = true,
       .demo_name = "omniscan",
       .demo_mount = RollPitchYaw{0, pi / 6, -pi / 2},  // to starboard
       .picture = PictureKind::waterfall},
      {.device = &ping::ping1d::vendor(),
       .title = "a Ping1D",
       .request = "request",
       .remedy = "request distance (1212) or profile (1300), or send continuous_start (1400)",
       .ports = ping::ping1d::host_ports,
       .host = ping::ping1d::make_host,
       .codec = ping::ping1d::codec(),
       .usual_settings = "--rate 10",
       .own_numbers = true,
       .demo_mount = RollPitchYaw{0, pi / 2, 0},  // it looks down
       .picture = PictureKind::waterfall},
      {.device = &ping::s500::vendor(),
       .title = "an S500",
       .request = "request",
       .remedy = "send set_ping_params (1015) with report_id 1308 and msec_per_ping 100",
       .ports = ping::s500::host_ports,
       .host = ping::s500::make_host,
       .codec = ping::s500::codec(),
       .usual_settings = "--rate 10",
       .own_numbers = true,
       .shares_port = true,
       .demo_mount = RollPitchYaw{0, pi / 2, 0},  // it looks down
       .picture = PictureKind::waterfall},
      {.device = &dvl::vendor(),
       .title = "a DVL",
       .request = "command",
       .remedy = "send the command set_config with acoustic_enabled true",
       .ports = dvl::host_ports,
       .host = dvl::make_host,
       .codec = dvl::codec(),
       .own_numbers = true,
       .demo_mount = RollPitchYaw{0, pi / 2, 0},  // it looks down
       .picture = PictureKind::waterfall},
      {.device = &m3::vendor(),
       .title = "an M3",
       .request = "message",
       .remedy = "it need not ask: pings come to each driver that connects, once they are computed",
       .ports = m3::host_ports,
       .host = m3::make_host,
       .codec = m3::codec(),
       .shades = m3::shades},
      {.device = &micron::vendor(),
       .title = "a Micron",
       .request = "message",
       .remedy = "send mtHeadCommand (19), then mtSendData (25) for each scan line",
       .ports = micron::host_ports,
       .host = micron::make_host,
       .codec = micron::codec(),
       .own_numbers = true,
       .scans = true,
       .picture = PictureKind::sweep},
      {.device = &norbit::vendor(),
       .title = "a Norbit",
       .request = "command",
       .remedy = "send set_power 1 to port 2209",
       .ports = norbit::host_ports,
       .host = norbit::make_host,
       .codec = norbit::codec(),
       .demo_mount = RollPitchYaw{0, pi / 2, 0},  // it looks down
       .picture = PictureKind::points,
       .shades = norbit::shades},
  };
}

}  // namespace sonar::protocol
