-- Wireshark dissector for the beam-formed data of a Kongsberg Mesotech M3, TCP 20001 (for other ports: "Decode as"). It shares
-- nothing with the C++ code, so that each can check the other (tests/acceptance/m3_link_test.py). Layout: docs/protocols/m3.md;
-- how to install it: clients/wireshark/README.md.

local m3 = Proto("m3", "Mesotech M3")
local HEAD, DATA, FOOT, SAMPLE, LARGEST = 56, 8512, 44, 8, 33554432

-- Fields of the data header: offset, size, kind, name, meaning.
local rows = {
  {0, 4, "uint32", "version", "version of the header"}, {4, 4, "uint32", "sonarId", "sonar"}, {8, 4, "uint32", "sonarInfo", "information"},
  {40, 4, "uint32", "seconds", "time [s]"}, {44, 4, "uint32", "milliseconds", "time [ms]"}, {48, 4, "float", "soundSpeed", "sound speed [m/s]"},
  {52, 4, "uint32", "samples", "samples of a beam"}, {56, 4, "float", "near", "near range [m]"}, {60, 4, "float", "far", "far range [m]"},
  {64, 4, "float", "windowStart", "window start [s]"}, {68, 4, "float", "windowLength", "window length [s]"}, {72, 2, "uint16", "beams", "beams"},
  {74, 2, "uint16", "processing", "processing"}, {4172, 4, "float", "interval", "sample interval [s]"}, {4180, 4, "uint32", "mode", "mode"},
  {4200, 4, "uint32", "frequency", "frequency [Hz]"}, {4204, 4, "uint32", "pulse", "pulse [us]"}, {4208, 4, "uint32", "ping", "ping"},
  {4212, 4, "float", "bandwidth", "bandwidth [Hz]"}, {4216, 4, "float", "resolution", "resolution [m]"}, {4220, 4, "float", "rate", "rate [Hz]"},
  {4224, 128, "stringz", "application", "application"}, {4352, 64, "stringz", "pulseName", "pulse"}, {4416, 2, "int16", "gainA", "gain law A"},
  {4418, 2, "int16", "gainB", "gain law B [dB/km]"}, {4420, 4, "float", "gainC", "gain law C [dB]"}, {4424, 4, "float", "gainL", "gain law L [dB]"},
  {4428, 4, "float", "heading", "heading [degrees]"}, {4436, 4, "float", "pitch", "pitch [degrees]"}, {4440, 4, "float", "roll", "roll [degrees]"},
  {4444, 4, "float", "depth", "depth [m]"}, {4448, 4, "float", "temperature", "temperature"}, {4496, 4, "float", "transmit", "begin of the pulse [s]"},
  {4501, 1, "uint8", "headStatus", "status of the head"}, {4564, 2, "uint16", "firstElement", "first element"},
  {4566, 2, "uint16", "lastElement", "last element"},
}
local fields = {size = ProtoField.uint32("m3.size", "size of the body"), type = ProtoField.uint16("m3.type", "type", base.HEX),
                first = ProtoField.float("m3.firstAngle", "first angle [degrees]"), last = ProtoField.float("m3.lastAngle", "last angle [degrees]"),
                image = ProtoField.bytes("m3.samplesOfBeams", "I and Q")}
for _, row in ipairs(rows) do fields[row[4]] = ProtoField[row[3]]("m3." .. row[4], row[5]) end
local all = {}
for _, field in pairs(fields) do all[#all + 1] = field end
m3.fields = all
local broken = ProtoExpert.new("m3.expert.broken", "Sizes contradict each other", expert.group.MALFORMED, expert.severity.ERROR)
local junk = ProtoExpert.new("m3.expert.junk", "Not the start of a packet", expert.group.PROTOCOL, expert.severity.WARN)
m3.experts = {broken, junk}

local function begins(tvb, at)
  for word = 0, 3 do
    if tvb(at + 2 * word, 2):le_uint() ~= 0x8000 then return false end
  end
  return tvb(at + 52, 4):le_uint() <= LARGEST
end

local function packet(tvb, pinfo, root)
  local size = tvb(52, 4):le_uint()
  local tree = root:add(m3, tvb)
  tree:add_le(fields.type, tvb(8, 2))
  tree:add_le(fields.size, tvb(52, 4))
  if size < DATA then
    tree:add_proto_expert_info(broken)
    return
  end
  for _, row in ipairs(rows) do
    local range = tvb(HEAD + row[1], row[2])
    if row[3] == "stringz" then tree:add(fields[row[4]], range) else tree:add_le(fields[row[4]], range) end
  end
  local beams, samples = tvb(HEAD + 72, 2):le_uint(), tvb(HEAD + 52, 4):le_uint()
  if beams > 0 and beams <= 1024 then
    tree:add_le(fields.first, tvb(HEAD + 76, 4))
    tree:add_le(fields.last, tvb(HEAD + 76 + 4 * (beams - 1), 4))
  end
  if size > DATA then tree:add(fields.image, tvb(HEAD + DATA, size - DATA)) end
  if beams > 1024 or size ~= DATA + SAMPLE * beams * samples or tvb(HEAD + size, 4):le_uint() ~= size then
    tree:add_proto_expert_info(broken)
  end
  pinfo.cols.protocol = "M3"
  pinfo.cols.info = string.format("ping %d: %d x %d, %g m", tvb(HEAD + 4208, 4):le_uint(), beams, samples, tvb(HEAD + 60, 4):le_float())
end

function m3.dissector(tvb, pinfo, root)
  local at, length = 0, tvb:len()
  while at < length do
    if length - at < HEAD then
      pinfo.desegment_offset, pinfo.desegment_len = at, DESEGMENT_ONE_MORE_SEGMENT
      return length
    end
    if not begins(tvb, at) then
      root:add(m3, tvb(at)):add_proto_expert_info(junk)
      return length
    end
    local whole = HEAD + tvb(at + 52, 4):le_uint() + FOOT
    if length - at < whole then
      pinfo.desegment_offset, pinfo.desegment_len = at, whole - (length - at)
      return length
    end
    packet(tvb(at, whole):tvb(), pinfo, root)
    at = at + whole
  end
  return length
end

DissectorTable.get("tcp.port"):add(20001, m3)
