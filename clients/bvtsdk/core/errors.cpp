#include "clients/bvtsdk/core/codes.hpp"

namespace sonar::bvt {
namespace {

struct Entry {
  int code;
  const char* name;
  const char* text;
};

constexpr Entry entries[] = {
    {success, "BVT_SUCCESS", "No error."},
    {failed, "BVT_FAILED", "The call failed for a reason without a code; see the log."},
    {memory_alloc, "BVT_MEMORY_ALLOC", "Out of memory."},
    {file_open, "BVT_FILE_OPEN", "The file cannot be opened; check its name and rights."},
    {file_read, "BVT_FILE_READ", "The file cannot be read."},
    {file_write, "BVT_FILE_WRITE", "The file cannot be written; check that the disk is not full."},
    {bad_parameter, "BVT_BAD_PARAMETER", "An argument is outside of the permitted range."},
    {invalid_ptr, "BVT_INVALID_PTR", "A handle or pointer is null, was destroyed, or is of another kind."},
    {file_create, "BVT_FILE_CREATE", "The file cannot be created; check its folder and rights."},
    {file_not_open, "BVT_FILE_NOTOPEN", "No file is open."},
    {not_implemented, "BVT_NOT_IMPLEMENTED", "This library does not have that function."},
    {timeout, "BVT_TIMEOUT", "The sonar did not ping in time."},
    {buffer_too_small, "BVT_BUFFER_TOO_SMALL", "The buffer is too small for the answer."},
    {file_header_bad, "BVT_FILE_HEADER_BAD", "The file is not a recording of this library; vendor recordings cannot be read."},
    {file_too_new, "BVT_FILE_TOO_NEW", "The file was written by a newer version."},
    {lookup_host, "BVT_LOOKUP_HOST", "The sonar's host name is unknown."},
    {connection_timed_out, "BVT_CONNECTION_TIMEDOUT", "The sonar does not accept the connection; check that it runs there."},
    {socket_read_timeout, "BVT_SOCKET_READ_TIMEOUT", "The sonar stopped answering; open it again."},
    {socket_write_timeout, "BVT_SOCKET_WRITE_TIMEOUT", "The sonar stopped accepting requests; open it again."},
    {socket_closed, "BVT_SOCKET_CLOSED", "The connection to the sonar is closed; open it again."},
    {socket_write, "BVT_SOCKET_WRITE", "Writing to the sonar failed; open it again."},
    {socket_read, "BVT_SOCKET_READ", "Reading from the sonar failed; open it again."},
    {index_out_of_bounds, "BVT_INDEX_OUTOFBOUNDS", "The index is past the end."},
    {socket_not_connected, "BVT_SOCKET_NOT_CONNECTED", "No connection to a sonar."},
    {no_temp, "BVT_NO_TEMP", "The sonar has no thermometer."},
    {no_head, "BVT_NO_HEAD", "The sonar has no head of that number."},
    {ping_number_too_large, "BVT_PING_NUM_TOO_LARGE", "The recording has no ping of that number: it ends before."},
    {ping_number_too_small, "BVT_PING_NUM_TOO_SMALL", "The ping number is negative."},
    {bad_range, "BVT_BAD_RANGE", "The range is outside what the head can do, or stop does not exceed start."},
    {no_ping_signal, "BVT_NO_PING_SIGNAL", "The ping holds no samples."},
    {read_only_file, "BVT_READONLY_FILE",
     "This sonar cannot be written to: it is not a recording, or the recording is open for reading."},
    {no_video_frame, "BVT_NO_VIDEO_FRAME", "The ping has no video frame."},
    {bad_ping, "BVT_BAD_PING", "The ping is not valid."},
    {bad_color_map, "BVT_BAD_COLOR_MAP", "No colour map is loaded."},
    {bad_head, "BVT_BAD_HEAD", "The image generator has no head; call SetHead first."},
    {bad_image_type, "BVT_BAD_IMAGE_TYPE", "The image type is neither XY nor R-Theta."},
    {invalid_image_size, "BVT_INVALID_IMG_SIZE", "The image size is not possible."},
    {invalid_resolution, "BVT_INVALID_RESOLUTION", "The image resolution is not possible."},
    {load_color_map, "BVT_PV_LOAD_COLORMAP", "The colour map file cannot be read or is not 12288 bytes long."},
    {bad_packet_type, "BVT_NET_BAD_PACKET_TYPE", "The program at that address does not speak the sonar's protocol."},
    {net_not_connected, "BVT_NET_NOT_CONNECTED", "No connection to a sonar."},
    {bad_packet_version, "BVT_NET_BAD_PACKET_VER", "Sonar and library speak different versions."},
    {nav_no_data, "BVT_NAV_NO_DATA", "That navigation value is not set."},
    {trigger_not_present, "BVT_TRIGGER_NOT_PRESENT", "The sonar has no trigger input."},
};

const Entry* find(int code) {
  for (const Entry& e : entries)
    if (e.code == code) return &e;
  return nullptr;
}

}  // namespace

const char* error_name(int code) {
  const Entry* e = find(code);
  return e ? e->name : "BVT_UNKNOWN_ERROR";
}

const char* error_text(int code) {
  const Entry* e = find(code);
  return e ? e->text : "No such error code.";
}

}  // namespace sonar::bvt
