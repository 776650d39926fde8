#include "daemon/server/view/view_feed.hpp"

#include <unistd.h>

#include <algorithm>
#include <limits>
#include <utility>

#include "daemon/emulator/view/ping_payloads.hpp"
#include "daemon/server/view/view_parameters.hpp"
#include "protocol/foxglove/foxglove_messages.hpp"

namespace sonar {
namespace {

using ChannelKind = ViewChannel::Kind;
using std::chrono::milliseconds;

constexpr milliseconds tick_period{100}, status_period{1000}, after_change{200};
constexpr double image_hz = 30, fan_hz = 10, cloud_hz = 5, places_hz = 30;
constexpr std::size_t most_advertised = 100;  // number of channels in one message

const Sender ourselves{"live view", "live view"};

void advertise(Viewer& viewer, std::span<const foxglove::Channel> channels) {
  for (std::size_t at = 0; at < channels.size(); at += most_advertised)
    viewer.greet(foxglove::advertise(channels.subspan(at, std::min(most_advertised, channels.size() - at))));
}

}  // namespace

ViewFeed::ViewFeed(const Viewed& of) : of_(of), timer_(of.io) {
  asio::post(thread_, [] { [[maybe_unused]] const int niceness = ::nice(5); });  // if this fails, the thread keeps its priority
  tf_ = add_channel("/tf", "foxglove.FrameTransforms", ChannelKind::last_value, places_hz);
  scene_ = add_channel("/scene", "foxglove.SceneUpdate", ChannelKind::last_value);
  swath_ = add_channel("/swath", "foxglove.SceneUpdate", ChannelKind::last_value);
  log_ = add_channel("/log", "foxglove.Log", ChannelKind::event);
  channels_.at(log_).deepest = lines_kept;
  status_ = add_channel("/status", "sonar.v1.DaemonStatus", ChannelKind::last_value, 5);
  faults_ = add_channel("/faults", "sonar.v1.FaultReport", ChannelKind::last_value);
  doctor_channel_ = add_channel("/doctor", "sonar.v1.Findings", ChannelKind::last_value);
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
  const std::string no_playback = begin_playback(viewer, connection->playback());
  viewer.greet(server_info(viewer));
  send_time(viewer);
  std::vector<foxglove::Channel> channels;
  for (const auto& [id, channel] : channels_) channels.push_back(channel.advertised);
  advertise(viewer, channels);
  viewer.greet(services_word());
  if (!no_playback.empty()) viewer.send_status(foxglove::StatusLevel::warning, no_playback);
  if (const auto watch = watches_.find(viewer.playback()); watch != watches_.end())
    viewer.say_frame(foxglove::playback_frame(watch->second.state(of_.clock.now())));
  of_.fleet.tap_pings([this](const Device& of, const PingQueued& queued) { on_ping(of, queued); },
                      [this](const std::string& sonar) { return wants_truth(sonar); });
  of_.log.info("viewer connected", {{"from", viewer.who()}, {"steers", viewer.may_steer() ? "yes" : "no"}});
  arm();
}

/// Sends the time, unless the viewer uses the time of arrival.
void ViewFeed::send_time(Viewer& viewer) const {
  const Time now = of_.clock.now();
  if (const auto watch = watches_.find(viewer.playback()); watch != watches_.end())
    viewer.say_frame(foxglove::time_frame(watch->second.stamp(now)));
  else if (of_.clock.stepped())
    viewer.say_frame(foxglove::time_frame(now));
}

bool ViewFeed::is_full() const {
  int open = recordings_.count();
  each([&open](const ViewConnection&) { ++open; });
  return open >= of_.config.limits.viewers;
}

std::vector<ViewerFigures> ViewFeed::viewers() const {
  std::vector<ViewerFigures> all;
  each([&](const ViewConnection& c) {
    ViewerFigures one{c.address(), c.viewer().may_steer()};
    for (const auto& [id, count] : c.viewer().dropped())
      if (const ViewChannel* const of = channel(id)) one.dropped[of->advertised.topic] = count;
    all.push_back(std::move(one));
  });
  return all;
}

const ViewChannel* ViewFeed::channel(std::uint32_t id) const {
  const auto found = channels_.find(id);
  return found == channels_.end() ? nullptr : &found->second;
}

void ViewFeed::on_subscribed(Viewer& viewer, std::uint32_t channel) {
  if (channel == log_)
    for (const ViewPayloadPointer& line : lines_) give(viewer, log_, line);
  else
    give(viewer, channel, current(viewer, channel));
  for (SonarView& sonar : sonars_)
    if (channel == sonar.fan || channel == sonar.about || channel == sonar.cloud) begin_slow_ones(sonar);
  drive_previews();
}

/// Returns the present value of a channel for a new subscriber; null if there is none.
ViewPayloadPointer ViewFeed::current(const Viewer& viewer, std::uint32_t channel) {
  if (channel == tf_) return places();
  if (channel == status_) return status();
  if (channel == faults_) return faults();
  if (channel == doctor_channel_) return doctor_.newest();
  if (channel == scene_ || channel == swath_) {
    ViewPayload payload{of_.clock.now(), {}, true};
    if (channel == scene_) payload.pieces = shapes_.all();
    for (const SonarView& sonar : sonars_)
      if (channel == swath_ && sonar.last) payload.pieces.push_back(swath_payload(sonar.name, *sonar.last)->pieces.front());
    return payload.pieces.empty() ? nullptr : std::make_shared<const ViewPayload>(std::move(payload));
  }
  for (const SonarView& sonar : sonars_) {
    if (!sonar.last) continue;
    if (channel == sonar.image) return sonar.picture ? sonar.picture : image_payload(sonar.name, sonar.last);
    if (channel == sonar.geometry) return geometry_payload(*sonar.last);
    if (channel == sonar.cloud && sonar.by_lines)
      return cloud_payload(sonar.name, *sonar.last, threshold_of(viewer, sonar.points));
    for (const Slow* slow : {&sonar.drawn, &sonar.points})
      if (const auto made = slow->made.find({channel, threshold_of(viewer, *slow)}); made != slow->made.end())
        return made->second;
  }
  return nullptr;
}

std::weak_ptr<ViewConnection> ViewFeed::connection_of(const Viewer& viewer) const {
  std::weak_ptr<ViewConnection> found;
  each([&](ViewConnection& c) {
    if (&c.viewer() == &viewer) found = c.weak_from_this();
  });
  return found;
}

bool ViewFeed::wanted(std::uint32_t channel) const {
  return std::any_of(connections_.begin(), connections_.end(), [channel](const std::weak_ptr<ViewConnection>& weak) {
    const auto connection = weak.lock();
    return connection && connection->viewer().subscribes(channel);
  });
}

void ViewFeed::offer(std::uint32_t channel, const ViewPayloadPointer& payload) {
  if (payload == nullptr) return;
  each([&](ViewConnection& connection) {
    give(connection.viewer(), channel, payload);
    connection.wake();
  });
}

void ViewFeed::give(Viewer& viewer, std::uint32_t channel, const ViewPayloadPointer& payload) {
  if (payload != nullptr && viewer.subscribes(channel))
    viewer.offer(channel, in_time_of(viewer, channel, payload), ViewConnection::now());
}

void ViewFeed::give(Viewer& viewer, const Slow& slow) {
  for (const std::uint32_t channel : slow.channels) give(viewer, channel, current(viewer, channel));
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

bool ViewFeed::wants_truth(const std::string& sonar) {
  const SonarView* const found = find(sonar);
  return found != nullptr && wanted(found->truth);
}

void ViewFeed::SonarView::forget() {
  last.reset();
  picture.reset();
  shape.clear();
  volume.clear();
  painter.reset();
  driver.reset();
  drawing = nullptr;
  for (Slow* slow : {&drawn, &points}) slow->made.clear(), slow->of = Time::min();
}

void ViewFeed::SonarView::be_of(const Device& device) {
  const protocol::Make& now = protocol::make_of_profile(device.config().profile.model->profile);
  if (std::exchange(make, &now) != &now) forget();
}

/// Adapts channels and views to the present sonars, which a reload may change.
void ViewFeed::sync_sonars() {
  const auto& devices = of_.fleet.devices();
  for (auto sonar = sonars_.begin(); sonar != sonars_.end();) {
    const bool is_there = of_.fleet.find(sonar->name) != nullptr;
    if (!is_there) remove(*sonar);
    sonar = is_there ? std::next(sonar) : sonars_.erase(sonar);
  }
  const std::uint32_t before = last_channel_;
  for (const Device& device : devices) {
    const std::string& name = device.config().name;
    const bool by_lines = device.sonar().settings().beam_count == 1;
    if (SonarView* const known = find(name)) {
      known->be_of(device);
      if (known->by_lines == by_lines) continue;
      remove_channels({known->cloud});
      add_cloud(*known, by_lines);
      continue;
    }
    SonarView sonar{name};
    sonar.image = add_channel("/" + name + "/image", "foxglove.RawImage", ChannelKind::picture, image_hz);
    sonar.geometry = add_channel("/" + name + "/geometry", "sonar.v1.PingGeometry", ChannelKind::last_value);
    sonar.ping = add_channel("/" + name + "/ping", "sonar.v1.PingEvent", ChannelKind::event);
    sonar.fan = add_channel("/" + name + "/fan", "foxglove.RawImage", ChannelKind::picture, fan_hz);
    sonar.about = add_channel("/" + name + "/picture", "sonar.v1.Picture", ChannelKind::last_value, fan_hz);
    add_cloud(sonar, by_lines);
    sonar.drawn.channels = {sonar.fan, sonar.about};
    sonar.points.threshold = "/" + name + "/view/cloud_threshold";
    sonar.truth = add_channel("/" + name + "/truth", "sonar.v1.PingTruth", ChannelKind::last_value, image_hz);
    sonar.figures = add_channel("/" + name + "/figures", "", ChannelKind::event);
    channels_.at(sonar.figures).advertised.encoding = "cdr";
    channels_.at(sonar.figures).advertised.schema = foxglove::figures_schema();
    sonars_.push_back(std::move(sonar));
  }
  std::vector<foxglove::Channel> added;
  for (std::uint32_t id = before + 1; id <= last_channel_; ++id) added.push_back(channels_.at(id).advertised);
  if (added.empty()) return;
  each([&](ViewConnection& c) {
    advertise(c.viewer(), added);
    c.wake();
  });
}

/// Adds the channel of clouds: of all pings of a sonar with one beam, else of at most cloud_hz.
void ViewFeed::add_cloud(SonarView& sonar, bool by_lines) {
  sonar.by_lines = by_lines;
  sonar.cloud = add_channel("/" + sonar.name + "/cloud", "foxglove.PointCloud",
                            by_lines ? ChannelKind::event : ChannelKind::picture, by_lines ? 0 : cloud_hz);
  sonar.points.channels = {sonar.cloud};
}

void ViewFeed::remove_channels(const std::vector<std::uint32_t>& gone) {
  for (const std::uint32_t id : gone) channels_.erase(id);
  each([&](ViewConnection& c) {
    for (const std::uint32_t id : gone) c.viewer().forget(id);
    c.viewer().say(foxglove::unadvertise(gone));
  });
}

void ViewFeed::remove(const SonarView& sonar) {
  remove_channels({sonar.image, sonar.geometry, sonar.ping, sonar.figures, sonar.truth, sonar.fan, sonar.about, sonar.cloud});
  session_ = session_.substr(0, session_.find('-')) + "-" + std::to_string(++sessions_);
  each([&](ViewConnection& c) {
    c.viewer().say(server_info(c.viewer()));
    // At a new session id viewers clear their state.
    send_time(c.viewer());
    for (const auto& [id, channel] : channels_)
      if (id != log_ && c.viewer().subscribes(id)) on_subscribed(c.viewer(), id);
    c.wake();
  });
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
  changed_ = true;  // most logged events also change the status
  offer(log_, lines_.back());
}

void ViewFeed::arm() {
  if (stopping_ || std::exchange(armed_, true)) return;
  const auto& devices = of_.fleet.devices();
  const bool is_quick = std::any_of(devices.begin(), devices.end(),
                                    [](const Device& d) { return d.preview().on() && Preview::period(d.sonar()) < tick_period; });
  timer_.expires_after(is_quick ? Preview::shortest_of_one_beam : tick_period);
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
  drive_previews();
  if (connections_.empty() && Steady::now() >= expected_until_) {
    no_preview_.clear();
    of_.fleet.tap_pings({});
    for (SonarView& sonar : sonars_) sonar.forget();  // so that the next viewer gets geometry and swath
    shapes_.clear();
    return;
  }
  sync_sonars();
  const Time now = of_.clock.now();
  if (of_.clock.stepped() && std::exchange(last_sent_time_, now) != now)
    each([now](ViewConnection& c) {
      if (c.viewer().playback().empty()) c.viewer().set_time(now);
      c.wake();
    });
  watch_playback();
  for (SonarView& sonar : sonars_) begin_slow_ones(sonar);
  if (wanted(scene_)) {
    SceneShapes::Job job;
    offer_scene(shapes_.update(of_.changes.scene(), of_.world, now, job));
    if (!job.objects.empty())
      asio::post(thread_, [this, job = std::move(job)] {
        auto made = std::make_shared<std::vector<SceneShapes::Made>>();
        try {
          *made = SceneShapes::make(job);
        } catch (const std::exception& e) {
          asio::post(of_.io, [this, why = std::string(e.what())] {
            log_limited(of_.log, failures_, LogLevel::error, "viewers get no scene: " + why);
          });
        }
        asio::post(of_.io, [this, made] { offer_scene(shapes_.take(std::move(*made))); });
      });
  }
  if (wanted(doctor_channel_)) offer(doctor_channel_, doctor_.news());
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
    const bool is_news = !last_sent_faults_ || *now->pieces.front().bytes != *last_sent_faults_->pieces.front().bytes;
    if (is_news) offer(faults_, last_sent_faults_ = now);
  }
  push_parameters();
  if (wanted(tf_) && status_at_ - ping_at_ >= status_period) offer(tf_, places());
}

/// Returns the waiting, active and ended faults.
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
