-- Wireshark dissector for a NORBIT WBMS: commands on TCP 2209, bathymetry on 2210, water column on 2211 (for other ports: "Decode as").
-- It shares nothing with the C++ code, so that each can check the other (tests/acceptance/norbit_link_test.py). Layout:
-- docs/protocols/norbit.md; how to install it: clients/wireshark/README.md.

local norbit = Proto("norbit", "Norbit WBMS")
local HEAD, BATHYMETRY, BEAM, COLUMN, LARGEST = 24, 112, 20, 192, 1200000

-- Offset, size, kind, name, meaning.
local shared = {
  {24, 4, "float", "soundSpeed", "sound velocity [m/s]"}, {28, 4, "float", "sampleRate", "sample rate [Hz]"}, {32, 4, "uint32", "beams", "beams"},
  {40, 8, "double", "time", "time [s]"},
}
local rows = {
  [1] = {
    {36, 4, "uint32", "ping", "ping"}, {56, 4, "float", "rate", "ping rate [Hz]"}, {63, 1, "uint8", "mode", "mode"},
    {76, 4, "float", "gain", "gain"}, {80, 4, "float", "frequency", "frequency [Hz]"}, {88, 4, "float", "pulse", "pulse [s]"},
    {104, 4, "float", "swath", "opening angle [rad]"},
  },
  [2] = {
    {36, 4, "uint32", "samples", "samples of a beam"}, {48, 4, "uint32", "pixelType", "type of pixels"}, {52, 4, "int32", "firstSample", "first sample"},
    {56, 4, "float", "gain", "gain"}, {68, 4, "float", "swath", "opening angle [rad]"}, {72, 4, "float", "frequency", "frequency [kHz]"},
    {80, 4, "float", "pulse", "pulse [s]"}, {100, 4, "float", "rate", "ping rate [Hz]"}, {108, 4, "uint32", "ping", "ping"},
    {124, 4, "int32", "gainBegin", "gain begins at sample"}, {128, 4, "float", "gainBeginDb", "gain there [dB]"},
    {132, 4, "int32", "gainEnd", "gain ends at sample"}, {136, 4, "float", "gainEndDb", "gain there [dB]"}, {153, 1, "uint8", "mode", "mode"},
  },
}
local beam = {
  {0, 4, "uint32", "sample", "sample number"}, {4, 4, "float", "angle", "angle [rad]"}, {12, 4, "float", "intensity", "intensity"},
  {18, 1, "uint8", "quality", "quality flags"},
}
local fields = {type = ProtoField.uint32("norbit.type", "type"), size = ProtoField.uint32("norbit.size", "size"),
                version = ProtoField.uint32("norbit.version", "version"), crc = ProtoField.uint32("norbit.crc", "CRC-32", base.HEX),
                pixels = ProtoField.bytes("norbit.pixels", "pixels"), text = ProtoField.string("norbit.text", "text"),
                first = ProtoField.float("norbit.firstAngle", "first angle [rad]"), last = ProtoField.float("norbit.lastAngle", "last angle [rad]")}
for _, list in ipairs({shared, rows[1], rows[2], beam}) do
  for _, row in ipairs(list) do fields[row[4]] = fields[row[4]] or ProtoField[row[3]]("norbit." .. row[4], row[5]) end
end
local all = {}
for _, field in pairs(fields) do all[#all + 1] = field end
norbit.fields = all
local broken = ProtoExpert.new("norbit.expert.broken", "Sizes contradict each other", expert.group.MALFORMED, expert.severity.ERROR)
local junk = ProtoExpert.new("norbit.expert.junk", "Not the start of a packet", expert.group.PROTOCOL, expert.severity.WARN)
norbit.experts = {broken, junk}

local function add(tree, list, tvb, at)
  for _, row in ipairs(list) do tree:add_le(fields[row[4]], tvb(at + row[1], row[2])) end
end

local function packet(tvb, pinfo, root)
  local tree, kind, size = root:add(norbit, tvb), tvb(4, 4):le_uint(), tvb:len()
  tree:add_le(fields.type, tvb(4, 4))
  tree:add_le(fields.size, tvb(8, 4))
  tree:add_le(fields.version, tvb(12, 4))
  tree:add_le(fields.crc, tvb(20, 4))
  pinfo.cols.protocol = "Norbit"
  if rows[kind] == nil or size < (kind == 1 and BATHYMETRY or COLUMN) then
    tree:add_proto_expert_info(broken)
    return
  end
  add(tree, shared, tvb, 0)
  add(tree, rows[kind], tvb, 0)
  local beams = tvb(32, 4):le_uint()
  if kind == 1 then
    if size ~= BATHYMETRY + BEAM * beams then
      tree:add_proto_expert_info(broken)
      return
    end
    for i = 0, beams - 1 do
      local at = BATHYMETRY + BEAM * i
      add(tree:add(norbit, tvb(at, BEAM), "beam " .. i), beam, tvb, at)
    end
    pinfo.cols.info = string.format("ping %d: bathymetry, %d beams", tvb(36, 4):le_uint(), beams)
    return
  end
  local samples = tvb(36, 4):le_uint()
  local kind_of_pixels = tvb(48, 4):le_uint()  -- 2: uint16, 3: int16
  if kind_of_pixels < 2 or kind_of_pixels > 3 or beams == 0 or size ~= COLUMN + 2 * beams * samples + 4 * beams then
    tree:add_proto_expert_info(broken)
    return
  end
  if samples > 0 then tree:add(fields.pixels, tvb(COLUMN, 2 * beams * samples)) end
  tree:add_le(fields.first, tvb(size - 4 * beams, 4))
  tree:add_le(fields.last, tvb(size - 4, 4))
  pinfo.cols.info = string.format("ping %d: water column, %d x %d", tvb(108, 4):le_uint(), beams, samples)
end

function norbit.dissector(tvb, pinfo, root)
  local at, length = 0, tvb:len()
  if pinfo.src_port == 2209 or pinfo.dst_port == 2209 then
    root:add(norbit, tvb):add(fields.text, tvb(0))
    pinfo.cols.protocol, pinfo.cols.info = "Norbit", tvb(0):string()
    return length
  end
  while at < length do
    if length - at < HEAD then
      pinfo.desegment_offset, pinfo.desegment_len = at, DESEGMENT_ONE_MORE_SEGMENT
      return length
    end
    local size = tvb(at + 8, 4):le_uint()
    if tvb(at, 4):le_uint() ~= 0xDEADBEEF or size < HEAD or size > LARGEST then
      root:add(norbit, tvb(at)):add_proto_expert_info(junk)
      return length
    end
    if length - at < size then
      pinfo.desegment_offset, pinfo.desegment_len = at, size - (length - at)
      return length
    end
    packet(tvb(at, size):tvb(), pinfo, root)
    at = at + size
  end
  return length
end

for port = 2209, 2211 do DissectorTable.get("tcp.port"):add(port, norbit) end
