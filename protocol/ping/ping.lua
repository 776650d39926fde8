-- Wireshark dissector for the ping protocol of Blue Robotics and Cerulean: Ping360 on UDP 12345 and 9092, Surveyor on TCP and UDP
-- 62312, Omniscan and S500 on 51200, Ping1D on 9090. It shares nothing with the C++ code, so that each can check the other
-- (tests/acceptance/ping_link_test.py). Layouts: docs/protocols/ping.md; how to install it: clients/wireshark/README.md.

local ping = Proto("brping", "Blue Robotics ping protocol")
local HEADER, SUM = 8, 2

-- Names of messages, and their fields: name, type; "rest" is all bytes that follow, "skip" a number of unused bytes.
local messages = {
  [1] = {"ack", {{"acked_id", "u16"}}},
  [2] = {"nack", {{"nacked_id", "u16"}, {"nack_message", "text"}}},
  [3] = {"ascii_text", {{"ascii_message", "text"}}},
  [4] = {"device_information", {{"device_type", "u8"}, {"device_revision", "u8"}, {"firmware_version_major", "u8"},
    {"firmware_version_minor", "u8"}, {"firmware_version_patch", "u8"}, {"reserved", "u8"}}},
  [5] = {"protocol_version", {{"version_major", "u8"}, {"version_minor", "u8"}, {"version_patch", "u8"}, {"reserved", "u8"}}},
  [6] = {"general_request", {{"requested_id", "u16"}}},
  [10] = {"json_wrapper", {{"string", "text"}}},
  [14] = {"utc_request", {}},
  [15] = {"utc_response", {{"utc_msec", "u64"}, {"accuracy_msec", "u32"}}},
  [17] = {"set_net_info", {{"ntp_ip_address", "u32"}, {"subnet_mask", "u32"}, {"gateway_ip", "u32"}}},
  [100] = {"set_device_id", {{"device_id", "u8"}}},
  [116] = {"set_speed_of_sound", {{"speed_of_sound", "u32"}}},
  [118] = {"water_stats", {{"temp_C", "f32"}, {"pressure_bar", "f32"}}},
  [504] = {"attitude_report", {{"up_x", "f32"}, {"up_y", "f32"}, {"up_z", "f32"}, {"skip", 12}, {"utc_msec", "u64"},
    {"pwr_up_msec", "u32"}}},
  [1000] = {"set_device_id", {{"device_id", "u8"}}},
  [1001] = {"set_range", {{"scan_start", "u32"}, {"scan_length", "u32"}}},
  [1002] = {"set_speed_of_sound", {{"speed_of_sound", "u32"}}},
  [1003] = {"set_mode_auto", {{"mode_auto", "u8"}}},
  [1004] = {"set_ping_interval", {{"ping_interval", "u16"}}},
  [1005] = {"set_gain_setting", {{"gain_setting", "u8"}}},
  [1006] = {"set_ping_enable", {{"ping_enabled", "u8"}}},
  [1015] = {"set_ping_params", {{"start_mm", "u32"}, {"length_mm", "u32"}, {"gain_index", "i16"}, {"msec_per_ping", "i16"},
    {"pulse_len_usec", "u16"}, {"report_id", "u16"}, {"skip", 2}, {"chirp", "u8"}, {"decimation", "u8"}}},
  [1100] = {"goto_bootloader", {}},
  [1200] = {"firmware_version", {{"device_type", "u8"}, {"device_model", "u8"}, {"firmware_version_major", "u16"},
    {"firmware_version_minor", "u16"}}},
  [1201] = {"device_id", {{"device_id", "u8"}}},
  [1202] = {"voltage_5", {{"voltage_5", "u16"}}},
  [1203] = {"speed_of_sound", {{"speed_of_sound", "u32"}}},
  [1204] = {"range", {{"scan_start", "u32"}, {"scan_length", "u32"}}},
  [1205] = {"mode_auto", {{"mode_auto", "u8"}}},
  [1206] = {"ping_interval", {{"ping_interval", "u16"}}},
  [1207] = {"gain_setting", {{"gain_setting", "u32"}}},
  [1208] = {"transmit_duration", {{"transmit_duration", "u16"}}},
  [1210] = {"general_info", {{"firmware_version_major", "u16"}, {"firmware_version_minor", "u16"}, {"voltage_5", "u16"},
    {"ping_interval", "u16"}, {"gain_setting", "u8"}, {"mode_auto", "u8"}}},
  [1211] = {"distance_simple", {{"distance", "u32"}, {"confidence", "u8"}}},
  [1212] = {"distance", {{"distance", "u32"}, {"confidence", "u16"}, {"transmit_duration", "u16"}, {"ping_number", "u32"},
    {"scan_start", "u32"}, {"scan_length", "u32"}, {"gain_setting", "u32"}}},
  [1213] = {"processor_temperature", {{"processor_temperature", "u16"}}},
  [1214] = {"pcb_temperature", {{"pcb_temperature", "u16"}}},
  [1215] = {"ping_enable", {{"ping_enabled", "u8"}}},
  [1223] = {"distance2", {{"ping_distance_mm", "u32"}, {"averaged_distance_mm", "u32"}, {"skip", 2}, {"ping_confidence", "u8"},
    {"average_distance_confidence", "u8"}, {"timestamp", "u32"}}},
  [1300] = {"profile", {{"distance", "u32"}, {"confidence", "u16"}, {"transmit_duration", "u16"}, {"ping_number", "u32"},
    {"scan_start", "u32"}, {"scan_length", "u32"}, {"gain_setting", "u32"}, {"profile_data_length", "u16"}, {"profile_data", "rest"}}},
  [1308] = {"profile6_t", {{"ping_number", "u32"}, {"start_mm", "u32"}, {"length_mm", "u32"}, {"start_ping_hz", "u32"},
    {"end_ping_hz", "u32"}, {"adc_sample_hz", "u32"}, {"timestamp_msec", "u32"}, {"skip", 4}, {"pulse_duration_sec", "f32"},
    {"analog_gain", "f32"}, {"max_pwr_db", "f32"}, {"min_pwr_db", "f32"}, {"this_ping_depth_m", "f32"}, {"smooth_depth_m", "f32"},
    {"skip", 4}, {"ping_depth_measurement_confidence", "u8"}, {"gain_index", "u8"}, {"decimation", "u8"},
    {"smoothed_depth_measurement_confidence", "u8"}, {"num_results", "u16"}, {"pwr_results", "rest"}}},
  [1400] = {"continuous_start", {{"id", "u16"}}},
  [1401] = {"continuous_stop", {{"id", "u16"}}},
  [2000] = {"set_device_id", {{"device_id", "u8"}, {"reserved", "u8"}}},
  [2197] = {"os_ping_params", {{"start_mm", "u32"}, {"length_mm", "u32"}, {"msec_per_ping", "u32"}, {"skip", 8},
    {"pulse_len_percent", "f32"}, {"filter_duration_percent", "f32"}, {"gain_index", "i16"}, {"num_results", "u16"},
    {"enable", "u8"}, {"skip", 1}}},
  [2198] = {"os_mono_profile", {{"ping_number", "u32"}, {"start_mm", "u32"}, {"length_mm", "u32"}, {"timestamp_ms", "u32"},
    {"ping_hz", "u32"}, {"gain_index", "u16"}, {"num_results", "u16"}, {"sos_dmps", "u16"}, {"channel_number", "u8"}, {"skip", 1},
    {"pulse_duration_sec", "f32"}, {"analog_gain", "f32"}, {"max_pwr_db", "f32"}, {"min_pwr_db", "f32"},
    {"transducer_heading_deg", "f32"}, {"vehicle_heading_deg", "f32"}, {"pwr_results", "rest"}}},
  [2300] = {"device_data", {{"mode", "u8"}, {"gain_setting", "u8"}, {"angle", "u16"}, {"transmit_duration", "u16"},
    {"sample_period", "u16"}, {"transmit_frequency", "u16"}, {"number_of_samples", "u16"}, {"data_length", "u16"}, {"data", "rest"}}},
  [2301] = {"auto_device_data", {{"mode", "u8"}, {"gain_setting", "u8"}, {"angle", "u16"}, {"transmit_duration", "u16"},
    {"sample_period", "u16"}, {"transmit_frequency", "u16"}, {"start_angle", "u16"}, {"stop_angle", "u16"}, {"num_steps", "u8"},
    {"delay", "u8"}, {"number_of_samples", "u16"}, {"data_length", "u16"}, {"data", "rest"}}},
  [2600] = {"reset", {{"bootloader", "u8"}, {"reserved", "u8"}}},
  [2601] = {"transducer", {{"mode", "u8"}, {"gain_setting", "u8"}, {"angle", "u16"}, {"transmit_duration", "u16"},
    {"sample_period", "u16"}, {"transmit_frequency", "u16"}, {"number_of_samples", "u16"}, {"transmit", "u8"}, {"reserved", "u8"}}},
  [2602] = {"auto_transmit", {{"mode", "u8"}, {"gain_setting", "u8"}, {"transmit_duration", "u16"}, {"sample_period", "u16"},
    {"transmit_frequency", "u16"}, {"number_of_samples", "u16"}, {"start_angle", "u16"}, {"stop_angle", "u16"}, {"num_steps", "u8"},
    {"delay", "u8"}}},
  [2903] = {"motor_off", {}},
  [3011] = {"yz_point_data", {{"timestamp_msec", "u32"}, {"ping_number", "u32"}, {"sos_mps", "f32"}, {"up_x", "f32"},
    {"up_y", "f32"}, {"up_z", "f32"}, {"skip", 52}, {"water_degC", "f32"}, {"water_bar", "f32"}, {"heave_m", "f32"},
    {"start_m", "f32"}, {"end_m", "f32"}, {"skip", 2}, {"num_points", "u16"}, {"points", "rest"}}},
  [3012] = {"atof_point_data", {{"pwr_up_msec", "u32"}, {"utc_msec", "u64"}, {"listening_sec", "f32"}, {"sos_mps", "f32"},
    {"ping_number", "u32"}, {"ping_hz", "u32"}, {"pulse_sec", "f32"}, {"flags", "u32"}, {"num_points", "u16"}, {"skip", 2},
    {"points", "rest"}}},
  [3023] = {"set_ping_parameters", {{"start_mm", "i32"}, {"end_mm", "i32"}, {"sos_mps", "f32"}, {"gain_index", "i16"},
    {"msec_per_ping", "i16"}, {"skip", 3}, {"ping_enable", "u8"}, {"enable_channel_data", "u8"}, {"skip", 1},
    {"enable_yz_point_data", "u8"}, {"enable_atof_data", "u8"}, {"target_ping_hz", "i32"}, {"n_range_steps", "u16"}, {"skip", 2},
    {"pulse_len_steps", "f32"}}},
}
local kinds = {
  u8 = {1, ProtoField.uint8}, u16 = {2, ProtoField.uint16}, u32 = {4, ProtoField.uint32}, u64 = {8, ProtoField.uint64},
  i16 = {2, ProtoField.int16}, i32 = {4, ProtoField.int32}, f32 = {4, ProtoField.float}, text = {nil, ProtoField.string},
  rest = {nil, ProtoField.bytes},
}

