-- Wireshark dissector for the images of a Water Linked Sonar 3D-15, UDP 4747 (for other ports: "Decode as"). It shares nothing with
-- the C++ code, so that each can check the other (tests/acceptance/waterlinked_link_test.py). Layouts:
-- docs/protocols/waterlinked.md; how to install it: clients/wireshark/README.md.

local rip = Proto("waterlinked", "Water Linked Sonar 3D-15")
local OVERHEAD, LARGEST = 12, 1048576

local headers = {[1] = "seconds", [2] = "nanos"}
-- number of a field -> name, kind; "header" has the sequence and the time
local kinds = {
  RangeImage = {[1] = {"header", "header"}, [2] = {"speedOfSound", "float"}, [3] = {"range", "float"}, [4] = {"frequency", "uint"},
    [5] = {"width", "uint"}, [6] = {"height", "uint"}, [7] = {"fovHorizontal", "float"}, [8] = {"fovVertical", "float"},
    [9] = {"pixelScale", "float"}, [10] = {"pixels", "bytes"}},
  BitmapImageGreyscale8 = {[1] = {"header", "header"}, [2] = {"speedOfSound", "float"}, [3] = {"range", "float"},
    [4] = {"frequency", "uint"}, [5] = {"type", "uint"}, [6] = {"width", "uint"}, [7] = {"height", "uint"},
    [8] = {"fovHorizontal", "float"}, [9] = {"fovVertical", "float"}, [10] = {"pixels", "bytes"}},
  ImuBatch = {[1] = {"batchSequence", "uint"}, [2] = {"samples", "uint"}, [4] = {"specificForce", "bytes"},
    [5] = {"rateOfTurn", "bytes"}},
}

local fields = {
  magic = ProtoField.string("waterlinked.magic", "magic"), length = ProtoField.uint32("waterlinked.length", "length"),
  crc = ProtoField.uint32("waterlinked.crc", "CRC-32", base.HEX), kind = ProtoField.string("waterlinked.kind", "message"),
  sequence = ProtoField.uint32("waterlinked.sequence", "sequence"), time = ProtoField.double("waterlinked.time", "time of the shot [s]"),
}
for _, described in pairs(kinds) do
  for _, row in pairs(described) do
    local make = ({float = ProtoField.float, uint = ProtoField.uint32, bytes = ProtoField.bytes})[row[2]]
    if make and not fields[row[1]] then fields[row[1]] = make("waterlinked." .. row[1], row[1]) end
  end
