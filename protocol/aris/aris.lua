-- Wireshark dissector for Sound Metrics ARIS sonars: commands on TCP 56888, beacons on UDP 56124, parts of frames on UDP 56444 and
-- on the ports that a SET_FRAMESTREAM_RECEIVER of the same capture names. It shares nothing with the C++ code, so that each can
-- check the other (tests/acceptance/aris_link_test.py). Layouts: docs/protocols/aris.md; use: clients/wireshark/README.md.

local aris = Proto("aris", "Sound Metrics ARIS sonar")
local aris_beacon = Proto("aris_beacon", "Sound Metrics ARIS sonar, beacon")
local aris_frame = Proto("aris_frame", "Sound Metrics ARIS sonar, part of a frame")
local COMMAND_LIMIT = 4096

-- Messages: number of a field -> name, kind, or the fields of an inner message ------------------------------------

local command_names = {
  [0] = "SET_DATETIME", "SET_FRAMESTREAM_RECEIVER", "SET_FRAMESTREAM_SETTINGS", "SET_ACOUSTICS", "SET_SALINITY", "SET_TELEPHOTO",
  "SET_FOCUS", "FORCE_FOCUS", "HOME_FOCUS", "SET_ROTATOR_MOUNT", "SET_ROTATOR_VELOCITY", "SET_ROTATOR_ACCELERATION",
  "SET_ROTATOR_POSITION", "STOP_ROTATOR", "PING", "SET_SYSLOG_RECEIVER", "POWER_DOWN",
}
local system_names = {[0] = "ARIS 1800", "ARIS 3000", "ARIS 1200"}
local state_names = {[0] = "available", "busy"}
local frequency_names = {[0] = "low", "high"}

local command = {
  [1] = {"type", "uint", command_names},
  [2] = {"dateTime", {[1] = {"dateTime", "text"}}},
  [3] = {"receiver", {[1] = {"port", "uint"}, [2] = {"ip", "text"}}},
  [4] = {"stream", {[1] = {"delay", {[1] = {"enable", "uint"}, [2] = {"period", "uint"}}}, [2] = {"mitigation", "uint"}}},
  [5] = {"acoustics", {
    [1] = {"cookie", "uint"}, [2] = {"frameRate", "float"}, [3] = {"samplesPerBeam", "uint"}, [4] = {"sampleStartDelay", "uint"},
    [5] = {"cyclePeriod", "uint"}, [6] = {"samplePeriod", "uint"}, [7] = {"pulseWidth", "uint"}, [8] = {"pingMode", "uint"},
    [9] = {"enableTransmit", "uint"}, [10] = {"frequency", "uint", frequency_names}, [11] = {"enable150Volts", "uint"},
    [12] = {"receiverGain", "float"}}},
  [6] = {"salinity", {[1] = {"value", "uint"}}},
  [7] = {"telephoto", {[1] = {"value", "uint"}}},
  [8] = {"focus", {[1] = {"position", "uint"}, [2] = {"range", "float"}}},
}
local beacon = {
  [1] = {"serialNumber", "uint"}, [2] = {"systemType", "uint", system_names},
  [3] = {"software", {[1] = {"major", "uint"}, [2] = {"minor", "uint"}, [3] = {"build", "uint"}}},
  [4] = {"connectionState", "uint", state_names}, [5] = {"capabilities", {[1] = {"enabled", "text"}}},
  [7] = {"commLink", "uint"}, [8] = {"cpuTemp", "float"}, [9] = {"powerDownReason", "uint"}, [10] = {"overTempLimit", "float"},
  [11] = {"overTempSeconds", "uint"}, [12] = {"diverHeld", "uint"}, [13] = {"variants", {[1] = {"enabled", "text"}}},
}
local part = {
  [1] = {"frameIndex", "uint"}, [2] = {"totalSize", "uint"}, [3] = {"header", "header"}, [4] = {"data", "bytes"},
  [5] = {"dataOffset", "uint"}, [6] = {"ackPort", "uint"},
}
local header = {  -- offset, name, type
  {0, "FrameIndex", "u32"}, {4, "FrameTime", "u64"}, {12, "Version", "u32"}, {20, "sonarTimeStamp", "u64"},
  {52, "WindowStart", "f32"}, {56, "WindowLength", "f32"}, {68, "ReceiverGain", "u32"}, {72, "DegC1", "u32"}, {84, "Focus", "u32"},
  {160, "CompassHeading", "f32"}, {164, "CompassPitch", "f32"}, {168, "CompassRoll", "f32"}, {224, "WaterTemp", "f32"},
  {420, "SampleRate", "f32"}, {436, "PingMode", "u32"}, {440, "FrequencyHiLow", "u32"}, {444, "PulseWidth", "u32"},
  {448, "CyclePeriod", "u32"}, {452, "SamplePeriod", "u32"}, {456, "TransmitEnable", "u32"}, {460, "FrameRate", "f32"},
  {464, "SoundSpeed", "f32"}, {468, "SamplesPerBeam", "u32"}, {472, "Enable150V", "u32"}, {476, "SampleStartDelay", "u32"},
  {480, "LargeLens", "u32"}, {484, "TheSystemType", "u32"}, {488, "SonarSerialNumber", "u32"}, {516, "ReorderedSamples", "u32"},
  {520, "Salinity", "u32"}, {524, "Pressure", "f32"}, {540, "FocusMotorMoving", "u32"}, {604, "FocusCurrentPosition", "u32"},
  {680, "AppliedSettings", "u32"}, {684, "ConstrainedSettings", "u32"}, {688, "InvalidSettings", "u32"}, {700, "Uptime", "u32"},
}
local beams_of = {[1] = 48, [3] = 96, [6] = 64, [9] = 128}

