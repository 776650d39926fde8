-- Wireshark dissector for a DVL A50 or A125: lines of JSON on TCP 16171 (for other ports: "Decode as"), each also as Wireshark's own
-- JSON tree. It shares nothing with the C++ code, so that each can check the other (tests/acceptance/dvl_link_test.py). Layout:
-- docs/protocols/dvl.md; how to install it: clients/wireshark/README.md.

local dvl = Proto("dvl", "DVL A50, A125")
local PORT, LARGEST = 16171, 65536
local json = Dissector.get("json")

local fields = {type = ProtoField.string("dvl.type", "type"), command = ProtoField.string("dvl.command", "command"),
                answers = ProtoField.string("dvl.responseTo", "response to"), text = ProtoField.string("dvl.text", "text")}
-- Key, name, meaning.
local numbers = {
  {"vx", "vx", "velocity ahead [m/s]"}, {"vy", "vy", "velocity to starboard [m/s]"}, {"vz", "vz", "velocity down [m/s]"},
  {"fom", "fom", "standard deviation of the velocity [m/s]"}, {"altitude", "altitude", "altitude [m]"},
  {"time_of_validity", "timeOfValidity", "time of the reflection [us]"}, {"x", "x", "position ahead [m]"},
  {"y", "y", "position to starboard [m]"}, {"z", "z", "position down [m]"},
}
local flags = {{"velocity_valid", "valid", "velocity is valid"}, {"success", "success", "command succeeded"}}
for _, row in ipairs(numbers) do fields[row[2]] = ProtoField.double("dvl." .. row[2], row[3]) end
for _, row in ipairs(flags) do fields[row[2]] = ProtoField.bool("dvl." .. row[2], row[3]) end
local all = {}
for _, field in pairs(fields) do all[#all + 1] = field end
dvl.fields = all
local junk = ProtoExpert.new("dvl.expert.junk", "Not an object of JSON", expert.group.PROTOCOL, expert.severity.WARN)
dvl.experts = {junk}

local function line(tvb, pinfo, root)
  local tree, text = root:add(dvl, tvb), tvb:raw()
  pinfo.cols.protocol = "DVL"
  if not text:match("^%s*{.*}%s*$") then
    tree:add(fields.text, tvb(0))
    tree:add_proto_expert_info(junk)
    return
  end
  local function word(key) return text:match('"' .. key .. '"%s*:%s*"([^"]*)"') end
  local kind, command, answers = word("type"), word("command"), word("response_to")
  if kind then tree:add(fields.type, tvb(0), kind) end
  if command then tree:add(fields.command, tvb(0), command) end
  if answers then tree:add(fields.answers, tvb(0), answers) end
  local flat = text:gsub("%b[]", "")  -- transducers and covariances have keys of their own
  for _, row in ipairs(numbers) do
    local value = tonumber(flat:match('"' .. row[1] .. '"%s*:%s*(%-?[%d%.eE+-]+)'))
    if value then tree:add(fields[row[2]], tvb(0), value) end
  end
  for _, row in ipairs(flags) do
    local value = flat:match('"' .. row[1] .. '"%s*:%s*(%a+)')
    if value then tree:add(fields[row[2]], tvb(0), value == "true") end
  end
  json:call(tvb, pinfo, tree)
  pinfo.cols.protocol, pinfo.cols.info = "DVL", command or (answers and "response to " .. answers) or kind or "unknown"
end

function dvl.dissector(tvb, pinfo, root)
  local at, length = 0, tvb:len()
  while at < length do
    local rest = tvb(at):tvb()
    local last = rest:raw():find("\n", 1, true)
    if not last and pinfo.dst_port == PORT then last = rest:len() end  -- commands may lack an end of line
    if not last and rest:len() < LARGEST then
      pinfo.desegment_offset, pinfo.desegment_len = at, DESEGMENT_ONE_MORE_SEGMENT
      return length
    end
    last = last or rest:len()
    line(rest(0, last):tvb(), pinfo, root)
    at = at + last
  end
  return length
end

DissectorTable.get("tcp.port"):add(PORT, dvl)
