#include "protocol/fault_kinds.hpp"

#include <algorithm>

#include "core/base/letters.hpp"
#include "protocol/control/answers.hpp"

namespace sonar {
namespace {

using E = FaultEffect;
using S = FaultStage;
using F = protocol::FieldName;
using P = FaultParameter;

constexpr P whole(std::string_view name, std::string_view value, double lowest, double highest) {
  return {.name = name, .value = value, .lowest = lowest, .highest = highest, .whole = true};
}
constexpr P offset_part{"fraction", "0.5", 0, 1};
constexpr P end_how{.name = "how", .value = "fin", .words = "fin reset"};

// Durations lie on both sides of the watchdogs of known drivers: 2, 4.5, 5, 10, 35, 90 s.
// clang-format off
constexpr FaultKind table[] = {
    // ---- link
    {"L01", "port-closed", 1, S::link, E::close_ports, "The TCP ports refuse connections while the status message continues.",
     "keeps trying, with growing pauses; never exits", 6, {},
     {P{.name = "close-existing", .value = "yes", .words = "yes no"}}, "ports"},
    {"L02", "close-at-boundary", 1, S::link, E::end, "The connection ends (FIN) before a ping.",
     "reconnects and sends its settings again within 3 s", 0, {}, {P{"fraction", "0", 0, 1}, end_how}, "end"},
    {"L03", "close-mid-message", 1, S::link, E::end, "The connection ends (FIN) in the middle of a ping.",
     "discards the partial ping, reconnects, never joins old and new bytes", 0, {}, {offset_part, end_how}, "end"},
    {"L04", "reset", 1, S::link, E::end, "The connection is reset (RST).", "as after close-at-boundary", 0, {},
     {P{"fraction", "0", 0, 1}, P{.name = "how", .value = "reset", .words = "reset fin"}}, "end"},
    {"L05", "silent-open", 1, S::link, E::withhold, "The connection stays open and nothing is sent.",
     "notices within 2 s or 3 periods, reports stale data, then reconnects", 6, {},
     {P{.name = "keep-status", .value = "yes", .words = "yes no"}}, "flow"},
    {"L06", "vanished-peer", 1, S::link, E::harness, "No packet passes in either direction.",
     "has a timer of its own of at most 5 s", 6, {}, {}, {}},
    {"L07", "accepted-not-served", 1, S::clients, E::leave_waiting, "New connections are accepted and get no byte.",
     "times out without a first byte and reports that the device may be busy", 6, {}, {}, "admission"},
    {"L09", "no-answer", 2, S::link, E::harness, "Connection requests get no answer, or host unreachable.",
     "limits the time of an attempt to connect", 6, {}, {}, {}},
    {"L10", "device-restart", 1, S::link, E::power_cycle,
     "The device restarts: connections end, status stops, then returns; ping number, clock and settings are those of power-up.",
     "recovers without an operator and sends its settings again", 0, {}, {P{"boot-s", "20", 0, 600}, P{"gap-s", "1", -30, 600},
     P{.name = "how", .value = "reset", .words = "reset fin"}}, "ports"},
    {"L11", "flapping", 2, S::link, E::flap, "The link goes up and down.", "backs off; leaks no descriptor", 20, {},
     {P{"up-s", "3", 0.1, 600}, P{"down-s", "1", 0.1, 600}}, "ports"},
    {"L13", "thin-link", 1, S::link, E::thin_link, "Bytes leave at a limited rate.", "works at a lower rate; no queue grows", 10,
     {}, {P{"mbit-per-s", "2", 0.01, 10000}}, "pace"},
    {"L14", "latency", 1, S::link, E::delay, "Every ping arrives late.", "stamps stay those of the device", 10, {},
     {P{"ms", "300", 0, 10000}, P{"jitter-ms", "0", 0, 10000}}, "delay"},
    {"L16", "mtu-hole", 2, S::link, E::harness, "Large packets vanish.", "reports a problem of the link", 6, {}, {}, {}},
    {"L17", "address-lost", 1, S::link, E::harness, "The address is withdrawn and returns.",
     "keeps the connection or reconnects within 3 s of its return", 6, {}, {}, {}},
    {"L18", "one-way", 1, S::link, E::harness, "Messages of the host are lost.", "reports that commands have no effect", 6, {}, {}, {}},
    {"L19", "loss-above-rate", 2, S::link, E::harness, "Packets are lost above a rate.", "does not stall", 6, {}, {}, {}},

    // ---- shape of the stream: no driver may notice
    {"S01", "slices", 1, S::stream, E::slices, "Pings are written in small pieces.", "loses nothing", 5, {},
     {whole("bytes", "701", 1, 65535)}, "pieces"},
    {"S02", "split-header", 1, S::stream, E::split_header, "The header of a ping is written in two parts.", "loses nothing", 0, {},
     {whole("offset", "8", 1, 64), P{"ms", "50", 0, 10000}}, "pieces"},
    {"S03", "coalesced", 1, S::stream, E::coalesce, "Several pings are written together.", "loses nothing", 5, {},
     {whole("pings", "4", 2, 32)}, "delay"},
    {"S04", "burst", 1, S::stream, E::burst, "Pings are held back, then sent one after the other.", "uses the stamps of the device",
     2, {}, {}, "delay"},
    {"S06", "pause-inside", 1, S::stream, E::pause, "Writing stops inside a ping for a while.",
     "waits or reconnects; never loses its position in the stream", 0, {}, {P{"seconds", "1", 0.001, 120}, offset_part}, "pieces"},
    {"S07", "largest-frame", 1, S::device, E::change_settings, "The device sends the largest pings it can.",
     "has no buffer smaller than that", 5, {}, {P{.name = "what", .value = "largest", .words = "largest"}}, "settings"},

    // ---- framing
    {"F01", "garbage-between", 1, S::framing, E::insert, "Bytes that belong to no message precede a ping.",
     "finds the next message; limits its log", 0, {}, {whole("bytes", "16", 1, 4096),
     P{.name = "fill", .value = "zero", .words = "zero random S SO ascii"}}, "front"},
    {"F02", "bad-magic", 1, S::framing, E::set_field, "The first word of a header is wrong.", "skips exactly that message", 0,
     F::magic, {whole("value", "0xDEAD", 0, 4294967295.0)}, "magic"},
    {"F03", "length-short", 1, S::framing, E::add_to_field, "The header states fewer bytes than follow.", "finds the next message",
     0, F::payload_size, {whole("add", "-16", -65536, -1)}, "payload_size"},
    {"F04", "length-long", 1, S::framing, E::add_to_field, "The header states more bytes than follow.",
     "loses at most the next ping", 0, F::payload_size, {whole("add", "16", 1, 65536)}, "payload_size"},
    {"F05", "length-absurd", 1, S::framing, E::set_field, "The header states an impossible length.",
     "refuses it and allocates nothing", 0, F::payload_size, {whole("value", "0xFFFFFFF0", 0, 4294967295.0)}, "payload_size"},
    {"F06", "short-last-row", 1, S::framing, E::cut_row, "The last row of the image is missing.",
     "accepts or rejects it; loses at most one ping", 0, F::image_size,
     {P{.name = "lengths", .value = "undeclared", .words = "undeclared declared"}}, "payload_size"},
    {"F07", "image-size-lie", 1, S::framing, E::add_to_field, "The stated size of the image is not that of its rows.",
     "rejects the ping", 0, F::image_size, {whole("add", "1", -65536, 65536)}, "image_size"},
    {"F08", "image-offset-lie", 1, S::framing, E::set_field, "The image is stated to begin elsewhere.",
     "checks it against the message", 0, F::image_offset, {whole("value", "0", 0, 4294967295.0)}, "image_offset"},
    {"F09", "message-size-lie", 2, S::framing, E::add_to_field, "Two fields of length disagree.", "follows one rule", 0,
     F::message_size, {whole("add", "16", -65536, 65536)}, "message_size"},
    {"F10", "dimension-extremes", 1, S::framing, E::set_field, "The number of rows or beams is impossible.",
     "rejects the ping; no product overflows", 0, F::rows, {whole("value", "65535", 0, 65535),
     P{.name = "field", .value = "rows", .words = "rows beams"}}, "dimensions"},
    {"F11", "sample-type-unknown", 1, S::framing, E::set_field, "The type of samples is unknown.", "rejects this ping only", 0,
     F::sample_type, {whole("value", "9", 0, 255)}, "sample_type"},
    {"F12", "unknown-message", 1, S::framing, E::insert_message, "A message of unknown type precedes a ping.",
     "skips it by its length", 0, F::message_type, {whole("type", "0x7777", 0, 65535), whole("bytes", "32", 0, 65536)}, "front"},
    {"F13", "version-switch", 1, S::framing, E::set_field, "The header states another version.", "reads by version; warns once",
     0, F::version, {whole("value", "3", 0, 65535)}, "version"},
    {"F14", "wrong-device-id", 1, S::framing, E::set_field, "The header names another device.", "accepts or rejects it; limits its log", 3,
     F::source_id, {whole("value", "4242", 0, 65535)}, "source_id"},
    {"F15", "duplicate", 1, S::framing, E::duplicate, "A ping is sent twice.", "publishes it once", 0, {}, {}, "order"},
    {"F16", "gap", 1, S::framing, E::drop, "Pings are missing; ping numbers count them.", "counts them", 0, {}, {}, "order"},
    {"F17", "reorder", 2, S::framing, E::swap, "Two pings are sent in the wrong order.", "publishes no old ping as new", 0, {}, {}, "delay"},
    {"F19", "bit-flip", 1, S::framing, E::flip, "Bits of a ping are inverted.", "checks what it can check", 0, {},
     {whole("bits", "1", 1, 4096), P{.name = "region", .value = "image", .words = "image header metadata bearings"}}, "bits"},
    {"F20", "false-sync", 1, S::framing, E::false_sync, "Bytes like the beginning of a message precede a ping.",
     "confirms a header before it trusts its length", 0, F::magic, {whole("bytes", "16", 2, 4096),
     P{.name = "fill", .value = "FF", .words = "FF magic"}}, "front"},
    {"F21", "stale-tail", 2, S::framing, E::splice, "The lower part of the image is that of the ping before.",
     "cannot notice; shows in maps", 0, {}, {offset_part}, "image"},
    {"F22", "empty-payload", 1, S::framing, E::header_only, "A ping consists of a header only.", "treats it as a sign of life",
     0, F::payload_size, {}, "payload_size"},
    {"F24", "mid-message-join", 1, S::framing, E::join_late, "A new client receives the rest of a ping first.",
     "skips to the next header", 60, {}, {offset_part}, "front"},

    // ---- device: settings, numbers, state, health
    {"D01", "config-ignored", 1, S::device, E::ignore_requests, "Requested settings are not applied.",
     "compares the echo and tries again a few times", 6, {}, {}, "requests"},
    {"D02", "config-late", 1, S::device, E::delay_requests, "Requested settings take effect late.", "waits without blocking data",
     30, {}, {P{"seconds", "6.5", 0.1, 120}}, "requests"},
    {"D03", "config-clamped", 1, S::device, E::clamp_requests, "The requested range is limited.", "adopts the value that is echoed",
     10, {}, {P{"range-m", "5", 0.1, 1000}}, "requests"},
    {"D04", "echo-missing-field", 1, S::framing, E::set_field, "A field of the echoed settings is zero.", "does not rely on it", 5,
     F::ping_rate, {whole("value", "0", 0, 255)}, "ping_rate"},
    {"D05", "config-forgotten", 1, S::device, E::forget_settings, "The device returns to its stored settings.",
     "sends its settings again", 0, {}, {}, "settings"},
    {"D06", "rate-deviates", 1, S::device, E::change_rate, "The ping rate is not the requested one.", "uses the measured rate", 10,
     {}, {P{"factor", "0.6", 0.01, 4}}, "rate"},
    {"D07", "id-wrap", 1, S::framing, E::renumber, "Ping numbers pass 2^32.", "compares them modulo 2^32", 10, F::ping_id,
     {whole("before", "3", 0, 1000)}, "ping_id"},
    {"D08", "id-reset", 1, S::framing, E::renumber, "Ping numbers begin again at 0.", "treats it as a restart", 10, F::ping_id,
     {}, "ping_id"},
    {"D09", "id-jump", 2, S::framing, E::renumber, "Ping numbers jump.",
     "ahead: counts pings as lost; back: treats it as a restart", 10, F::ping_id, {whole("by", "1000", -4294967295.0, 4294967295.0)}, "ping_id"},
    {"D10", "id-frozen", 2, S::framing, E::renumber, "All pings have the same number.", "uses the stamps", 5, F::ping_id, {},
     "ping_id"},
    {"D11", "sample-width-switch", 1, S::device, E::change_settings, "Samples change their width.",
     "reads every message by its own header", 5, {}, {P{.name = "what", .value = "sample-bits", .words = "sample-bits"},
     whole("value", "16", 8, 32)}, "settings"},
    {"D12", "gain-rows-switch", 1, S::device, E::change_settings, "Rows get or lose their gains.",
     "computes the stride of every message", 5, {}, {P{.name = "what", .value = "row-gains", .words = "row-gains"}}, "settings"},
    {"D13", "beam-count-switch", 1, S::device, E::change_settings, "The number of beams changes.", "reads the bearings again", 5,
     {}, {P{.name = "what", .value = "beams", .words = "beams"}, whole("value", "256", 1, 4096)}, "settings"},
    {"D14", "range-switch", 1, S::device, E::change_settings, "The range changes.", "reads rows and resolution from every message", 5,
     {}, {P{.name = "what", .value = "range", .words = "range"}, P{"value", "5", 0.1, 1000}}, "settings"},
    {"D15", "frequency-switch", 1, S::device, E::change_settings, "The frequency mode changes.", "uses the new bearings", 5, {},
     {P{.name = "what", .value = "mode", .words = "mode"}, whole("value", "1", 0, 7)}, "settings"},
    {"D16", "hot", 1, S::device, E::heat, "The device is hot: a status bit, and a lower rate.", "warns and continues", 10,
     F::device_status, {whole("status", "0x4000", 0, 4294967295.0), P{"factor", "0.5", 0, 1}}, "rate"},
    {"D17", "thermal-stop", 1, S::device, E::heat, "The device stops pinging until it is cooler.",
     "reports the cause; neither reconnects again and again nor exits", 10, F::device_status, {whole("status", "0xC000", 0, 4294967295.0),
     P{"factor", "0", 0, 1}}, "rate"},
    {"D18", "transmit-fail", 1, S::status, E::beacon_field, "A status bit states that the transmitter failed.", "reports it", 10,
     F::device_status, {whole("set-bits", "0x10000", 0, 4294967295.0)}, "status"},
    {"D19", "boot-or-paused", 1, S::status, E::beacon_field, "The status message states boot loader or paused.", "reports it and waits",
     10, F::device_status, {whole("clear-bits", "0x3F", 0, 4294967295.0), whole("set-bits", "0x1", 0, 4294967295.0)}, "status"},
    {"D20", "firmware-version", 2, S::status, E::beacon_field, "The device has another firmware.", "warns once", 30, F::firmware,
     {whole("value", "0x01020304", 0, 4294967295.0)}, "firmware"},
    {"D21", "part-number", 1, S::status, E::beacon_field, "The part number differs or is unknown.", "warns and continues", 30,
     F::part_number, {whole("value", "0xFFFF", 0, 65535)}, "part_number"},
    {"D22", "mute-until-fired", 1, S::device, E::withhold_pings, "The device answers and never sends a ping.",
     "sends its settings again; reports that no ping comes", 6, {}, {}, "flow"},
    {"D24", "spontaneous-standby", 2, S::device, E::change_settings, "The device goes to standby by itself.", "resumes or reports",
     5, {}, {P{.name = "what", .value = "rate", .words = "rate"}, P{"value", "0", 0, 100}}, "settings"},
    {"D26", "env-values-wild", 1, S::framing, E::set_field, "Temperature or pressure is implausible or not a number.",
     "computes nothing with it", 5, F::temperature, {P{.name = "value", .value = "nan", .words = "nan inf -inf huge absolute-zero"},
     P{.name = "field", .value = "temperature", .words = "temperature pressure"}}, "environment"},
    {"D27", "scale-zero", 1, S::framing, E::set_field, "The row spacing or sound speed is 0, negative or not a number.",
     "never divides by it", 5, F::range_resolution, {P{.name = "value", .value = "zero", .words = "zero nan negative inf"},
     P{.name = "field", .value = "range_resolution", .words = "range_resolution sound_speed"}}, "scale"},
    {"D28", "bearing-table", 1, S::framing, E::bearings, "The bearings are zero, reversed, out of order or change.",
     "checks their order", 5, {}, {P{.name = "how", .value = "reversed", .words = "reversed zero shuffled changing"}}, "bearings"},
    {"D30", "log-messages", 2, S::framing, E::insert_message, "Text messages precede a ping.", "limits what it prints", 0,
     F::message_type, {whole("type", "0x80", 0, 65535), whole("bytes", "64", 0, 65536)}, "front"},
    {"D32", "part-failed", 2, S::framing, E::set_field, "The header of a ping states that a part of the device failed.",
     "reports it; continues", 5, F::ping_status, {whole("value", "1", 0, 65535)}, "ping_status"},

    // ---- status messages
    {"U01", "never-announced", 1, S::status, E::no_beacon, "No status message is sent.", "lets the user give an address", 600, {},
     {}, "beacon"},
    {"U02", "status-gap", 1, S::status, E::no_beacon, "Status messages stop while pings continue.", "trusts data more than status", 8,
     {}, {}, "beacon"},
    {"U03", "status-short", 1, S::status, E::beacon_size, "The status message is too short.", "logs once and continues", 5, {},
     {whole("add", "-1", -64, -1)}, "beacon-size"},
    {"U04", "status-long", 1, S::status, E::beacon_size, "The status message is too long.", "reads the known part", 5, {},
     {whole("add", "1", 1, 1024)}, "beacon-size"},
    {"U05", "wrong-address-inside", 1, S::status, E::beacon_address, "The status message states another address.",
     "prefers the sender's address, or warns", 10, F::address,
     {P{.name = "address", .value = "zero", .words = "zero loopback link-local"}}, "address"},
    {"U06", "address-conflict", 1, S::status, E::second_beacon, "Two devices state the same address.", "notices by their numbers",
     10, F::device_id, {P{.name = "address", .value = "same", .words = "same"}}, "second"},
    {"U07", "two-devices", 1, S::status, E::second_beacon, "A second device announces itself.", "selects by number", 10,
     F::device_id, {P{.name = "address", .value = "next", .words = "next"}}, "second"},
    {"U08", "foreign-status", 1, S::status, E::second_beacon, "A foreign sender announces the device with another address.",
     "ignores it or warns", 10, F::address, {P{.name = "address", .value = "foreign", .words = "foreign"}}, "second"},
    {"U09", "owned-by-other", 2, S::status, E::beacon_address, "The status message states that another host is connected.",
     "reports which host is connected", 10, F::connected_address,
     {P{.name = "address", .value = "link-local", .words = "zero loopback link-local"}}, "connected"},
    {"U12", "foreign-datagrams", 1, S::status, E::foreign_datagrams, "Datagrams of another protocol arrive at the status port.",
     "checks length and first word", 10, {}, {whole("bytes", "544", 1, 1400)}, "foreign"},
    {"U13", "late-first-status", 1, S::status, E::no_beacon, "The first status message comes late.", "waits quietly", 20, {}, {},
     "beacon"},

    // ---- time
    {"T01", "jump-forward", 1, S::time, E::clock_offset, "The clock of the device jumps ahead.", "marks the discontinuity", 30, {},
     {P{"seconds", "3600", 0.001, 1e10}}, "clock"},
    {"T02", "jump-back", 1, S::time, E::clock_offset, "The clock of the device jumps back.", "publishes no falling stamps unmarked",
     30, {}, {P{"seconds", "-5", -1e10, -0.001}}, "clock"},
    {"T03", "frozen", 1, S::time, E::clock_freeze, "The clock of the device stops.", "notices within 3 pings", 10, {}, {},
     "clock"},
    {"T04", "constant-offset", 1, S::time, E::clock_offset, "The clock of the device is off.", "compares it with the host's", 600,
     {}, {P{"seconds", "37", -1e10, 1e10}}, "clock"},
    {"T05", "drift", 1, S::time, E::clock_drift, "The clock of the device drifts.", "estimates or tolerates it", 600, {},
     {P{"ppm", "500", -1e6, 1e6}}, "clock"},
    {"T06", "wrap", 1, S::time, E::clock_offset, "A 32-bit counter of time wraps.", "continues past the wrap", 30, {},
     {P{.name = "unit", .value = "microseconds", .words = "microseconds milliseconds"}}, "clock"},
    {"T08", "restart-at-connect", 1, S::time, E::clock_restart, "The clock of the device begins at 0.",
     "treats it as a restart", 0, {}, {}, "clock"},
    {"T10", "delayed-delivery", 1, S::link, E::delay, "Pings arrive late with correct stamps.", "checks their age", 10, {},
     {P{"ms", "800", 0, 10000}, P{"jitter-ms", "0", 0, 10000}}, "delay"},
    {"T11", "slow", 1, S::device, E::change_rate, "Pings come at a lower rate.", "does not assume the nominal rate", 10, {},
     {P{"factor", "0.25", 0.01, 1}}, "rate"},
    {"T12", "pacing-jitter", 1, S::link, E::jitter, "Pings come at uneven times.", "interpolates by stamps", 10, {},
     {P{"ms", "60", 1, 10000}}, "delay"},

    // ---- clients
    {"M01", "second-refused", 1, S::clients, E::refuse, "New connections are refused.", "reports it, and waits longer each time",
     10, {}, {end_how}, "admission"},
    {"M02", "take-over", 1, S::clients, E::take_over, "The newest connection replaces the others.", "does not reconnect in a loop",
     30, {}, {}, "admission"},
    {"M03", "queued-silently", 1, S::clients, E::leave_waiting, "New connections wait in silence.", "times out", 6, {}, {},
     "admission"},
    {"M04", "config-fight", 1, S::device, E::change_settings, "Another host changes the settings.",
     "notices the change in the echo", 5, {}, {P{.name = "what", .value = "range", .words = "range"}, P{"value", "3", 0.1, 1000}},
     "settings"},
    {"M05", "slow-reader-policy", 1, S::clients, E::outbox_policy, "A slow client gets the oldest waiting ping, not the newest.",
     "sees the gaps by number", 30, {}, {}, "outbox"},
    {"M06", "zero-window", 1, S::clients, E::stop_reading, "The device does not read what clients send.", "does not block", 6, {},
     {}, "reading"},
    {"M08", "no-free-slot", 1, S::clients, E::refuse, "New connections are reset: no slot is free.", "waits longer each time",
     10, {}, {P{.name = "how", .value = "reset", .words = "reset fin"}}, "admission"},
    {"M09", "rejects-host-message", 1, S::clients, E::end_on_request,
     "The device ends the connection when the host sends a command.", "checks what it sends; does not reconnect in a loop", 10, {},
     {end_how, P{.name = "command", .value = "settings", .words = "settings any"}}, "requests"},
    {"M10", "reconnect-storm", 1, S::clients, E::end_after, "Every connection ends after a short while.",
     "closes before it opens; waits longer each time", 10, {}, {P{"seconds", "0.5", 0.01, 60}, end_how}, "end"},

    // ---- samples
    {"P01", "stuck", 1, S::payload, E::stuck, "The image repeats while numbers advance.", "notices that nothing changes", 5, {}, {},
     "image"},
    {"P02", "blank", 1, S::payload, E::blank, "The image is zero.", "notices that no echo returns", 5, {}, {}, "image"},
    {"P03", "saturated", 1, S::payload, E::saturate, "Samples are at full scale.", "lowers the gain or rejects", 5, {},
     {P{"share", "0.8", 0, 1}}, "image"},
    {"P04", "noise", 1, S::payload, E::noise, "The image is random.", "rejects it by its statistics", 5, {}, {}, "image"},
    {"P05", "dead-beams", 1, S::payload, E::dead_beams, "Beams are zero.", "ignores or fills them", 5, {},
     {P{"share", "0.1", 0, 1}}, "image"},
    {"P06", "spokes", 1, S::payload, E::spokes, "Interference makes some beams bright.", "filters them", 5, {}, {P{"share", "0.05", 0, 1}},
     "image"},
    {"P07", "gain-step", 2, S::payload, E::gain_step, "Samples beyond a range are brighter.", "normalises", 5, {}, {offset_part,
     P{"factor", "2", 0, 100}}, "image"},
    {"P09", "mirrored", 1, S::payload, E::mirror, "Port and starboard are exchanged.", "compares the image with the motion", 10, {},
     {}, "image"},
    {"P11", "missing-ranges", 1, S::payload, E::missing_rows, "Rows beyond a range are zero.",
     "treats them as unknown, not as free", 5, {}, {offset_part}, "image"},
    {"P12", "plausible-wrong", 1, S::payload, E::scale_range, "Ranges are scaled.", "compares with another sensor", 10, {},
     {P{"factor", "0.97", 0.1, 10}}, "image"},
    {"P13", "intermittent", 1, S::payload, E::intermittent, "The image comes and goes.", "marks what is missing", 10, {},
     {whole("on", "5", 1, 1000), whole("off", "5", 1, 1000)}, "image"},
    {"P15", "attitude-wild", 2, S::framing, E::set_field, "Heading, pitch or roll is implausible or not a number.", "ignores it", 5,
     F::heading, {P{.name = "value", .value = "nan", .words = "nan inf -inf huge"},
     P{.name = "field", .value = "heading", .words = "heading pitch roll"}}, "attitude"},

    // ---- the SDK boundary of BlueView
    {"B01", "open-refused", 1, S::link, E::close_ports, "The link refuses connections.", "opens again, with a limit and pauses", 6,
     {}, {P{.name = "close-existing", .value = "no", .words = "no yes"}}, "ports"},
    {"B02", "open-silent", 1, S::clients, E::leave_waiting, "The link accepts and never greets.", "returns a time-out", 6, {}, {},
     "admission"},
    {"B04", "ping-timeout", 1, S::link, E::withhold_pings, "No ping answers a request.", "tests the result before it uses the ping",
     6, {}, {}, "flow"},
    {"B05", "link-lost-in-ping", 1, S::link, E::end, "The link ends inside a ping.", "opens again on the same object", 0, {},
     {offset_part, P{.name = "how", .value = "reset", .words = "reset fin"}}, "end"},
    {"B06", "late-reply", 1, S::link, E::delay, "A ping arrives during the next request.", "never returns the wrong ping", 10, {},
     {P{"ms", "3000", 0, 10000}, P{"jitter-ms", "0", 0, 10000}}, "delay"},
    {"B09", "set-clamped", 1, S::device, E::clamp_requests, "The range that was set is limited.", "reads back what was applied", 10,
     {}, {P{"range-m", "5", 0.1, 1000}}, "requests"},
    {"B10", "clock-skew", 1, S::time, E::clock_offset, "The clock of the sonar is off.", "compares it with the host's", 30, {},
     {P{"seconds", "2.5", -1e10, 1e10}}, "clock"},
    {"B12", "version-or-type", 1, S::framing, E::set_field, "A frame has a type that is unknown to the library.",
     "returns an error and closes", 0, F::message_type, {whole("value", "0x7777", 0, 65535)}, "message_type"},
    {"B13", "bad-compression", 1, S::framing, E::set_field, "The stated size of the samples is wrong.",
     "checks it before it allocates", 0, F::image_size, {whole("value", "0xFFFFFFFF", 0, 4294967295.0)}, "image_size"},
    {"B15", "recording-cut", 1, S::link, E::harness, "A recording ends inside a frame.", "reads to the last whole frame", 6, {}, {},
     {}},

    // ---- datagrams of a ping
    {"G01", "part-lost", 1, S::datagrams, E::lose_part, "A datagram of a ping is lost.", "publishes what is whole", 0, {},
     {P{.name = "which", .value = "any", .words = "any first"}}, "parts"},
    {"G02", "parts-reordered", 1, S::datagrams, E::reorder_parts, "The datagrams of a ping come in another order.",
     "puts them in order", 0, {}, {}, "parts"},
    {"G03", "part-twice", 1, S::datagrams, E::repeat_part, "A datagram of a ping comes twice.", "uses it once", 0, {}, {}, "parts"},
    {"G04", "last-part-never", 1, S::datagrams, E::lose_last_part, "The last datagram of a ping is lost.",
     "does not block the next ping", 0, {}, {}, "parts"},
    {"G05", "part-of-older-frame", 1, S::datagrams, E::older_part, "A datagram is that of the ping before.",
     "does not mix two pings", 0, {}, {}, "parts"},
    {"G06", "ip-fragment-lost", 1, S::datagrams, E::harness, "An IP fragment is lost.", "loses one ping", 6, {}, {}, {}},
    {"G07", "group-lost", 1, S::datagrams, E::leave_group, "Datagrams do not reach the group.", "joins again", 6, {}, {}, "group"},
    {"G08", "part-late", 1, S::datagrams, E::late_part, "A datagram of a ping comes after the next ping has begun.",
     "drops it; does not add it to the next ping", 0, {}, {}, "parts"},
};

constexpr Trouble trouble_table[] = {
    {"bad-connector", "The link goes up and down, and stops inside messages.", 20,
     {{{"L11", {"up-s=5 down-s=0.5", "up-s=3 down-s=1", "up-s=1 down-s=2"}}, {"S06", {"seconds=0.2", "seconds=1", "seconds=3"}}}}},
    {"thin-tether", "The tether is slow and delays data.", 30,
     {{{"L13", {"mbit-per-s=20", "mbit-per-s=5", "mbit-per-s=1"}}, {"L14", {"ms=50", "ms=200 jitter-ms=50", "ms=800 jitter-ms=300"}}}}},
    {"power-cycle", "The device restarts.", 60, {{{"L10", {"boot-s=5 gap-s=0", "boot-s=20 gap-s=1", "boot-s=35 gap-s=5"}}}}},
    {"wrong-subnet", "The status message states an address that is not the device's.", 30, {{{"U05", {"", "", ""}}}}},
    {"second-operator", "Another host takes the device over and changes its settings.", 30,
     {{{"M02", {"", "", ""}}, {"M04", {"", "", ""}}, {"U09", {"", "", ""}}}}},
    {"other-firmware", "The device has another firmware: version, part number, unknown messages.", 60,
     {{{"D20", {"", "", ""}}, {"D21", {"", "", ""}}, {"F12", {"bytes=0", "bytes=32", "bytes=4096"}}}}},
    {"overheating", "The device gets hot, slows down, and stops.", 30,
     {{{"D16", {"factor=0.8", "factor=0.5", "factor=0.2"}}, {"D17", {"", "", ""}, 0.5}}}},
    {"clock-step", "The clock of the device steps.", 30, {{{"T01", {"seconds=1", "seconds=3600", "seconds=100000000"}}}}},
    {"electrical-noise", "Interference in the image, and damaged bytes.", 20,
     {{{"P06", {"share=0.02", "share=0.05", "share=0.2"}}, {"F01", {"bytes=1", "bytes=16", "bytes=256 fill=random"}}, {"F19", {"bits=1", "bits=16", "bits=256"}}}}},
    {"mounted-wrong", "Port and starboard are exchanged.", 60, {{{"P09", {"", "", ""}}}}},
    {"deaf-head", "Beams or the whole image are zero.", 20, {{{"P05", {"share=0.05", "share=0.3", "share=1"}}}}},
    {"lease-renewal", "The address is withdrawn and returns.", 10, {{{"L17", {"", "", ""}}}}},
};

// clang-format on

bool same_word(std::string_view a, std::string_view b) {
  const auto folded = [](char c) { return c == '_' ? '-' : small_letter(c); };
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), [&](char x, char y) { return folded(x) == folded(y); });
}

}  // namespace