local fields, registered = {}, {}
local function register(name, make, ...)
  fields[name] = make("aris." .. name, ...)
  registered[#registered + 1] = fields[name]
end
local makers = {
  uint = ProtoField.uint32, float = ProtoField.float, text = ProtoField.string, bytes = ProtoField.bytes,
  u32 = ProtoField.uint32, u64 = ProtoField.uint64, f32 = ProtoField.float,
}
local function register_all(prefix, described)
  for _, row in pairs(described) do
    if type(row[2]) == "table" then
      register_all(prefix .. "." .. row[1], row[2])
    elseif row[2] == "uint" then
      register(prefix .. "." .. row[1], makers.uint, row[1], base.DEC, row[3])
    elseif row[2] ~= "header" then
      register(prefix .. "." .. row[1], makers[row[2]], row[1])
    end
  end
end
register_all("command", command)
register_all("beacon", beacon)
register_all("part", part)
for _, row in ipairs(header) do register("header." .. row[2], makers[row[3]], row[2]) end
register("length", ProtoField.uint32, "length of the command")
aris.fields = registered

local broken = ProtoExpert.new("aris.expert.broken", "Not a message", expert.group.MALFORMED, expert.severity.ERROR)
local doubt = ProtoExpert.new("aris.expert.doubt", "Unusual value", expert.group.PROTOCOL, expert.severity.WARN)
aris.experts = {broken, doubt}

-- Reading --------------------------------------------------------------------------------------------------

-- Returns the value and the place after it, or nil at the end of the bytes.
local function varint(tvb, at, stop)
  local value, factor = 0, 1
  for _ = 1, 10 do
    if at >= stop then return nil end
    local byte = tvb(at, 1):uint()
    value, factor, at = value + byte % 128 * factor, factor * 128, at + 1
    if byte < 128 then return value % 4294967296, at end
  end
  return nil
end

local function add_header(tree, range, values)
  local inside = tree:add(range, "header: " .. range:len() .. " bytes")
  for _, row in ipairs(header) do
    local size = row[3] == "u64" and 8 or 4
    if range:len() >= row[1] + size then
      local place = range(row[1], size)
      inside:add_le(fields["header." .. row[2]], place)
      if row[3] == "u32" then values["header." .. row[2]] = place:le_uint() end
    end
  end
  if range:len() < 744 then inside:add_proto_expert_info(doubt, "a header has 744 bytes") end
end

-- Adds the fields of a message between two places; values by path go into `values`. Returns false if the bytes are not a message.
local function add_message(tree, tvb, at, stop, described, prefix, values, path)
  while at < stop do
    local start = at
    local key, size, value
    key, at = varint(tvb, at, stop)
    if not key then return false end
    local row, kind = described[math.floor(key / 8)], key % 8
    if kind == 0 then
      value, at = varint(tvb, at, stop)
      if not value then return false end
    elseif kind == 2 then
      size, at = varint(tvb, at, stop)
      if not size or at + size > stop then return false end
    elseif kind == 5 or kind == 1 then
      size = kind == 5 and 4 or 8
      if at + size > stop then return false end
    else
      return false
    end
    local name = row and prefix .. "." .. row[1]
    local whole = tvb(start, at + (size or 0) - start)
    if row and kind == 0 and row[2] == "uint" then
      tree:add(fields[name], whole, value)
      values[path .. row[1]] = value
    elseif row and kind == 5 and row[2] == "float" then
      tree:add_le(fields[name], tvb(at, 4))
      values[path .. row[1]] = tvb(at, 4):le_float()
    elseif row and kind == 2 and row[2] == "text" then
      values[path .. row[1]] = size > 0 and tvb(at, size):string() or ""
      tree:add(fields[name], whole, values[path .. row[1]])
    elseif row and kind == 2 and row[2] == "bytes" then
      values[path .. row[1]] = size
      if size > 0 then tree:add(fields[name], tvb(at, size)) end
    elseif row and kind == 2 and row[2] == "header" then
      values[path .. row[1]] = size
      if size > 0 then add_header(tree, tvb(at, size), values) end
    elseif row and kind == 2 and type(row[2]) == "table" then
      local inside = tree:add(whole, row[1])
      values[path .. row[1]] = size
      if not add_message(inside, tvb, at, at + size, row[2], name, values, path .. row[1] .. ".") then return false end
    elseif row then
      tree:add(whole, row[1]):add_proto_expert_info(doubt, "another type than the description has")
    end
    at = at + (size or 0)
  end
  return true
end

local function short(value) return string.format("%.6g", value or 0) end

local function command_text(values)
  local kind = values.type or 0
  local text = command_names[kind] or "command " .. kind
  if kind == 1 then
    local ip = values["receiver.ip"] or ""
    text = text .. " " .. (ip ~= "" and ip or "controller") .. ":" .. short(values["receiver.port"])
  elseif kind == 3 then
    text = string.format("%s %s: mode %s, %s Hz, %s samples of %s us from %s us, gain %s dB", text,
      short(values["acoustics.cookie"]),
      short(values["acoustics.pingMode"]), short(values["acoustics.frameRate"]), short(values["acoustics.samplesPerBeam"]),
      short(values["acoustics.samplePeriod"]), short(values["acoustics.sampleStartDelay"]), short(values["acoustics.receiverGain"]))
  elseif kind == 4 then
    text = text .. " " .. short(values["salinity.value"])
  elseif kind == 0 then
    text = text .. " " .. (values["dateTime.dateTime"] or "")
  end
  return text
end

local function say(pinfo, text)
  pinfo.cols.protocol = "ARIS"
  pinfo.cols.info = text
end
-- A packet may hold several commands.
local said
local function say_also(pinfo, text)
  said = said and said .. "; " .. text or text
  say(pinfo, said)
end

local function dissect_command(tvb, pinfo, tree)
  local item = tree:add(aris, tvb(), "ARIS command")
  item:add(fields.length, tvb(0, 4))
  local values = {}
  if not add_message(item, tvb, 4, tvb:len(), command, "command", values, "") then
    item:add_proto_expert_info(broken, "these bytes are no command")
    say_also(pinfo, "command that cannot be read")
    return tvb:len()
  end
  local port = values["receiver.port"]
  if port and port > 0 and port < 65536 then DissectorTable.get("udp.port"):add(port, aris_frame) end
  item:append_text(": " .. command_text(values))
  say_also(pinfo, command_text(values))
  return tvb:len()
end

function aris.dissector(tvb, pinfo, tree)
  said = nil
  if tvb:len() >= 4 and tvb(0, 4):uint() > COMMAND_LIMIT then
    tree:add(aris, tvb()):add_proto_expert_info(broken, "a command of " .. tvb(0, 4):uint() .. " bytes")
    return tvb:len()
  end
  return dissect_tcp_pdus(tvb, tree, 4, function(pdu, _, at) return 4 + math.min(pdu(at, 4):uint(), COMMAND_LIMIT) end,
    dissect_command)
end

function aris_beacon.dissector(tvb, pinfo, tree)
  local item, values = tree:add(aris, tvb(), "ARIS beacon"), {}
  if not add_message(item, tvb, 0, tvb:len(), beacon, "beacon", values, "") then
    item:add_proto_expert_info(broken, "these bytes are no beacon")
  end
  for _, name in ipairs({"serialNumber", "systemType", "connectionState"}) do
    if not values[name] then item:add_proto_expert_info(doubt, "older controllers need " .. name) end
  end
  say(pinfo, string.format("beacon: %s %s, %s", system_names[values.systemType] or "ARIS", short(values.serialNumber),
    state_names[values.connectionState] or "?"))
  return tvb:len()
end

function aris_frame.dissector(tvb, pinfo, tree)
  local item, values = tree:add(aris, tvb(), "ARIS frame part"), {}
  if not add_message(item, tvb, 0, tvb:len(), part, "part", values, "") or not values.totalSize then
    item:add_proto_expert_info(broken, "these bytes are no part of a frame")
    say(pinfo, "datagram that cannot be read")
    return tvb:len()
  end
  local first, last = values.dataOffset or 0, (values.dataOffset or 0) + (values.data or 0)
  if last > values.totalSize then item:add_proto_expert_info(doubt, "the samples end after the frame") end
  if tvb:len() > 1400 then item:add_proto_expert_info(doubt, "older controllers accept at most 1400 bytes") end
  local text = string.format("frame %s: bytes %d to %d of %d", short(values.frameIndex), first, last, values.totalSize)
  local mode = values["header.PingMode"]
  if mode then
    local beams, rows = beams_of[mode], values["header.SamplesPerBeam"] or 0
    text = text .. string.format(", %s x %d", beams or "?", rows)
    if beams and beams * rows ~= values.totalSize then
      item:add_proto_expert_info(doubt, "header and totalSize do not agree")
    end
  elseif first == 0 then
    item:add_proto_expert_info(doubt, "a first part without a header")
  end
  item:append_text(": " .. text)
  say(pinfo, text)
  return tvb:len()
end

DissectorTable.get("tcp.port"):add(56888, aris)
DissectorTable.get("udp.port"):add(56124, aris_beacon)
DissectorTable.get("udp.port"):add(56444, aris_frame)