local fields, registered = {}, {}
local function register(name, make, ...)
  if fields[name] then return end
  fields[name] = make("brping." .. name, ...)
  registered[#registered + 1] = fields[name]
end
local names = {}
for id, message in pairs(messages) do
  names[id] = message[1]
  for _, row in ipairs(message[2]) do
    if row[1] ~= "skip" then register(message[1] .. "." .. row[1], kinds[row[2]][2], row[1]) end
  end
end
register("payload_length", ProtoField.uint16, "payload_length")
register("message_id", ProtoField.uint16, "message_id", base.DEC, names)
register("src_device_id", ProtoField.uint8, "src_device_id")
register("dst_device_id", ProtoField.uint8, "dst_device_id")
register("checksum", ProtoField.uint16, "checksum", base.HEX)
ping.fields = registered

local broken = ProtoExpert.new("brping.expert.broken", "Not a frame", expert.group.MALFORMED, expert.severity.ERROR)
local wrong_sum = ProtoExpert.new("brping.expert.checksum", "Wrong checksum", expert.group.CHECKSUM, expert.severity.ERROR)
ping.experts = {broken, wrong_sum}

local function add_payload(tree, id, payload)
  local at = 0
  for _, row in ipairs(messages[id][2]) do
    local left = payload:len() - at
    if row[1] == "skip" then
      at = at + row[2]
    else
      local size = kinds[row[2]][1] or left
      if size > left then return tree:add_proto_expert_info(broken, "the payload ends before " .. row[1]) end
      local field = fields[messages[id][1] .. "." .. row[1]]
      if size > 0 and row[2] == "text" then tree:add(field, payload(at, size)) end
      if size > 0 and row[2] ~= "text" then tree:add_le(field, payload(at, size)) end
      at = at + size
    end
  end
end

-- Adds the frame that fills the range.
local function add_frame(range, pinfo, tree)
  local length, id = range(2, 2):le_uint(), range(4, 2):le_uint()
  local name = messages[id] and messages[id][1] or ("message " .. id)
  local inside = tree:add(ping, range, "ping protocol: " .. name)
  inside:add_le(fields.payload_length, range(2, 2))
  inside:add_le(fields.message_id, range(4, 2))
  inside:add(fields.src_device_id, range(6, 1))
  inside:add(fields.dst_device_id, range(7, 1))
  if messages[id] and length > 0 then add_payload(inside, id, range(HEADER, length)) end
  local sum = 0
  for i = 0, HEADER + length - 1 do sum = (sum + range(i, 1):uint()) % 65536 end
  local stated = inside:add_le(fields.checksum, range(HEADER + length, SUM))
  if range(HEADER + length, SUM):le_uint() ~= sum then stated:add_proto_expert_info(wrong_sum) end
  pinfo.cols.info:append(" " .. name)
end

local function is_start(tvb, at)
  return tvb(at, 1):uint() == 0x42 and (tvb:len() - at < 2 or tvb(at + 1, 1):uint() == 0x52)
end

function ping.dissector(tvb, pinfo, tree)
  pinfo.cols.protocol = "ping"
  pinfo.cols.info = ""
  local by_tcp = pinfo.port_type == 2
  local at = 0
  while at < tvb:len() do
    if not is_start(tvb, at) then
      tree:add_proto_expert_info(broken, "no frame begins at byte " .. at)
      return tvb:len()
    end
    local left = tvb:len() - at
    local size = left >= HEADER and HEADER + tvb(at + 2, 2):le_uint() + SUM or nil
    if not size or left < size then
      if by_tcp then
        pinfo.desegment_offset, pinfo.desegment_len = at, size and size - left or DESEGMENT_ONE_MORE_SEGMENT
      else
        tree:add_proto_expert_info(broken, "the datagram ends within a frame")
      end
      return tvb:len()
    end
    add_frame(tvb(at, size), pinfo, tree)
    at = at + size
  end
  return tvb:len()
end

for _, port in ipairs({12345, 9092, 62312, 51200, 9090}) do DissectorTable.get("udp.port"):add(port, ping) end
for _, port in ipairs({62312, 51200, 9090}) do DissectorTable.get("tcp.port"):add(port, ping) end
