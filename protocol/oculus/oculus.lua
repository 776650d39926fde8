-- Wireshark dissector for Blueprint Oculus sonars: the stream on TCP 52100, the status datagrams on UDP 52102.
-- It shares nothing with the C++ code, so that each can check the other (tests/acceptance/dissector_test.py). The layouts are
-- those of docs/protocols/oculus.md; use: clients/wireshark/README.md. It is one file, because users install it by copying.

local oculus = Proto("oculus", "Blueprint Oculus sonar")
local oculus_status = Proto("oculus_status", "Blueprint Oculus sonar, status datagram")  -- its packets go to the one above

local HEADER = 16
local REQUEST_LIMIT = 4096              -- largest payload of a client's message; a larger size is invalid
local REPLY_LIMIT = 4 * 1024 * 1024     -- bytes of a device's message; the largest real ping has 1.5 MB
local LISTED = 4096                     -- largest number of beams and rows that are shown one by one
local FIXED_V1, FIXED_V2 = 122, 202     -- fixed part of a ping result: the bearing table follows

-- What values mean ------------------------------------------------------------------------------------------

local message_names = {
  [0x01] = "status", [0x15] = "fire", [0x22] = "full ping result", [0x23] = "ping result", [0x55] = "user configuration",
  [0x80] = "log", [0xFF] = "dummy",
}
local mode_names = {[0] = "flexi", "low frequency", "high frequency"}
local rate_names = {[0] = "10 Hz", "15 Hz", "40 Hz", "5 Hz", "2 Hz", "standby"}
local data_size_names = {[0] = "8 bit", "16 bit", "24 bit", "32 bit"}
local state_names = {[0] = "boot-loader boot", "boot-loader runs", "main firmware boots", "main firmware runs"}
local pause_names = {[0] = "magnet switch", "boot from main", "flash error", "JTAG", "firmware error", "compatibility",
                     "brown-out"}
local device_names = {[0] = "undefined", "imaging sonar"}
local part_names = {  -- names of the older and the newer list of the vendor
  [0] = "undefined", [1032] = "M750d", [1041] = "M370s", [1042] = "M1200d", [1134] = "MF750d", [1135] = "MA750d",
  [1209] = "M373s", [1217] = "MD370s Impulse", [1218] = "M373s deep", [1219] = "MD1200d Impulse", [1220] = "N1200s",
  [1221] = "N1200s deep", [1228] = "MA1200d", [1229] = "MA370s", [1244] = "MD750d Impulse", [1433] = "MD370s", [1434] = "MD750d",
  [1435] = "MD1200d", [1436] = "MF370s", [1437] = "MF1200d", [1921] = "MD750d Burton", [2086] = "MD1200d Burton",
  [2203] = "M3000d", [2294] = "MD370s Burton", [2418] = "MT370s", [2419] = "MT750d", [2420] = "MT1200d", [2466] = "MF3000d",
  [2599] = "MT3000d", [2658] = "MD3000d Impulse", [2659] = "MD3000d Burton", [2924] = "MA3000d", [4713] = "C550d",
}

-- Prints numbers without the ".0" of Lua 5.3 and later, and without rounding digits.
local function short(value) return string.format("%.6g", value) end
local function finite(value) return value == value and value ~= math.huge and value ~= -math.huge end
local function bit_set(value, bit) return math.floor(value / 2 ^ bit) % 2 == 1 end

local function firmware(value)  -- major 8 bits, minor 8, build 16
  return string.format("%d.%d build %d", math.floor(value / 2 ^ 24), math.floor(value / 2 ^ 16) % 256, value % 65536)
end
local function gamma(value) return "exponent " .. (value == 0 and "1" or string.format("%.3f", value / 255)) end
local function no_limit(value) return (value == 0 or value == 255) and "no limit" or "Mbit/s" end

-- Layouts: name, type, then the display of the value. Order and widths are those of the wire. ---

