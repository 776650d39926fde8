// Previews: pings for viewers alone, while no driver is connected (daemon/emulator/view/preview.hpp).
#include "daemon/server/view/view_feed.hpp"

namespace sonar {

std::string ViewFeed::set_preview(Viewer& viewer, Device& device, bool on) {
  const std::string& name = device.config().name;
  Preview& preview = device.preview();
  if (!on) {
    end_preview(device, "by request of " + viewer.who());
    return {};
  }
  const Time now = of_.clock.now();
  if (device.sonar().connections().has_audience()) return "a driver is connected; its pings are shown";
  if (!preview.on()) of_.log.info("preview begins: pings for viewers only", {{"sonar", name}, {"client", viewer.who()}});
  preview.begin(now);
  previewers_[name] = connection_of(viewer);
  drive_previews();
  return {};
}

void ViewFeed::end_preview(Device& device, const std::string& why) {
  if (!device.preview().on()) return;
  device.preview().end();
  changed_ = true;
  of_.log.info("preview ends", {{"sonar", device.config().name}, {"why", why}});
}

/// Begins what is due, and ends what must end.
void ViewFeed::drive_previews() {
  const Time now = of_.clock.now();
  for (Device& device : of_.fleet.devices()) {
    if (!device.preview().on()) continue;
    const std::string& name = device.config().name;
    const auto previewer = previewers_[name].lock();
    std::string why = device.preview().why_over(device.sonar(), now);
    if (!previewer || previewer->over()) why = "its viewer left";
    if (!why.empty())
      end_preview(device, why);
    else if (auto request = device.preview().due(device.sonar(), now))
      of_.fleet.compute_preview(*std::move(request), [this, name](const PingOutcome& outcome) { on_preview(name, outcome); });
  }
}

/// A driver that connected meanwhile has taken over: its pings are shown.
void ViewFeed::on_preview(const std::string& sonar, const PingOutcome& outcome) {
  Device* const device = of_.fleet.find(sonar);
  if (stopping_ || device == nullptr) return;
  device->preview().done();
  if (!outcome.ping) return end_preview(*device, "the ping failed: " + outcome.failure);
  if (!device->preview().on() || device->sonar().connections().has_audience()) return;
  on_ping(*device, {outcome.ping, nullptr, {}, outcome.seconds, true});
}

}  // namespace sonar
