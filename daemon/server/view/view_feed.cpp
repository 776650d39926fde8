#include "daemon/server/view/view_feed.hpp"

#include <unistd.h>

#include <algorithm>
#include <limits>
#include <new>
#include <utility>

#include "daemon/emulator/view/ping_payloads.hpp"
#include "daemon/server/view/view_messages.hpp"
#include "protocol/foxglove/foxglove_messages.hpp"
#include "protocol/foxglove/ros_cdr.hpp"

namespace sonar {
namespace {

using ChannelKind = ViewChannel::Kind;
using std::chrono::milliseconds;

constexpr milliseconds tick_period{100}, status_period{1000}, after_change{200};
constexpr double image_hz = 30, fan_hz = 10, cloud_hz = 5, places_hz = 30, ping_hz = 50;
constexpr std::size_t most_advertised = 100;  // in one message
constexpr int nice_by = 5;

const Sender ourselves{"live view", "live view"};

}  // namespace

ViewFeed::ViewFeed(const Viewed& of) : of_(of), timer_(of.io) {
  asio::post(thread_, [] {
    if (::nice(nice_by) == -1) return;  // costs only smoothness
  });
  tf_ = add_channel("/tf", "foxglove.FrameTransforms", ChannelKind::last_value, places_hz);
  scene_ = add_channel("/scene", "foxglove.SceneUpdate", ChannelKind::last_value);
  swath_ = add_channel("/swath", "foxglove.SceneUpdate", ChannelKind::last_value);
  log_ = add_channel("/log", "foxglove.Log", ChannelKind::event);
  channels_.at(log_).deepest = lines_kept;
  status_ = add_channel("/status", "sonar.v1.DaemonStatus", ChannelKind::last_value, 5);
  faults_ = add_channel("/faults", "sonar.v1.FaultReport", ChannelKind::last_value);
  if (of_.config.control.token_file.empty()) secrets_.make_key();
  of_.log.listen(
      [this](LogLevel level, const std::string& line, const std::vector<LogField>& fields) { on_log(level, line, fields); });
}

ViewFeed::~ViewFeed() {
  of_.log.listen({});
  thread_.join();
}

void ViewFeed::stop() {
  stopping_ = true;
  timer_.cancel();
  of_.fleet.tap_pings({});
}

// ---- viewers

void ViewFeed::add(const std::shared_ptr<ViewConnection>& connection) {
  if (session_.empty())
    session_ = std::to_string(ViewSecrets::Steady::now().time_since_epoch().count()) + "-" + std::to_string(++sessions_);
  sync_sonars();
  connections_.push_back(connection);
  Viewer& viewer = connection->viewer();
  viewer.greet(server_info(viewer));
  std::vector<foxglove::Channel> channels;
  for (const auto& [id, channel] : channels_) channels.push_back(channel.advertised);
  for (std::size_t at = 0; at < channels.size(); at += most_advertised)
    viewer.greet(foxglove::advertise(std::span(channels).subspan(at, std::min(most_advertised, channels.size() - at))));
  viewer.greet(services_word());
  if (of_.clock.stepped()) viewer.set_time(of_.clock.now());
  of_.fleet.tap_pings([this](const Device& of, const PingQueued& queued) { on_ping(of, queued); });
  of_.log.info("viewer connected", {{"from", viewer.who()}, {"steers", viewer.may_steer() ? "yes" : "no"}});
  arm();
}

bool ViewFeed::is_full() const {
  const auto open = std::count_if(connections_.begin(), connections_.end(), [](const std::weak_ptr<ViewConnection>& weak) {
    const auto connection = weak.lock();
    return connection && !connection->over();
  });
  return open >= of_.config.limits.viewers;
}

std::string ViewFeed::server_info(const Viewer& viewer) const {
  foxglove::ServerInfo info;
  info.name = "sonard " SONARD_VERSION;
  info.capabilities = {"parameters", "parametersSubscribe", "services"};
  if (of_.clock.stepped()) info.capabilities.emplace_back("time");
  info.metadata = {{"sonard.version", SONARD_VERSION},
                   {"sonard.config", of_.config.source},
                   {"sonard.scene", of_.config.scene.name()},
                   {"sonard.clock", std::string(name_of(of_.config.clock))},
                   {"sonard.may_steer", viewer.may_steer() ? "true" : "false"}};
  info.session = session_;
  return foxglove::text_of(info);
}

const ViewChannel* ViewFeed::channel(std::uint32_t id) const {
  const auto found = channels_.find(id);
  return found == channels_.end() ? nullptr : &found->second;
}

void ViewFeed::on_subscribed(Viewer& viewer, std::uint32_t channel) {
  const auto now = ViewConnection::now();
  if (channel == log_) {
    for (const ViewPayloadPointer& line : lines_) viewer.offer(log_, line, now);
  } else if (const ViewPayloadPointer payload = current(channel)) {
    viewer.offer(channel, payload, now);
  }
  for (SonarView& sonar : sonars_)
    if (channel == sonar.fan.channel || channel == sonar.cloud.channel) begin_slow_ones(sonar);
}

/// What newcomers get; null = nothing.
ViewPayloadPointer ViewFeed::current(std::uint32_t channel) {
  if (channel == tf_) return places();
  if (channel == status_) return status();
  if (channel == faults_) return faults();
  if (channel == scene_ || channel == swath_) {
    ViewPayload payload{of_.clock.now(), {}, true};
    if (channel == scene_) payload.pieces = shapes_.all();
    for (const SonarView& sonar : sonars_)
      if (channel == swath_ && sonar.last) payload.pieces.push_back(swath_payload(sonar.name, *sonar.last)->pieces.front());
    return payload.pieces.empty() ? nullptr : std::make_shared<const ViewPayload>(std::move(payload));
  }
  for (const SonarView& sonar : sonars_) {
    if (!sonar.last) continue;
    if (channel == sonar.image) return image_payload(sonar.name, sonar.last);
    if (channel == sonar.geometry) return geometry_payload(*sonar.last);
    if (channel == sonar.fan.channel) return sonar.fan.last;
    if (channel == sonar.cloud.channel) return sonar.cloud.last;
  }
  return nullptr;
}

bool ViewFeed::wanted(std::uint32_t channel) const {
  return std::any_of(connections_.begin(), connections_.end(), [channel](const std::weak_ptr<ViewConnection>& weak) {
    const auto connection = weak.lock();
    return connection && connection->viewer().subscribes(channel);
  });
}

void ViewFeed::offer(std::uint32_t channel, const ViewPayloadPointer& payload) {
  if (payload == nullptr) return;
  const auto now = ViewConnection::now();
  each([&](ViewConnection& connection) {
    connection.viewer().offer(channel, payload, now);
    connection.wake();
  });
}

// ---- channels

std::uint32_t ViewFeed::add_channel(const std::string& topic, const std::string& schema, ChannelKind kind, double most_hz) {
  const std::uint32_t id = ++last_channel_;
  channels_[id] = {{id, topic, "protobuf", foxglove::protobuf_schema(schema)}, kind, most_hz};
  return id;
}

ViewFeed::SonarView* ViewFeed::find(const std::string& name) {
  const auto found = std::find_if(sonars_.begin(), sonars_.end(), [&](const SonarView& s) { return s.name == name; });
  return found == sonars_.end() ? nullptr : &*found;
}

/// Sonars come and go with the configuration.
void ViewFeed::sync_sonars() {
  const auto& devices = of_.fleet.devices();
  for (auto sonar = sonars_.begin(); sonar != sonars_.end();) {
    const bool is_there =
        std::any_of(devices.begin(), devices.end(), [&](const Device& d) { return d.config().name == sonar->name; });
    if (!is_there) remove(*sonar);
    sonar = is_there ? std::next(sonar) : sonars_.erase(sonar);
  }
  std::vector<foxglove::Channel> added;
  for (const Device& device : devices) {
    const std::string& name = device.config().name;
    if (find(name) != nullptr) continue;
    const std::uint32_t before = last_channel_;
    SonarView sonar{name};
    sonar.image = add_channel("/" + name + "/image", "foxglove.RawImage", ChannelKind::picture, image_hz);
    sonar.geometry = add_channel("/" + name + "/geometry", "sonar.v1.PingGeometry", ChannelKind::last_value);
    sonar.ping = add_channel("/" + name + "/ping", "sonar.v1.PingEvent", ChannelKind::event, ping_hz);
    sonar.fan.channel = add_channel("/" + name + "/fan", "foxglove.RawImage", ChannelKind::picture, fan_hz);
    sonar.cloud.channel = add_channel("/" + name + "/cloud", "foxglove.PointCloud", ChannelKind::picture, cloud_hz);
    sonar.figures = add_channel("/" + name + "/figures", "", ChannelKind::event, ping_hz);
    channels_.at(sonar.figures).advertised.encoding = "cdr";
    channels_.at(sonar.figures).advertised.schema = foxglove::figures_schema();
    sonars_.push_back(std::move(sonar));
    for (std::uint32_t id = before + 1; id <= last_channel_; ++id) added.push_back(channels_.at(id).advertised);
  }
  if (!added.empty()) each([&](ViewConnection& c) { c.viewer().say(foxglove::advertise(added)); });
}

void ViewFeed::remove(const SonarView& sonar) {
  const std::vector<std::uint32_t> gone{sonar.image,   sonar.geometry,    sonar.ping,
                                        sonar.figures, sonar.fan.channel, sonar.cloud.channel};
  for (const std::uint32_t id : gone) channels_.erase(id);
  session_ = session_.substr(0, session_.find('-')) + "-" + std::to_string(++sessions_);
  each([&](ViewConnection& c) {
    for (const std::uint32_t id : gone) c.viewer().forget(id);
    c.viewer().say(foxglove::unadvertise(gone));
    c.viewer().say(server_info(c.viewer()));
  });
}

// ---- pings

void ViewFeed::on_ping(const Device& of, const PingQueued& queued) {
  SonarView* const sonar = find(of.config().name);
  if (sonar == nullptr) return;
  const Ping& ping = *queued.ping;
  sonar->last = queued.ping;
  ping_at_ = Steady::now();
  if (wanted(sonar->geometry))
    if (wire::Bytes shape = foxglove::geometry(ping, 0); shape != sonar->shape) {
      sonar->shape = std::move(shape);
      offer(sonar->geometry, geometry_payload(ping));
    }
  if (wanted(sonar->image)) offer(sonar->image, image_payload(sonar->name, queued.ping));
  if (wanted(sonar->ping)) offer(sonar->ping, ping_payload(of, queued));
  if (wanted(sonar->figures)) offer(sonar->figures, figures_payload(of, queued));
  if (wanted(tf_)) offer(tf_, places());
  if (wanted(swath_)) {
    const PingSettings& s = ping.request.settings;
    const std::string volume = std::to_string(s.mode) + " " + std::to_string(s.range_m) + " " + std::to_string(s.range_start_m);
    if (std::exchange(sonar->volume, volume) != volume) offer(swath_, swath_payload(sonar->name, ping));
  }
  begin_slow_ones(*sonar);
  if (of_.clock.stepped()) arm();
}

void ViewFeed::begin_slow_ones(SonarView& sonar) {
  if (sonar.last == nullptr) return;
  make_slowly(sonar, &SonarView::fan, fan_hz, [name = sonar.name, ping = sonar.last] { return fan_payload(name, *ping); });
  make_slowly(sonar, &SonarView::cloud, cloud_hz,
              [name = sonar.name, ping = sonar.last] { return cloud_payload(name, *ping, 0.35); });
}

/// Pings that come meanwhile are skipped, but for the last: it is made when this one is done.
void ViewFeed::make_slowly(SonarView& sonar, Slow SonarView::*which, double most_hz, Make make) {
  Slow& slow = sonar.*which;
  const auto now = Steady::now();
  const Time at = sonar.last->request.fired_at;
  if (slow.under_way || (slow.last && slow.last->at == at) || now < slow.begun_at + nanoseconds_from(1 / most_hz) ||
      !wanted(slow.channel))
    return;
  slow.under_way = true;
  slow.begun_at = now;
  asio::post(thread_, [this, name = sonar.name, which, make = std::move(make)] {
    ViewPayloadPointer made;
    try {
      made = make();
    } catch (const std::bad_alloc&) {  // there will be other pings
    }
    asio::post(of_.io, [this, name, which, made = std::move(made)] {
      SonarView* const found = find(name);
      if (found == nullptr || stopping_) return;
      Slow& done = found->*which;
      done.under_way = false;
      done.last = made;
      offer(done.channel, made);
    });
  });
}

/// Where vehicles, sonars and moving objects are: as the last pings saw them, else now.
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

// ---- what changes without pings

void ViewFeed::on_log(LogLevel level, const std::string& line, const std::vector<LogField>& fields) {
  const auto sonar = std::find_if(fields.begin(), fields.end(), [](const LogField& f) { return f.key == "sonar"; });
  const auto severity = level == LogLevel::error     ? foxglove::Severity::error
                        : level == LogLevel::warning ? foxglove::Severity::warning
                                                     : foxglove::Severity::info;
  const Time now = of_.clock.now();
  lines_.push_back(view_payload(now, foxglove::log_line(now, severity, line, sonar == fields.end() ? "sonard" : sonar->value)));
  if (lines_.size() > lines_kept) lines_.pop_front();
  changed_ = true;  // most of what is logged shows in the status
  offer(log_, lines_.back());
}

void ViewFeed::arm() {
  if (stopping_ || std::exchange(armed_, true)) return;
  timer_.expires_after(tick_period);
  timer_.async_wait([this](const error_code& ec) {
    armed_ = false;
    if (!ec && !stopping_) tick();
  });
}

void ViewFeed::tick() {
  std::vector<std::string> gone;
  std::erase_if(connections_, [&gone](const std::weak_ptr<ViewConnection>& weak) {
    const auto connection = weak.lock();
    if (connection && connection->over()) gone.push_back(connection->viewer().who());
    return !connection || connection->over();
  });
  for (const std::string& who : gone) of_.log.info("viewer gone", {{"from", who}});
  if (connections_.empty()) {
    of_.fleet.tap_pings({});
    for (SonarView& sonar : sonars_) {  // the next viewer gets geometry and swath anew
      sonar.last.reset();
      sonar.shape.clear();
      sonar.volume.clear();
    }
    shapes_.clear();
    return;
  }
  sync_sonars();
  const Time now = of_.clock.now();
  if (of_.clock.stepped() && std::exchange(told_, now) != now)
    each([now](ViewConnection& c) {
      c.viewer().set_time(now);
      c.wake();
    });
  for (SonarView& sonar : sonars_) begin_slow_ones(sonar);
  if (wanted(scene_)) {
    SceneShapes::Job job;
    offer_scene(shapes_.update(of_.changes.scene(), of_.world, now, job));
    if (!job.objects.empty())
      asio::post(thread_, [this, job = std::move(job)] {
        auto made = std::make_shared<std::vector<SceneShapes::Made>>(SceneShapes::make(job));
        asio::post(of_.io, [this, made] { offer_scene(shapes_.take(std::move(*made))); });
      });
  }
  const auto since_status = Steady::now() - status_at_;
  if (since_status >= status_period || (changed_ && since_status >= after_change)) offer_status();
  arm();
}

void ViewFeed::offer_scene(std::vector<ViewPayload::Piece> pieces) {
  if (pieces.empty()) return;
  offer(scene_, std::make_shared<const ViewPayload>(ViewPayload{of_.clock.now(), std::move(pieces), true}));
}

void ViewFeed::offer_status() {
  status_at_ = Steady::now();
  changed_ = false;
  if (wanted(status_)) offer(status_, status());
  if (wanted(faults_)) {
    ViewPayloadPointer now = faults();
    const bool is_news = !faults_said_ || *now->pieces.front().bytes != *faults_said_->pieces.front().bytes;
    if (is_news) offer(faults_, faults_said_ = now);
  }
  push_parameters();
  if (wanted(tf_) && status_at_ - ping_at_ >= status_period) offer(tf_, places());
}

/// Those that wait, act, or are over.
ViewPayloadPointer ViewFeed::faults() const {
  ViewPayloadPointer payload;
  const control::GetFaults without_journal{.journal_after = std::numeric_limits<std::uint64_t>::max()};
  of_.operations.perform(without_journal, ourselves, [&](const OperationResult& result) {
    if (result.faults) payload = faults_payload(of_.clock.now(), *result.faults);
  });
  return payload;
}

ViewPayloadPointer ViewFeed::status() const {
  ViewPayloadPointer payload;
  of_.operations.perform(control::GetStatus{}, ourselves, [&](const OperationResult& result) {
    if (result.status) payload = status_payload(of_.clock.now(), *result.status);
  });
  return payload;
}

}  // namespace sonar
