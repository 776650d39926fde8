// The side of a controller, for tests: commands as bytes, and a device that receives them.
#pragma once

#include <gtest/gtest.h>

#include <string>

#include "protocol/aris/aris.hpp"
#include "protocol/aris/encode_frame.hpp"
#include "protocol/aris/messages.hpp"
#include "protocol/aris/settings.hpp"

namespace sonar::aris::tests {

inline Time at_s(double s) { return Time{} + nanoseconds_from(1.7e9 + s); }

inline protocol::DeviceState device(const std::string& profile = "aris-3000", protocol::OptionValues options = {}) {
  protocol::DeviceState d;
  d.name = "front";
  d.id = 7001;
  d.model = protocol::find_profile(profile)->model;
  d.water = {12, 30, 8.0, 0};
  d.options = *protocol::check_options(vendor(), options);
  d.settings = vendor().initial_settings(d).vendor_settings;
  return d;
}

inline Bytes hex(std::string_view text) {
  Bytes bytes;
  for (std::size_t i = 0; i + 1 < text.size(); i += text[i] == ' ' ? 1 : 2)
    if (text[i] != ' ') bytes.push_back(static_cast<std::byte>(std::stoi(std::string(text.substr(i, 2)), nullptr, 16)));
  return bytes;
}

/// Returns settings that are valid for an ARIS 3000, with 128 beams.
inline Acoustics acoustics(std::uint32_t cookie = 1) {
  return {cookie, 12, 800, 1360, 4920, 4, 6, 9, true, Frequency::high, true, 12};
}
inline Command set_acoustics(const Acoustics& a) {
  Command command;
  command.type = CommandType::set_acoustics;
  command.acoustics = a;
  return command;
}
inline Command set_receiver(std::uint32_t port, const std::string& ip = "") {
  Command command;
  command.type = CommandType::set_receiver;
  command.receiver = Receiver{port, ip};
  return command;
}

}  // namespace sonar::aris::tests
