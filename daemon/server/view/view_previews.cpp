// Previews: pings only for viewers, while no driver is connected (daemon/emulator/view/driver_picture.hpp).
#include "daemon/server/view/view_feed.hpp"

namespace sonar {
namespace {

constexpr std::chrono::seconds rest_after_failure{30};  // pause of previews that start without a request
constexpr std::chrono::seconds page_starts_within{5};   // longest time from the request of the page to its subscriptions

}  // namespace

/// Switches the preview of a sonar on or off for a viewer. Returns the reason if that fails, else an empty text.
std::string ViewFeed::set_preview(Viewer& viewer, Device& device, bool on) {
  const std::string& name = device.config().name;
  Preview& preview = device.preview();
  if (!on) {
    no_preview_.insert(name);
    end_preview(device, "on request of " + viewer.who());
    return {};
  }
  const Time now = of_.clock.now();
  if (device.sonar().connections().has_audience()) return "a driver is connected; its pings are shown";
  if (!preview.on()) of_.log.info("preview begins: pings for viewers only", {{"sonar", name}, {"client", viewer.who()}});
  preview.begin(now);
  no_preview_.erase(name);
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

void ViewFeed::expect_viewer() {
  if (!of_.config.previews || stopping_) return;
  sync_sonars();
  expected_until_ = Steady::now() + page_starts_within;
  drive_previews();
  arm();
}

/// True in the demo while a viewer has subscribed to the sonar's pings, or is expected, and no driver is connected.
bool ViewFeed::previews_by_itself(const Device& device) {
  const std::string& name = device.config().name;
  if (!of_.config.previews || of_.clock.stepped() || no_preview_.contains(name)) return false;
  if (const auto failed = preview_failed_at_.find(name);
      failed != preview_failed_at_.end() && Steady::now() < failed->second + rest_after_failure)
    return false;
  const SonarView* const sonar = find(name);
  if (sonar == nullptr) return false;
  const bool is_expected = Steady::now() < expected_until_;
  return (is_expected || wanted(sonar->image) || wanted(sonar->fan) || wanted(sonar->cloud)) &&
         !device.sonar().connections().has_audience();
}

/// Begins due previews, and ends previews that must end.
void ViewFeed::drive_previews() {
  const Time now = of_.clock.now();
  for (Device& device : of_.fleet.devices()) {
    const std::string& name = device.config().name;
    const bool by_itself = previews_by_itself(device);
    if (by_itself) {
      if (!device.preview().on()) of_.log.info("preview begins: pings for viewers until a driver connects", {{"sonar", name}});
      device.preview().begin(now);
    }
    if (!device.preview().on()) continue;
    const auto previewer = previewers_[name].lock();
    std::string why = device.preview().why_over(device.sonar(), now);
    if (!by_itself && why.empty() && (!previewer || previewer->over())) why = "its viewer left";
    if (!why.empty())
      end_preview(device, why);
    else if (auto request = device.preview().due(device.sonar(), now))
      of_.fleet.compute_preview(*std::move(request), [this, name](const PingOutcome& outcome) { on_preview(name, outcome); });
  }
}

/// Shows a preview, unless a driver has connected meanwhile, whose pings are then shown.
void ViewFeed::on_preview(const std::string& sonar, const PingOutcome& outcome) {
  Device* const device = of_.fleet.find(sonar);
  if (stopping_ || device == nullptr) return;
  device->preview().done(outcome.ping != nullptr);
  if (!outcome.ping) {
    preview_failed_at_[sonar] = Steady::now();
    return end_preview(*device, "the ping failed: " + outcome.failure);
  }
  if (!device->preview().on() || device->sonar().connections().has_audience()) return;
  on_ping(*device, {outcome.ping, nullptr, {}, outcome.seconds, true});
}

}  // namespace sonar
