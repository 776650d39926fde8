// The return codes of the SDK that these libraries produce: public constants of its interface, the same in 3.x and 4.x.
// A function of the core that can fail returns one of them; the facades pass it on unchanged.
#pragma once

#include "protocol/blueview/link.hpp"

namespace sonar::bvt {

enum Code : int {
  success = 0,
  failed = 1,
  memory_alloc = 2,
  file_open = 3,
  file_read = 4,
  file_write = 5,
  bad_parameter = static_cast<int>(blueview::Code::bad_parameter),
  invalid_ptr = 7,
  file_create = 8,
  file_not_open = 10,
  not_implemented = 13,
  timeout = static_cast<int>(blueview::Code::timeout),
  buffer_too_small = 19,
  file_header_bad = 1003,
  file_too_new = 1004,
  lookup_host = 1014,
  connection_timed_out = 1015,
  socket_read_timeout = 1017,
  socket_write_timeout = 1018,
  socket_closed = 1020,
  socket_write = 1021,
  socket_read = 1022,
  index_out_of_bounds = 1064,
  socket_not_connected = 1065,
  no_temp = 2008,
  no_head = static_cast<int>(blueview::Code::no_head),
  ping_number_too_large = 4002,
  ping_number_too_small = 4003,
  bad_range = static_cast<int>(blueview::Code::bad_range),
  no_ping_signal = 4011,
  read_only_file = 4012,
  no_video_frame = 4014,
  bad_ping = 5001,
  bad_color_map = 5002,
  bad_head = 5003,
  bad_image_type = 5004,
  invalid_image_size = 5008,
  invalid_resolution = 5010,
  load_color_map = 9001,
  bad_packet_type = static_cast<int>(blueview::Code::bad_packet_type),
  net_not_connected = 14003,
  bad_packet_version = static_cast<int>(blueview::Code::bad_packet_version),
  nav_no_data = 16000,
  trigger_not_present = 18000,
};

/// Returns the name of a return code (BVTError_GetName): that of the SDK's constant, such as "BVT_SUCCESS", and
/// "BVT_UNKNOWN_ERROR" for any other number. The pointer is never null and always valid.
const char* error_name(int code);
/// Returns the text of a return code (BVTError_GetString). The texts are ours.
const char* error_text(int code);

}  // namespace sonar::bvt