std::span<const FaultParameter> FaultKind::given() const {
  const auto end = std::find_if(parameters.begin(), parameters.end(), [](const FaultParameter& p) { return p.name.empty(); });
  return {parameters.begin(), end};
}

std::span<const FaultKind> fault_kinds() { return table; }
std::span<const Trouble> troubles() { return trouble_table; }

const FaultKind* find_fault_kind(std::string_view code_or_name) {
  const auto it = std::find_if(std::begin(table), std::end(table), [&](const FaultKind& k) {
    return same_word(k.code, code_or_name) || same_word(k.name, code_or_name);
  });
  return it == std::end(table) ? nullptr : it;
}

void fill(v1::FaultKind& out, const FaultKind& kind) {
  out.set_code(std::string(kind.code));
  out.set_name(std::string(kind.name));
  out.set_tier(static_cast<std::uint32_t>(kind.tier));
  out.set_stage(std::string(fault_stage_names[static_cast<std::size_t>(kind.stage)]));
  out.set_sentence(std::string(kind.sentence));
  out.set_good_driver(std::string(kind.good_driver));
  out.set_default_s(kind.default_s);
  for (const FaultParameter& p : kind.given()) {
    v1::FaultParameter& parameter = *out.add_parameters();
    parameter.set_name(std::string(p.name));
    parameter.set_value(std::string(p.value));
    parameter.set_lowest(p.lowest);
    parameter.set_highest(p.highest);
    for (std::string_view rest = p.words; !rest.empty();) {
      const std::size_t end = std::min(rest.find(' '), rest.size());
      parameter.add_words(std::string(rest.substr(0, end)));
      rest.remove_prefix(std::min(end + 1, rest.size()));
    }
  }
}

void fill(v1::Trouble& out, const Trouble& trouble) {
  out.set_name(std::string(trouble.name));
  out.set_sentence(std::string(trouble.sentence));
  for (const Trouble::Part& part : trouble.parts)
    if (!part.code.empty()) out.add_codes(std::string(part.code));
}

}  // namespace sonar