local layout = {
  header = {
    {"oculusId", "u16", base.HEX}, {"srcDeviceId", "u16"}, {"dstDeviceId", "u16"}, {"msgId", "u16", base.HEX, message_names},
    {"msgVersion", "u16"}, {"payloadSize", "u32"}, {"partNumber", "u16", base.DEC, part_names},
  },
  fire = {
    {"masterMode", "u8", base.DEC, mode_names}, {"pingRate", "u8", base.DEC, rate_names}, {"networkSpeed", "u8", note = no_limit},
    {"gammaCorrection", "u8", note = gamma}, {"flags", "u8", base.HEX}, {"range", "f64"}, {"gainPercent", "f64", unit = "%"},
    {"speedOfSound", "f64", unit = "m/s"}, {"salinity", "f64", unit = "ppt"},
  },
  fire_extension = {
    {"extFlags", "u32", base.HEX}, {"reserved0", "u32", base.HEX, count = 2}, {"beaconLocatorFrequency", "u32"},
    {"reserved1", "u32", base.HEX, count = 5},
  },
  status = {
    {"deviceId", "u32"}, {"deviceType", "u16", base.DEC, device_names}, {"partNumber", "u16", base.DEC, part_names},
    {"status", "u32", base.HEX}, {"firmwareVersion0", "u32", base.HEX, note = firmware}, {"firmwareDate0", "u32", base.HEX},
    {"firmwareVersion1", "u32", base.HEX, note = firmware}, {"firmwareDate1", "u32", base.HEX},
    {"bitfileVersion", "u32", base.HEX, note = firmware}, {"bitfileDate", "u32", base.HEX}, {"ipAddr", "ip"}, {"ipMask", "ip"},
    {"connectedIpAddr", "ip"}, {"macAddr", "mac"}, {"temperature", "f64", count = 8, unit = "deg C"},
    {"pressure", "f64", unit = "bar"},
  },
  ping_start = {
    {"pingId", "u32"}, {"status", "u32", base.HEX}, {"frequency", "f64", unit = "Hz"}, {"temperature", "f64", unit = "deg C"},
    {"pressure", "f64", unit = "bar"},
  },
  ping_attitude = {{"heading", "f64", unit = "deg"}, {"pitch", "f64", unit = "deg"}, {"roll", "f64", unit = "deg"}},
  ping_sound = {{"speedOfSoundUsed", "f64", unit = "m/s"}},
  ping_time_v1 = {{"pingStartTime", "u32"}},
  ping_time_v2 = {{"pingStartTimeSeconds", "f64", unit = "s"}},  -- pingStartTime too, but a filter name has one type
  ping_grid = {
    {"dataSize", "u8", base.DEC, data_size_names}, {"rangeResolution", "f64", unit = "m"}, {"nRanges", "u16"}, {"nBeams", "u16"},
  },
  ping_spare = {{"spare", "u32", base.HEX, count = 4}},
  ping_sizes = {{"imageOffset", "u32"}, {"imageSize", "u32"}, {"messageSize", "u32"}},
  config = {{"ipAddr", "ip"}, {"ipMask", "ip"}, {"dhcpEnable", "u32"}},
  full = {{"range", "f64", at = 25, unit = "m"}, {"nBeams", "u16", at = 73}, {"nRanges", "u32", at = 555},
          {"imageOffset", "u32", at = 576}, {"imageSize", "u32", at = 580}, {"messageSize", "u32", at = 584}},
}
local group_of = {  -- filter name of a layout's fields: oculus.GROUP.NAME
  header = "header", fire = "fire", fire_extension = "fire", status = "status", config = "config", full = "full",
  ping_start = "ping", ping_attitude = "ping", ping_sound = "ping", ping_time_v1 = "ping", ping_time_v2 = "ping",
  ping_grid = "ping", ping_spare = "ping", ping_sizes = "ping",
}

local types = {  -- bytes, the field's maker, how its value is read
  u8 = {1, ProtoField.uint8, function(range) return range:le_uint() end},
  u16 = {2, ProtoField.uint16, function(range) return range:le_uint() end},
  u32 = {4, ProtoField.uint32, function(range) return range:le_uint() end},
  f64 = {8, ProtoField.double, function(range) return range:le_float() end},
  ip = {4, ProtoField.ipv4, function(range) return range:le_uint() end},
  mac = {6, ProtoField.ether, function() return nil end},
}

