// Common parts of the Oculus tests: bytes that were typed by hand, buffers of exact size, a device, and a made-up ping.
#pragma once

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <initializer_list>
#include <memory>
#include <stdexcept>
#include <string>
#include <string_view>
#include <variant>

#include "core/sonar/ping.hpp"
#include "protocol/oculus/decode.hpp"
#include "protocol/oculus/encode_ping.hpp"
#include "protocol/oculus/settings.hpp"
#include "protocol/vendor.hpp"

namespace sonar::oculus::tests {

using wire::Bytes;
using wire::BytesView;

inline unsigned hex_digit(char c) {
  return static_cast<unsigned>(c <= '9' ? c - '0' : std::toupper(static_cast<unsigned char>(c)) - 'A' + 10);
}
/// Converts "53 4F" to two bytes, independently of the code under test.
inline Bytes hex(std::string_view text) {
  Bytes out;
  for (std::size_t i = 0; i + 1 < text.size(); ++i) {
    if (std::isspace(static_cast<unsigned char>(text[i])) != 0) continue;
    out.push_back(static_cast<std::byte>(hex_digit(text[i]) * 16 + hex_digit(text[i + 1])));
    ++i;
  }
  return out;
}

inline Bytes joined(std::initializer_list<Bytes> parts) {
  Bytes out;
  for (const Bytes& part : parts) out.insert(out.end(), part.begin(), part.end());
  return out;
}
inline void overwrite(Bytes& bytes, std::size_t offset, const Bytes& with) {
  std::copy(with.begin(), with.end(), bytes.begin() + static_cast<std::ptrdiff_t>(offset));
}

/// A heap copy of exactly the view's size, so that a sanitizer detects a read one byte beyond it.
class Exact {
 public:
  explicit Exact(BytesView from) : size_(from.size()), bytes_(new std::byte[from.size()]) {
    std::copy(from.begin(), from.end(), bytes_.get());
  }
  BytesView view() const { return {bytes_.get(), size_}; }

 private:
  std::size_t size_;
  std::unique_ptr<std::byte[]> bytes_;
};

inline Time at(double seconds_since_epoch) { return Time{} + nanoseconds_from(seconds_since_epoch); }

/// Returns a device at 5 m depth in fresh water of 15 deg C; options that are not given have their defaults.
inline protocol::DeviceState device(const char* profile = "oculus-m1200d", const protocol::OptionValues& options = {}) {
  const auto found = protocol::find_profile(profile);
  if (!found) throw std::runtime_error(found.error().text);
  protocol::DeviceState state;
  state.name = "front";
  state.id = 7001;
  state.model = found->model;
  state.advertise_ip = {192, 168, 1, 2};
  state.mac = {2, 0, 0, 0, 0x1B, 0x59};
  state.powered_up_at = at(1000);
  state.water = Water{15, 0, 8, 0};
  state.depth_m = 5;
  state.options = protocol::check_options(*found->vendor, options).value();
  return state;
}

inline FireRequest fire(int version, int mode, PingRate rate, int flags, double range, double gain) {
  FireRequest request;
  request.version = static_cast<std::uint16_t>(version);
  request.settings.mode = static_cast<std::uint8_t>(mode);
  request.settings.ping_rate = rate;
  request.settings.flags = static_cast<std::uint8_t>(flags);
  request.settings.range = range;
  request.settings.gain_percent = gain;
  return request;
}

/// Returns a ping with the bearings of the product's formula. The samples depend on row and beam: the lowest byte is (row * 7 +
/// beam) modulo 251.
inline Ping made_up_ping(const protocol::DeviceState& state, const PingSettings& settings, std::uint32_t number = 1) {
  Ping ping;
  ping.request.model = state.model;
  ping.request.number = PingNumber{number};
  ping.request.fired_at = state.powered_up_at + nanoseconds_from(12.25);
  ping.request.sonar_in_world.position_m = {3, 4, -state.depth_m};
  ping.request.water = state.water;
  ping.request.settings = settings;
  const double edge = std::sin(static_cast<double>(ping.mode().horizontal_aperture_rad) / 2);
  for (int beam = 0; beam < settings.beam_count; ++beam)
    ping.beam_azimuth_rad.push_back(static_cast<float>(std::asin(edge - 2 * edge * beam / (settings.beam_count - 1))));
  const int bytes = settings.format.bits / 8;
  for (int row = 0; row < settings.range_bin_count; ++row) {
    if (settings.format.row_gains) ping.row_gain.push_back(static_cast<std::uint32_t>(row + 1));
    for (int beam = 0; beam < settings.beam_count; ++beam) {
      ping.samples.push_back(static_cast<std::byte>((row * 7 + beam) % 251));
      ping.samples.insert(ping.samples.end(), static_cast<std::size_t>(bytes - 1), std::byte{1});
    }
  }
  return ping;
}

/// Returns a device's decoded answer to a fire message: a ping with the resulting settings and made-up samples.
inline DecodedPing answer(const protocol::DeviceState& state, const FireRequest& request, std::uint32_t number = 1) {
  const Ping ping = made_up_ping(state, resolve(request, state).settings, number);
  return decode_ping(encode_ping(ping, state, request)).value();
}

template <class T>
std::vector<T> events_of(const protocol::Reaction& reaction) {
  std::vector<T> found;
  for (const protocol::Event& event : reaction.events)
    if (const T* one = std::get_if<T>(&event)) found.push_back(*one);
  return found;
}

}  // namespace sonar::oculus::tests
