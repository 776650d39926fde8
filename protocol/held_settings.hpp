// Stores a make's settings: in the device, and in a ping request until the ping is framed.
#pragma once

#include <memory>
#include <utility>

#include "core/sonar/ping.hpp"
#include "protocol/dialogue.hpp"

namespace sonar::protocol {

/// True if two settings are equal for a client. A make whose settings have parts that differ between pings defines this function
/// in its own namespace.
template <class Settings>
bool same_settings(const Settings& a, const Settings& b) {
  return a == b;
}

/// Returns the device's findings in a ping; null if there are none. A make whose device has findings
/// defines this function in its own namespace.
std::shared_ptr<const PingFindings> findings_of(const auto&, const Ping&) { return nullptr; }

/// Findings of type T, as PingFindings.
template <class T>
struct Found final : PingFindings {
  explicit Found(T v) : value(std::move(v)) {}
  T value;
};
template <class T>
std::shared_ptr<const PingFindings> found(T value) {
  return std::make_shared<const Found<T>>(std::move(value));
}
/// Returns the findings of type T in the ping; if there are none, the findings that `look` makes now.
template <class T>
T found_in(const Ping& ping, T (*look)(const Ping&)) {
  const auto* const made = dynamic_cast<const Found<T>*>(ping.findings.get());
  return made != nullptr ? made->value : look(ping);
}

template <class Settings, class Base = VendorSettings>
struct Held final : Base {
  explicit Held(const Settings& s) : settings(s) {}
  std::shared_ptr<const PingFindings> look_at(const Ping& ping) const override { return findings_of(settings, ping); }
  bool equals(const VendorSettings& other) const override {
    const auto* of = dynamic_cast<const Held*>(&other);
    return of != nullptr && same_settings(of->settings, settings);
  }
  Settings settings;
};

/// Returns the held settings; for null, the settings of a new device.
template <class HeldSettings>
auto settings_in(const VendorSettings* held) {
  const auto* of = dynamic_cast<const HeldSettings*>(held);
  return of != nullptr ? of->settings : decltype(of->settings){};
}

/// Returns the settings after the daemon has carried out `reaction`; if it changes none, returns `now`.
inline const VendorSettings* settings_after(const Reaction& reaction, const VendorSettings* now) {
  for (const Event& event : reaction.events)
    if (const auto* change = std::get_if<ChangeSettings>(&event)) now = change->vendor_settings.get();
  return now;
}

}  // namespace sonar::protocol
