// Pings of the live view: payloads that are offered when a ping arrives, payloads that the view's thread makes, and frame
// transforms.

#include <algorithm>
#include <new>
#include <optional>
#include <utility>

#include "daemon/emulator/view/ping_payloads.hpp"
#include "daemon/server/view/view_feed.hpp"
#include "daemon/server/view/view_parameters.hpp"
#include "protocol/foxglove/foxglove_messages.hpp"

namespace sonar {

/// Makes the payloads that have subscribers; the view's thread makes slow payloads.
void ViewFeed::on_ping(const Device& of, const PingQueued& queued) {
  SonarView* const sonar = find(of.config().name);
  if (sonar == nullptr) return;
  const Ping& ping = *queued.ping;
  watch_playback();
  sonar->be_of(of);
  sonar->last = queued.ping;
  if (sonar->driver == nullptr) sonar->driver = std::make_unique<DriverPicture>(*sonar->make);
  if (auto drawing = sonar->driver->after(queued.ping, of.sonar().state())) sonar->drawing = std::move(drawing);
  ping_at_ = Steady::now();
  if (wanted(sonar->geometry))
    if (wire::Bytes shape = foxglove::geometry(ping, 0); shape != sonar->shape) {
      sonar->shape = std::move(shape);
      offer(sonar->geometry, geometry_payload(ping));
    }
  sonar->picture = wanted(sonar->image) ? image_payload(sonar->name, queued.ping) : nullptr;
  offer(sonar->image, sonar->picture);
  if (wanted(sonar->ping)) offer(sonar->ping, ping_payload(of, queued));
  if (wanted(sonar->figures)) offer(sonar->figures, figures_payload(of, queued));
  if (wanted(sonar->truth) && !ping.truth.empty()) offer(sonar->truth, truth_payload(ping));
  if (wanted(tf_)) offer(tf_, places());
  if (wanted(swath_)) {
    const PingSettings& s = ping.request.settings;
    const std::string volume = std::to_string(s.mode) + " " + std::to_string(s.range_m) + " " + std::to_string(s.range_start_m);
    if (std::exchange(sonar->volume, volume) != volume) offer(swath_, swath_payload(sonar->name, ping));
  }
  if (sonar->by_lines) offer_line(*sonar);
  begin_slow_ones(*sonar);
  if (of_.clock.stepped()) arm();
}

/// Offers the cloud of a sonar with one beam for each ping, because a missing line would be a gap in the sweep.
void ViewFeed::offer_line(const SonarView& sonar) {
  std::map<double, ViewPayloadPointer> made;  // key: threshold
  each([&](ViewConnection& c) {
    if (!c.viewer().subscribes(sonar.cloud)) return;
    const double threshold = threshold_of(c.viewer(), sonar.points);
    ViewPayloadPointer& line = made[threshold];
    if (line == nullptr) line = cloud_payload(sonar.name, *sonar.last, threshold);
    give(c.viewer(), sonar.cloud, line);
    c.wake();
  });
}

/// Begins slow payloads. Called for each ping and at each tick, because a payload may become due, or get a subscriber, between
/// pings.
void ViewFeed::begin_slow_ones(SonarView& sonar) {
  if (sonar.last == nullptr) return;
  const Time at = sonar.last->request.fired_at;
  if (sonar.painter == nullptr) sonar.painter = std::make_shared<PicturePainter>(view_fan_style());
  if (sonar.drawing)
    make_slowly(sonar, &SonarView::drawn,
                [name = sonar.name, about = sonar.about, at, draw = sonar.drawing, painter = sonar.painter,
                 picture = std::optional<SonarPicture>()](std::uint32_t channel, double) mutable {
                  if (!picture) picture = draw();
                  return channel == about ? picture_payload(at, *picture) : fan_payload(name, at, *picture, *painter);
                });
  if (sonar.by_lines) return;
  make_slowly(sonar, &SonarView::points, [name = sonar.name, ping = sonar.last](std::uint32_t, double threshold) {
    return cloud_payload(name, *ping, threshold);
  });
}

/// Makes a payload, once per threshold. Of the pings that arrive meanwhile, only the last is kept and used next.
void ViewFeed::make_slowly(SonarView& sonar, Slow SonarView::*which, MakePayload make) {
  Slow& slow = sonar.*which;
  const auto now = Steady::now();
  const Time at = sonar.last->request.fired_at;
  const double most_hz = channels_.at(slow.channels.front()).most_hz;
  if (slow.under_way || now < slow.begun_at + nanoseconds_from(1 / most_hz)) return;
  decltype(slow.made) made;
  each([&](const ViewConnection& c) {
    for (const std::uint32_t channel : slow.channels)
      if (c.viewer().subscribes(channel)) made[{channel, threshold_of(c.viewer(), slow)}];
  });
  const auto is_there = [&slow](const auto& one) { return slow.made.contains(one.first); };
  if (made.empty() || (slow.of == at && std::all_of(made.begin(), made.end(), is_there))) return;
  // The thread uses only copies. If the sonar's make changes meanwhile, the result is dropped.
  slow.under_way = true;
  slow.begun_at = now;
  asio::post(thread_, [this, name = sonar.name, of = sonar.make, which, at, make = std::move(make), made]() mutable {
    try {
      for (auto& [key, payload] : made) payload = make(key.first, key.second);
    } catch (const std::bad_alloc&) {  // the payload is skipped, because more pings will follow
    }
    asio::post(of_.io, [this, name, of, which, at, made = std::move(made)] {
      SonarView* const found = find(name);
      if (found == nullptr || stopping_) return;
      Slow& done = found->*which;
      done.under_way = false;
      if (found->make != of) return;
      done.of = at;
      done.made = made;
      each([&](ViewConnection& c) {
        give(c.viewer(), done);
        c.wake();
      });
    });
  });
}

/// Returns the poses of vehicles, sonars and moving objects, at the last pings or, without pings, now.
ViewPayloadPointer ViewFeed::places() const {
  const Time now = of_.clock.now();
  std::vector<foxglove::Transform> all;
  Time newest = Time::min();
  std::shared_ptr<const Ping> last;
  std::vector<bool> has_vehicle(of_.config.vehicles.size(), false);
  for (const Device& device : of_.fleet.devices()) {
    const SonarConfig& config = device.config();
    const auto sonar = std::find_if(sonars_.begin(), sonars_.end(), [&](const SonarView& s) { return s.name == config.name; });
    const bool is_fresh = sonar != sonars_.end() && sonar->last && now - sonar->last->request.fired_at < std::chrono::seconds(1);
    if (config.vehicle >= has_vehicle.size()) continue;
    const Time at = is_fresh ? sonar->last->request.fired_at : now;
    const Pose vehicle = is_fresh ? sonar->last->request.vehicle_in_world : of_.world.vehicle_at(config.vehicle, now);
    const Pose in_vehicle = is_fresh ? compose(inverse(vehicle), sonar->last->request.sonar_in_world)
                                     : compose(inverse(vehicle), device.sonar().pose_at(now));
    const std::string& name = of_.config.vehicles[config.vehicle].name;
    if (!has_vehicle[config.vehicle]) all.push_back({at, "world", name, vehicle});
    has_vehicle[config.vehicle] = true;
    all.push_back({at, name, config.name, in_vehicle});
    if (is_fresh && at > newest) last = sonar->last;
    newest = std::max(newest, at);
  }
  for (std::size_t i = 0; i < has_vehicle.size(); ++i)
    if (!has_vehicle[i]) all.push_back({now, "world", of_.config.vehicles[i].name, of_.world.vehicle_at(i, now)});
  const Scene& scene = *of_.changes.scene();
  const bool of_ping = last && last->request.bodies_in_world.size() == scene.body_names.size();
  const std::vector<Pose> bodies = of_ping ? last->request.bodies_in_world : of_.world.objects_at(now);
  for (std::size_t i = 0; i < scene.body_names.size() && i < bodies.size(); ++i)
    all.push_back({of_ping ? last->request.fired_at : now, "world", "object/" + scene.body_names[i], bodies[i]});
  return view_payload(newest == Time::min() ? now : newest, foxglove::transforms(all));
}

// Previews: pings only for viewers, while no driver is connected (daemon/emulator/view/ping_payloads.hpp).

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