local flag_bits = {"rangeInMetres", "samples16Bit", "rowGains", "simpleResult", "gainAssist", "lowPower", "beams512",
                   "networkTrigger"}
local status_bits = {
  [7] = "mainConnection", [14] = "overTemperature", [15] = "overTemperatureShutdown", [16] = "transmitFailure",
}

local fields, registered = {}, {}
local function register(name, field)
  fields[name] = field
  registered[#registered + 1] = field
end

for part, list in pairs(layout) do
  for _, row in ipairs(list) do
    local name, make = group_of[part] .. "." .. row[1], types[row[2]][2]
    if row[2] == "f64" or row[2] == "ip" or row[2] == "mac" then
      register(name, make("oculus." .. name, row[1]))
    else
      register(name, make("oculus." .. name, row[1], row[3] or base.DEC, row[4]))
    end
    row.field = fields[name]
  end
end
for bit, name in ipairs(flag_bits) do
  register("fire.flags." .. name, ProtoField.bool("oculus.fire.flags." .. name, name, 8, nil, 2 ^ (bit - 1)))
end
register("fire.extFlags.samples32Bit", ProtoField.bool("oculus.fire.extFlags.samples32Bit", "samples32Bit", 32, nil, 0x200))
register("status.status.state", ProtoField.uint32("oculus.status.status.state", "state", base.DEC, state_names, 0x7))
register("status.status.pause", ProtoField.uint32("oculus.status.status.pause", "pause reason", base.DEC, pause_names, 0x38))
for bit, name in pairs(status_bits) do
  register("status.status." .. name, ProtoField.bool("oculus.status.status." .. name, name, 32, nil, 2 ^ bit))
end
register("length", ProtoField.uint32("oculus.length", "message length"))
register("log.text", ProtoField.string("oculus.log.text", "text"))
register("ping.bits", ProtoField.uint8("oculus.ping.bits", "bits a sample"))
register("ping.bearing", ProtoField.int16("oculus.ping.bearing", "bearing, 0.01 deg", base.DEC))
register("ping.firstBearing", ProtoField.double("oculus.ping.firstBearing", "first bearing, deg"))
register("ping.lastBearing", ProtoField.double("oculus.ping.lastBearing", "last bearing, deg"))
register("ping.filler", ProtoField.bytes("oculus.ping.filler", "filler"))
register("ping.image", ProtoField.bytes("oculus.ping.image", "image"))
register("ping.rowGain", ProtoField.uint32("oculus.ping.rowGain", "row gain"))
register("payload", ProtoField.bytes("oculus.payload", "payload"))
register("junk", ProtoField.bytes("oculus.junk", "bytes that are not a message"))
oculus.fields = registered

local expert = {
  identity = ProtoExpert.new("oculus.expert.identity", "Identity broken", expert.group.PROTOCOL, expert.severity.ERROR),
  short = ProtoExpert.new("oculus.expert.short", "Message too short", expert.group.MALFORMED, expert.severity.ERROR),
  junk = ProtoExpert.new("oculus.expert.junk", "Bytes that are not a message", expert.group.UNDECODED, expert.severity.WARN),
  doubt = ProtoExpert.new("oculus.expert.doubt", "Unusual value", expert.group.PROTOCOL, expert.severity.WARN),
  note = ProtoExpert.new("oculus.expert.note", "Remark", expert.group.COMMENTS_GROUP, expert.severity.NOTE),
}
oculus.experts = {expert.identity, expert.short, expert.junk, expert.doubt, expert.note}

local function say(item, what, holds, text)
  if not holds then item:add_proto_expert_info(what, text) end
end

-- Reading ---------------------------------------------------------------------------------------------------

-- Adds the fields of a layout from `offset` on; values and items by name go into `values` and `items`. Returns the offset after
-- the last field; if the message ends before it, adds an expert item and returns nil.
local function add_layout(tree, message, offset, part, values, items)
  for _, row in ipairs(layout[part]) do
    local size, read = types[row[2]][1], types[row[2]][3]
    offset = row.at or offset
    for _ = 1, row.count or 1 do
      if message:len() < offset + size then
        say(tree, expert.short, false,
          row[1] .. " at byte " .. offset .. " does not fit: the message has " .. message:len() .. " bytes")
        return nil
      end
      local range = message(offset, size)
      local item
      if row[2] == "mac" or (row[2] == "ip" and part == "status") then
        item = tree:add(row.field, range)  -- octets in reading order
      else
        item = tree:add_le(row.field, range)
      end
      local value = read(range)
      if row.unit then item:append_text(" " .. row.unit) end
      if row.note then item:append_text(" (" .. row.note(value) .. ")") end
      if row[2] == "f64" then say(item, expert.doubt, finite(value), row[1] .. " is not a finite number") end
      values[row[1]], items[row[1]] = value, item
      offset = offset + size
    end
  end
  return offset
end

local function add_fire(tree, message, version, values, items)
  local after = add_layout(tree, message, HEADER, "fire", values, items)
  if not after then return nil end
  for _, name in ipairs(flag_bits) do items.flags:add_le(fields["fire.flags." .. name], message(20, 1)) end
  local metres = bit_set(values.flags, 0)
  items.range:append_text(metres and " m" or " % of the mode's maximum")
  if version >= 2 then
    after = add_layout(tree, message, after, "fire_extension", values, items)
    if not after then return nil end
    items.extFlags:add_le(fields["fire.extFlags.samples32Bit"], message(53, 4))
  end
  say(items.masterMode, expert.doubt, values.masterMode == 1 or values.masterMode == 2, "only modes 1 and 2 are public")
  return after
end

local function range_text(values) return short(values.range) .. (bit_set(values.flags, 0) and " m" or " %") end

local read = {}  -- per msgId: function(tree, message, header, pinfo) -> one line for the info column

read[0x15] = function(tree, message, header)
  local values, items = {}, {}
  local after = add_fire(tree, message, header.version, values, items)
  if not after then return "fire, too short" end
  say(items.pingRate, expert.doubt, values.pingRate <= 5, "ping rates are 0 to 5")
  say(tree, expert.note, message:len() == after,
    (message:len() - after) .. " bytes after the fields of version " .. header.version)
  return string.format("fire: %s, %s, %s, gain %s %%", mode_names[values.masterMode] or "mode " .. values.masterMode,
    rate_names[values.pingRate] or "rate " .. values.pingRate, range_text(values), short(values.gainPercent))
end

-- The ping result -------------------------------------------------------------------------------------------

local last_id, verdict_on = {}, {}  -- ping ids must rise within a connection; judged once, in the first pass over the capture
function oculus.init() last_id, verdict_on = {}, {} end

local function check_id(item, id, pinfo)
  local place = pinfo.number .. ":" .. id
  if not pinfo.visited then
    local connection = tostring(pinfo.src) .. ":" .. pinfo.src_port .. ">" .. tostring(pinfo.dst) .. ":" .. pinfo.dst_port
    local last = last_id[connection]
    if last and id <= last then verdict_on[place] = "pingId " .. id .. " does not rise above " .. last end
    last_id[connection] = id
  end
  say(item, expert.identity, verdict_on[place] == nil, verdict_on[place])
end

local function check_values(items, values)
  for _, name in ipairs({"rangeResolution", "speedOfSoundUsed", "frequency"}) do
    say(items[name], expert.identity, finite(values[name]) and values[name] > 0, name .. " must be above 0")
  end
  say(items.temperature, expert.doubt, not (values.temperature >= 30), "drivers warn from 30 deg C on and go to standby at 35")
  say(items.nRanges, expert.identity, values.nRanges >= 1, "there is no row")
  say(items.nBeams, expert.identity, values.nBeams >= 1, "there is no beam")
  local beams = bit_set(values.flags, 6) and 512 or 256
  say(items.nBeams, expert.doubt, values.nBeams == beams, "flag bit 6 of the echo promises " .. beams)
  local promised = bit_set(values.extFlags or 0, 9) and 3 or (bit_set(values.flags, 1) and 1 or 0)
  say(items.dataSize, expert.identity, values.dataSize <= 3, "dataSize " .. values.dataSize .. " does not exist")
  say(items.dataSize, expert.doubt, values.dataSize == promised, "the echoed flags promise " .. data_size_names[promised])
  if bit_set(values.flags, 0) then
    local covered = values.nRanges * values.rangeResolution
    say(items.rangeResolution, expert.note, math.abs(covered - values.range) <= values.rangeResolution,
      "rows cover " .. short(covered) .. " m, the requested range is " .. short(values.range) .. " m")
  end
end

-- Checks the sizes; each of these rules is enforced by some driver.
local function check_sizes(items, values, message, header)
  local length = header.payload + HEADER
  local row = values.nBeams * (values.dataSize + 1) + (bit_set(values.flags, 2) and 4 or 0)
  local fixed = header.version >= 2 and FIXED_V2 or FIXED_V1
  say(items.messageSize, expert.identity, values.messageSize == length,
    "messageSize is " .. values.messageSize .. ", payloadSize + 16 is " .. length)
  say(items.imageOffset, expert.identity, values.imageOffset + values.imageSize == values.messageSize,
    "imageOffset + imageSize is " .. (values.imageOffset + values.imageSize) .. ", messageSize is " .. values.messageSize)
  say(items.imageSize, expert.identity, values.imageSize == values.nRanges * row,
    "imageSize is " .. values.imageSize .. ", nRanges rows of " .. row .. " bytes are " .. values.nRanges * row)
  say(items.imageOffset, expert.identity, values.imageOffset > FIXED_V1, "imageOffset must exceed 122")
  say(items.imageOffset, expert.identity, values.imageOffset >= fixed + 2 * values.nBeams,
    "imageOffset " .. values.imageOffset .. " lies inside the bearing table, which ends at " .. fixed + 2 * values.nBeams)
end

local function add_bearings(tree, message, offset, beams)
  local held = math.min(beams, math.floor((message:len() - offset) / 2))
  if held < 1 then return end
  local first, last = message(offset, 2):le_int() / 100, message(offset + 2 * (held - 1), 2):le_int() / 100
  local table_item = tree:add(message(offset, 2 * held), string.format("bearings: %d, from %.2f to %.2f deg", held, first, last))
  table_item:add(fields["ping.firstBearing"], message(offset, 2), first):set_generated()
  table_item:add(fields["ping.lastBearing"], message(offset + 2 * (held - 1), 2), last):set_generated()
  local before, ascending = -math.huge, true
  for beam = 0, math.min(held, LISTED) - 1 do
    local range = message(offset + 2 * beam, 2)
    local bearing = range:le_int()
    table_item:add_le(fields["ping.bearing"], range):set_text(string.format("beam %d: %.2f deg", beam, bearing / 100))
    ascending, before = ascending and bearing > before, bearing
  end
  say(table_item, expert.identity, ascending, "bearings do not ascend")
  say(table_item, expert.short, held == beams, "the message ends after " .. held .. " of " .. beams .. " bearings")
end

local function add_image(tree, message, values)
  local size = math.min(values.imageSize, message:len() - values.imageOffset)
  if size < 1 then
    say(tree, expert.short, values.imageSize == 0, "the image lies outside the message")
    return
  end
  local image = tree:add(fields["ping.image"], message(values.imageOffset, size))
  local width = data_size_names[values.dataSize] or "?"
  image:set_text(string.format("image: %d rows x %d beams, %s", values.nRanges, values.nBeams, width))
  say(image, expert.short, size == values.imageSize, "the message ends after " .. size .. " of " .. values.imageSize .. " bytes")
  if not bit_set(values.flags, 2) then return end
  local row_size = values.nBeams * (values.dataSize + 1) + 4
  for row = 0, math.min(values.nRanges, LISTED, math.floor((size + row_size - 4) / row_size)) - 1 do
    local range = message(values.imageOffset + row * row_size, 4)
    local item = image:add_le(fields["ping.rowGain"], range)
    item:set_text(string.format("row %d, %.3f m: gain %.0f", row, row * values.rangeResolution, range:le_uint()))
    say(item, expert.identity, range:le_uint() > 0, "a row gain of 0: drivers divide by it")
  end
end

read[0x23] = function(tree, message, header, pinfo)
  local values, items, fire_values, fire_items = {}, {}, {}, {}
  local long = header.version >= 2
  local echo_size = math.min(long and 73 or 37, message:len() - HEADER)
  if echo_size < 1 then
    say(tree, expert.short, false, "a ping result without its fields")
    return "ping result, too short"
  end
  local echo = tree:add(message(HEADER, echo_size), "echoed fire message")
  local at = add_fire(echo, message, header.version, fire_values, fire_items)
  local parts = long and {"ping_start", "ping_attitude", "ping_sound", "ping_time_v2", "ping_grid", "ping_spare", "ping_sizes"}
    or {"ping_start", "ping_sound", "ping_time_v1", "ping_grid", "ping_sizes"}
  for _, part in ipairs(parts) do at = at and add_layout(tree, message, at, part, values, items) end
  if not at then return "ping result, too short" end
  for name, value in pairs({flags = fire_values.flags, extFlags = fire_values.extFlags, range = fire_values.range}) do
    values[name] = value
  end
  if values.dataSize <= 3 then
    tree:add(fields["ping.bits"], message(long and 161 or 97, 1), 8 * (values.dataSize + 1)):set_generated()
  end
  say(tree, expert.identity, header.source ~= 0, "srcDeviceId is 0")
  say(tree, expert.doubt, header.version <= 2, "versions are 0 to 2")
  check_id(items.pingId, values.pingId, pinfo)
  check_values(items, values)
  check_sizes(items, values, message, header)
  add_bearings(tree, message, at, values.nBeams)
  local table_end = at + 2 * values.nBeams
  if values.imageOffset > table_end and values.imageOffset <= message:len() then
    tree:add(fields["ping.filler"], message(table_end, values.imageOffset - table_end))
  end
  add_image(tree, message, values)
  return string.format("ping %.0f: %d x %d, %s, %s", values.pingId, values.nBeams, values.nRanges,
    data_size_names[values.dataSize] or "dataSize " .. values.dataSize, range_text(fire_values))
end

-- The small messages ----------------------------------------------------------------------------------------

local function check_status(tree, items, values, message, header, pinfo)
  say(tree, expert.identity, message:len() == 142, "a status message has 142 bytes, this one " .. message:len())
  say(tree, expert.identity, header.payload == 126, "payloadSize is " .. header.payload .. ", must be 126")
  say(items.deviceId, expert.identity, values.deviceId == header.source, "srcDeviceId is " .. header.source)
  say(items.deviceId, expert.identity, values.deviceId ~= 0, "deviceId is 0")
  say(items.deviceType, expert.doubt, values.deviceType == 1, "an imaging sonar has type 1")
  say(items.partNumber, expert.doubt, values.partNumber == header.part_number, "the header says " .. header.part_number)
  local state = values.status % 8
  say(items.status, expert.identity, state == 2 or state == 3, "the main firmware does not run")
  for _, bit in ipairs({14, 15, 16}) do
    say(items.status, expert.doubt, not bit_set(values.status, bit), status_bits[bit])
  end
  say(items.ipAddr, expert.identity, values.ipAddr ~= 0, "clients connect to ipAddr")
  local address = tostring(message(52, 4):ipv4())
  say(items.ipAddr, expert.note, address == tostring(pinfo.src), "the datagram comes from " .. tostring(pinfo.src))
  say(tree, expert.doubt, not (message(118, 8):le_float() >= 30),
    "temperature 6: drivers warn from 30 deg C on and go to standby at 35")
end

read[0x01] = function(tree, message, header, pinfo)
  local values, items = {}, {}
  if not add_layout(tree, message, HEADER, "status", values, items) then return "status, too short" end
  items.status:add_le(fields["status.status.state"], message(24, 4))
  if values.status % 8 < 2 then items.status:add_le(fields["status.status.pause"], message(24, 4)) end
  for _, bit in ipairs({7, 14, 15, 16}) do items.status:add_le(fields["status.status." .. status_bits[bit]], message(24, 4)) end
  check_status(tree, items, values, message, header, pinfo)
  local product = part_names[values.partNumber] or "part " .. values.partNumber
  return string.format("status: %s %.0f at %s, %s", product, values.deviceId, tostring(message(52, 4):ipv4()),
    values.connectedIpAddr == 0 and "free" or "taken by " .. tostring(message(60, 4):ipv4()))
end

read[0x55] = function(tree, message)
  local values, items = {}, {}
  if not add_layout(tree, message, HEADER, "config", values, items) then return "user configuration, too short" end
  say(tree, expert.note, message:len() == 28, "a user configuration has 28 bytes")
  if values.ipAddr == 0 then return "user configuration: requests the stored one" end
  return "user configuration: " .. tostring(message(16, 4):le_ipv4())
end

read[0x80] = function(tree, message)
  if message:len() == HEADER then return "log: empty" end
  tree:add(fields["log.text"], message(HEADER))
  return "log: " .. message(HEADER, math.min(80, message:len() - HEADER)):string():gsub("[^\32-\126]", ".")
end

read[0xFF] = function(tree, message)
  say(tree, expert.identity, message:len() == HEADER, "a dummy is a bare header")
  return "dummy"
end

read[0x22] = function(tree, message)
  local values, items = {}, {}
  if not add_layout(tree, message, HEADER, "full", values, items) then return "full ping result, too short" end
  return string.format("full ping result: %d x %.0f", values.nBeams, values.nRanges)
end

-- Messages and the stream -----------------------------------------------------------------------------------

local function natural_length(kind, version)  -- of a client's message that announces no payload
  if kind == 0x15 then return version >= 2 and 89 or 53 end
  return kind == 0x55 and 28 or HEADER
end

-- Returns the length of the message at `at`; "more" if more data are needed; nil if no message begins here. After junk only
-- known types are accepted, because in the middle of an image any bytes can look like a header.
local function message_length(tvb, at, to_device, after_junk)
  local left = tvb:len() - at
  if tvb(at, 1):uint() ~= 0x53 or (left >= 2 and tvb(at + 1, 1):uint() ~= 0x4F) then return nil end
  if left < HEADER then return "more" end
  local kind, payload = tvb(at + 6, 2):le_uint(), tvb(at + 10, 4):le_uint()
  local limit = to_device and REQUEST_LIMIT or REPLY_LIMIT - HEADER
  if payload > limit or (after_junk and not message_names[kind]) then return nil end
  if to_device and payload == 0 then return natural_length(kind, tvb(at + 8, 2):le_uint()) end
  return HEADER + payload
end

-- The protocol column shows whether this frame has shown a message before.
local function show(pinfo, text)
  if tostring(pinfo.cols.protocol) == "Oculus" then
    pinfo.cols.info:append("; " .. text)
  else
    pinfo.cols.protocol:set("Oculus")
    pinfo.cols.info:set(text)
  end
  pinfo.cols.info:fence()
end

local function dissect_message(message, pinfo, tree, length)
  local item = tree:add(oculus, message())
  local header_item = item:add(message(0, HEADER), "header")
  local values, items = {}, {}
  add_layout(header_item, message, 0, "header", values, items)
  local header = {source = values.srcDeviceId, kind = values.msgId, version = values.msgVersion, payload = values.payloadSize,
                  part_number = values.partNumber}
  header_item:set_text("header: " .. (message_names[header.kind] or "unknown message") .. ", version " .. header.version)
  item:add(fields.length, message(0, HEADER), length):set_generated()
  say(items.payloadSize, expert.note, header.payload + HEADER == length, "the message nevertheless has " .. length .. " bytes")
  say(item, expert.short, message:len() == length, "cut short by the capture: " .. message:len() .. " of " .. length .. " bytes")
  local summary
  if read[header.kind] then
    summary = read[header.kind](item, message, header, pinfo)
  else
    summary = string.format("message 0x%04x", header.kind)
    say(items.msgId, expert.doubt, false, "a message of unknown kind")
    if message:len() > HEADER then item:add(fields.payload, message(HEADER)) end
  end
  item:set_text("Oculus, " .. summary)
  show(pinfo, summary)
end

local function add_junk(tvb, pinfo, tree, from, to)
  local item = tree:add(oculus, tvb(from, to - from))
  item:set_text("Oculus, " .. to - from .. " bytes that are not a message")
  say(item:add(fields.junk, tvb(from, to - from)), expert.junk, false, "skipped " .. to - from .. " bytes to the next header")
  show(pinfo, to - from .. " bytes of junk")
end

-- Returns the first place from `at` on where a message may begin; the end of the buffer if there is none.
local function next_start(tvb, at, to_device)
  local bytes = tvb:raw()
  while at < tvb:len() do
    local found = bytes:find("S", at + 1, true)  -- the id is the letters SO
    if not found then return tvb:len() end
    at = found - 1
    if message_length(tvb, at, to_device, true) then return at end
    at = at + 1
  end
  return at
end

-- Requests `missing` more bytes and a new call from `at` on; returns false if TCP cannot do so (cut packets, reassembly off).
local function wait_for_more(tvb, pinfo, at, missing)
  if tvb:len() < tvb:reported_len() or pinfo.can_desegment == 0 then return false end
  pinfo.desegment_offset, pinfo.desegment_len = at, missing
  return true
end

-- Returns the number of missing bytes of the message at `at`; nil if none is missing, or if no message begins there.
local function missing_bytes(tvb, at, to_device)
  local length = at < tvb:len() and message_length(tvb, at, to_device, false)
  if length == "more" then return DESEGMENT_ONE_MORE_SEGMENT end
  return length and length > tvb:len() - at and length - (tvb:len() - at) or nil
end

-- dissect_tcp_pdus is not used, because it refuses units shorter than the header, as runs of junk may be. Junk is shown only when
-- the message after it is whole: until then TCP may pass the same bytes again, and nothing must be shown twice.
function oculus.dissector(tvb, pinfo, tree)
  local to_device, at = pinfo.dst_port == pinfo.match_uint, 0
  while at < tvb:len() do
    local length = message_length(tvb, at, to_device, false)
    local start = length and at or next_start(tvb, at, to_device)
    local missing = missing_bytes(tvb, start, to_device)
    if missing and wait_for_more(tvb, pinfo, at, missing) then return tvb:len() end
    if not length then
      add_junk(tvb, pinfo, tree, at, start)
      at = start
    elseif length == "more" then
      return tvb:len()
    else
      local held = math.min(length, tvb:len() - at)
      dissect_message(tvb(at, held):tvb(), pinfo, tree, length)
      at = at + held
    end
  end
  return tvb:len()
end

function oculus_status.dissector(tvb, pinfo, tree)
  if tvb:len() < HEADER or tvb(0, 2):le_uint() ~= 0x4F53 then return 0 end  -- not an Oculus datagram
  dissect_message(tvb, pinfo, tree, tvb:reported_len())
  return tvb:len()
end

-- Ports -----------------------------------------------------------------------------------------------------

oculus.prefs.tcp_ports = Pref.range("TCP ports", "52100", "Where the sonars listen, e.g. 52100,52200-52203", 65535)
oculus.prefs.udp_ports = Pref.range("UDP ports", "52102", "Where the status datagrams go", 65535)

local registered_ports = {}
local function register_ports()
  for name, entry in pairs({tcp = {oculus, oculus.prefs.tcp_ports}, udp = {oculus_status, oculus.prefs.udp_ports}}) do
    local protocol, ports = entry[1], entry[2]
    local ports_table = DissectorTable.get(name .. ".port")
    if registered_ports[name] then ports_table:remove(registered_ports[name], protocol) end
    registered_ports[name] = ports ~= "" and ports or nil
    if registered_ports[name] then ports_table:add(ports, protocol) end
  end
end
function oculus.prefs_changed() register_ports() end
register_ports()
