-- Wireshark dissector for the serial protocol of a Tritech Micron, wrapped in TCP 4001 (for other ports: "Decode as"). It shares
-- nothing with the C++ code, so that each can check the other (tests/acceptance/micron_link_test.py). Layout:
-- docs/protocols/micron.md; how to install it: clients/wireshark/README.md.

local micron = Proto("micron", "Tritech Micron")
local HEAD, LEFT_OUT, LARGEST = 13, 6, 4096

local names = {
  [1] = "mtVersionData", [2] = "mtHeadData", [4] = "mtAlive", [6] = "mtBBUserData", [16] = "mtReBoot", [19] = "mtHeadCommand",
  [23] = "mtSendVersion", [24] = "mtSendBBUser", [25] = "mtSendData", [57] = "mtFpgaVersionData", [63] = "mtFpgaCalibrationData",
  [66] = "mtStopAlives",
}
-- Payloads: offset, size, kind, name.
local payloads = {
  [1] = {{0, 1, "uint8", "software"}, {1, 1, "uint8", "info"}, {2, 2, "uint16", "serial"}, {4, 4, "uint32", "programLength"},
    {8, 2, "uint16", "programSum"}, {10, 1, "uint8", "nodeId"}},
  [2] = {{0, 2, "uint16", "total"}, {2, 1, "uint8", "deviceType"}, {3, 1, "uint8", "headStatus"}, {4, 1, "uint8", "sweep"},
    {5, 2, "uint16", "control"}, {7, 2, "uint16", "range"}, {9, 4, "uint32", "carrier"}, {13, 1, "uint8", "gain"},
    {14, 2, "uint16", "slope"}, {16, 1, "uint8", "adSpan"}, {17, 1, "uint8", "adLow"}, {18, 2, "uint16", "headingOffset"},
    {20, 2, "uint16", "interval"}, {22, 2, "uint16", "left"}, {24, 2, "uint16", "right"}, {26, 1, "uint8", "step"},
    {27, 2, "uint16", "bearing"}, {29, 2, "uint16", "dataBytes"}},
  [4] = {{0, 1, "uint8", "state"}, {1, 4, "uint32", "time"}, {5, 2, "uint16", "bearing"}, {7, 1, "uint8", "headInfo"}},
  [19] = {{0, 1, "uint8", "kind"}, {1, 2, "uint16", "control"}, {3, 1, "uint8", "deviceType"}, {22, 2, "uint16", "range"},
    {24, 2, "uint16", "left"}, {26, 2, "uint16", "right"}, {28, 1, "uint8", "adSpan"}, {29, 1, "uint8", "adLow"},
    {30, 1, "uint8", "gain"}, {36, 1, "uint8", "motorTime"}, {37, 1, "uint8", "step"}, {38, 2, "uint16", "interval"},
    {40, 2, "uint16", "bins"}},
  [25] = {{0, 4, "uint32", "time"}},
}
local fields = {
  length = ProtoField.uint16("micron.length", "length"), id = ProtoField.uint8("micron.id", "id", base.DEC, names),
  source = ProtoField.uint8("micron.source", "source"), destination = ProtoField.uint8("micron.destination", "destination"),
  line = ProtoField.bytes("micron.line", "bins of a scan line"),
}
for _, rows in pairs(payloads) do
  for _, row in ipairs(rows) do fields[row[4]] = fields[row[4]] or ProtoField[row[3]]("micron." .. row[4], row[4]) end
end
local all = {}
for _, field in pairs(fields) do all[#all + 1] = field end
micron.fields = all
local broken = ProtoExpert.new("micron.expert.broken", "Lengths contradict each other", expert.group.MALFORMED, expert.severity.ERROR)
local junk = ProtoExpert.new("micron.expert.junk", "Not the start of a message", expert.group.PROTOCOL, expert.severity.WARN)
micron.experts = {broken, junk}

local function begins(tvb, at)
  local length = tvb(at + 5, 2):le_uint()
  return tvb(at, 1):uint() == 0x40 and tonumber(tvb(at + 1, 4):string(), 16) == length and length >= 8 and length <= LARGEST
end

local function message(tvb, pinfo, root)
  local id = tvb(10, 1):uint()
  local tree = root:add(micron, tvb)
  tree:add_le(fields.length, tvb(5, 2))
  tree:add(fields.source, tvb(7, 1))
  tree:add(fields.destination, tvb(8, 1))
  tree:add(fields.id, tvb(10, 1))
  local size = tvb:len() - HEAD - 1
  for _, row in ipairs(payloads[id] or {}) do
    if row[1] + row[2] <= size then tree:add_le(fields[row[4]], tvb(HEAD + row[1], row[2])) end
  end
  if id == 2 and size > 31 then
    tree:add(fields.line, tvb(HEAD + 31, size - 31))
    if tvb(HEAD, 2):le_uint() ~= size or tvb(HEAD + 29, 2):le_uint() ~= size - 31 then tree:add_proto_expert_info(broken) end
  end
  if tvb(tvb:len() - 1, 1):uint() ~= 0x0A then tree:add_proto_expert_info(broken) end
  pinfo.cols.protocol = "Micron"
  pinfo.cols.info:append(" " .. (names[id] or "message " .. id))
end

function micron.dissector(tvb, pinfo, root)
  local at, length = 0, tvb:len()
  pinfo.cols.info = ""
  while at < length do
    if length - at < HEAD then
      pinfo.desegment_offset, pinfo.desegment_len = at, DESEGMENT_ONE_MORE_SEGMENT
      return length
    end
    if not begins(tvb, at) then
      root:add(micron, tvb(at)):add_proto_expert_info(junk)
      return length
    end
    local whole = tvb(at + 5, 2):le_uint() + LEFT_OUT
    if length - at < whole then
      pinfo.desegment_offset, pinfo.desegment_len = at, whole - (length - at)
      return length
    end
    message(tvb(at, whole):tvb(), pinfo, root)
    at = at + whole
  end
  return length
end

DissectorTable.get("tcp.port"):add(4001, micron)
