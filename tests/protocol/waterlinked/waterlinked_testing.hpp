// A Sonar 3D-15 for tests, and requests to it.
#pragma once

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <string>

#include "protocol/waterlinked/settings.hpp"
#include "protocol/waterlinked/waterlinked.hpp"

namespace sonar::waterlinked::tests {

using Json = nlohmann::json;

inline Time at_s(double s) { return Time{} + nanoseconds_from(1.7e9 + s); }

class Unit {
 public:
  explicit Unit(protocol::OptionValues options = {}) {
    device.name = "front";
    device.id = 7001;
    device.model = protocol::find_profile("waterlinked-3d15")->model;
    device.water = {12, 35, 8.0, 0};
    device.options = *protocol::check_options(vendor(), options);
    device.powered_up_at = at_s(0);
    const protocol::ChangeSettings first = vendor().initial_settings(device);
    device.settings = first.vendor_settings;
    settings = first.settings;
  }

  protocol::ResourceReply request(const std::string& method, const std::string& path, const std::string& body = {}) {
    const protocol::Port& port = *vendor().port(protocol::Port::Kind::http);
    protocol::ResourceReply reply = vendor().on_http(
        port, {method, "/api/v1/integration" + path, "", "application/json", body, {127, 0, 0, 1}}, device, at_s(100));
    for (const protocol::Event& event : reply.events) {
      if (const auto* change = std::get_if<protocol::ChangeSettings>(&event)) {
        device.settings = change->vendor_settings;
        settings = change->settings;
        receivers = change->receivers->to;
      }
    }
    return reply;
  }
  Json get(const std::string& path) {
    const protocol::ResourceReply reply = request("GET", path);
    EXPECT_EQ(reply.status, 200u) << path;
    return Json::parse(reply.body, nullptr, false);
  }
  unsigned post(const std::string& path, const std::string& body) {
    const protocol::ResourceReply reply = request("POST", path, body);
    if (reply.status == 204) {
      EXPECT_EQ(reply.body, "") << path;
    }
    return reply.status;
  }

  protocol::DeviceState device;
  PingSettings settings;
  std::vector<protocol::Endpoint> receivers;
};

}  // namespace sonar::waterlinked::tests