end
local all = {}
for _, field in pairs(fields) do all[#all + 1] = field end
rip.fields = all
local broken = ProtoExpert.new("waterlinked.expert.broken", "Not a packet", expert.group.MALFORMED, expert.severity.ERROR)
rip.experts = {broken}

-- Byte strings ----------------------------------------------------------------------------------------------------

local function varint(text, at)
  local value, scale = 0, 1
  for i = at, math.min(at + 9, #text) do
    local byte = text:byte(i)
    value = value + (byte % 128) * scale
    if byte < 128 then return value, i + 1 end
    scale = scale * 128
  end
end

-- Returns the content of a raw Snappy block; nil if the bytes are not a valid block.
local function unpacked(text)
  local size, at = varint(text, 1)
  if not size or size > LARGEST then return nil end
  local out, n = {}, 0
  while at <= #text do
    local tag = text:byte(at)
    local kind, upper = tag % 4, math.floor(tag / 4)
    at = at + 1
    if kind == 0 then
      local length = upper + 1
      if upper >= 60 then
        local more = upper - 59
        if at + more - 1 > #text then return nil end
        length = 1
        for b = 0, more - 1 do length = length + text:byte(at + b) * 256 ^ b end
        at = at + more
      end
      if at + length - 1 > #text or n + length > size then return nil end
      for i = at, at + length - 1 do n = n + 1; out[n] = text:byte(i) end
      at = at + length
    else
      local bytes = kind == 1 and 1 or kind == 2 and 2 or 4
      if at + bytes - 1 > #text then return nil end
      local offset, length = 0, upper + 1
      for b = 0, bytes - 1 do offset = offset + text:byte(at + b) * 256 ^ b end
      if kind == 1 then offset, length = offset + math.floor(tag / 32) * 256, upper % 8 + 4 end
      at = at + bytes
      if offset == 0 or offset > n or n + length > size then return nil end
      for _ = 1, length do n = n + 1; out[n] = out[n - offset] end
    end
  end
  if n ~= size then return nil end
  local parts = {}
  for i = 1, n, 4096 do parts[#parts + 1] = string.char(table.unpack(out, i, math.min(i + 4095, n))) end
  return table.concat(parts)
end

-- Calls take(number, value) for each protobuf field; fixed-size numbers are bytes. Returns false if `text` is not a message.
local function each(text, take)
  local at = 1
  while at <= #text do
    local key, value
    key, at = varint(text, at)
    if not key then return false end
    local number, kind = math.floor(key / 8), key % 8
    if kind == 0 then
      value, at = varint(text, at)
    elseif kind == 2 or kind == 5 or kind == 1 then
      local size = kind == 5 and 4 or 8
      if kind == 2 then size, at = varint(text, at) end
      if not size or at + size - 1 > #text then return false end
      value, at = text:sub(at, at + size - 1), at + size
    end
    if not value then return false end
    take(number, value)
  end
  return true
end

local function bytes_of(text) return ByteArray.new((text:gsub(".", function(c) return string.format("%02x", c:byte()) end))) end

-- Messages --------------------------------------------------------------------------------------------------------

local function show(tree, described, content, values)
  return each(content, function(number, value)
    local row = described[number]
    if not row then return end
    local name, kind = row[1], row[2]
    if kind == "header" then
      each(value, function(n, inside)
        if n == 2 then values.sequence = inside end
        if n == 1 then each(inside, function(m, v) values[headers[m]] = v end) end
      end)
    elseif kind == "bytes" then
      values[name] = #value
      tree:add(fields[name], bytes_of(value):tvb(name)())
    elseif kind == "float" and #value == 4 then
      values[name] = bytes_of(value):tvb(name)():le_float()
      tree:add(fields[name], values[name])
    elseif kind == "uint" then
      values[name] = value
      tree:add(fields[name], value)
    end
  end)
end

local function packet(tvb, item, info)
  local version = tvb(0, 4):string()
  if version ~= "RIP1" and version ~= "RIP2" then return false end
  item:add(fields.magic, tvb(0, 4))
  item:add_le(fields.length, tvb(4, 4))
  item:add_le(fields.crc, tvb(tvb:len() - 4, 4))
  if tvb(4, 4):le_uint() ~= tvb:len() then return false end
  local content = tvb:raw(8, tvb:len() - OVERHEAD)
  if version == "RIP2" then content = unpacked(content) end
  local kind, message
  local read = content and each(content, function(number, any)
    if number ~= 1 then return end
    each(any, function(n, value)
      if n == 1 then kind = value:match("([^.]*)$") else message = value end
    end)
  end)
  if not read or not kind or not message then return false end
  item:add(fields.kind, kind)
  if not kinds[kind] then return true end
  local values = {}
  if not show(item, kinds[kind], message, values) then return false end
  if values.sequence then item:add(fields.sequence, values.sequence) end
  if values.seconds then item:add(fields.time, values.seconds + (values.nanos or 0) * 1e-9) end
  info:set(values.width and string.format("%s %d: %d x %d to %g m", kind, values.sequence or 0, values.width, values.height, values.range)
    or string.format("%s %d: %d samples", kind, values.batchSequence or 0, values.samples or 0))
  return true
end

function rip.dissector(tvb, pinfo, tree)
  if tvb:len() < OVERHEAD then return 0 end
  pinfo.cols.protocol = "3D-15"
  local item = tree:add(rip, tvb())
  if not packet(tvb, item, pinfo.cols.info) then item:add_proto_expert_info(broken, "these bytes are no packet of images") end
  return tvb:len()
end

DissectorTable.get("udp.port"):add(4747, rip)
