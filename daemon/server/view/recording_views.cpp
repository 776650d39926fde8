#include "daemon/server/view/recording_views.hpp"

#include <unistd.h>

#include <algorithm>
#include <new>
#include <optional>
#include <utility>

#include "core/motion/trajectory.hpp"
#include "daemon/emulator/view/ping_payloads.hpp"
#include "daemon/emulator/view/recording_player.hpp"
#include "daemon/server/view/view_parameters.hpp"
#include "protocol/control/answers.hpp"
#include "protocol/foxglove/foxglove_messages.hpp"

namespace sonar {
namespace {

using std::chrono::milliseconds;
using Steady = std::chrono::steady_clock;

constexpr milliseconds look_every{40}, say_status_every{500}, longest_slice{20};
constexpr double picture_hz = 25;
constexpr const char *sonar_name = "recording", *no_requests = "a recording has no settings";
constexpr std::uint32_t picture_channel = 1, fan_channel = 2, ping_channel = 3, status_channel = 4;

Time now() { return Time{Steady::now().time_since_epoch()}; }

}  // namespace

class RecordingViews::Seen final : public ViewerHost, public std::enable_shared_from_this<RecordingViews::Seen> {
 public:
  Seen(asio::io_context& io, asio::thread_pool& thread, PlayedRecording of)
      : io_(io), thread_(thread), of_(std::move(of)), timer_(io) {
    add(picture_channel, "picture", "sonar.v1.Picture", ViewChannel::Kind::last_value, picture_hz);
    add(fan_channel, "fan", "foxglove.RawImage", ViewChannel::Kind::picture, picture_hz);
    add(ping_channel, "ping", "sonar.v1.PingEvent", ViewChannel::Kind::event, 0);
    add(status_channel, "", "sonar.v1.DaemonStatus", ViewChannel::Kind::last_value, 0);
  }

  const ViewerLeft& left() const { return left_; }
  void begin(const std::shared_ptr<ViewConnection>& connection) {
    connection_ = connection;
    Viewer& viewer = connection->viewer();
    viewer.greet(server_info());
    std::vector<foxglove::Channel> channels;
    for (const auto& [id, channel] : channels_) channels.push_back(channel.advertised);
    viewer.greet(foxglove::advertise(channels));
    post([of = of_, left = left_](Work& work) {
      auto pings = open_pings(of, left);
      if (!pings) return static_cast<void>(work.failure = pings.error().text);
      work.player.emplace(*std::move(pings), nanoseconds_from(1 / of.rate_hz));
    });
  }

  const ViewChannel* channel(std::uint32_t id) const override {
    const auto found = channels_.find(id);
    return found == channels_.end() ? nullptr : &found->second;
  }
  void on_subscribed(Viewer& viewer, std::uint32_t channel) override {
    if (channel == status_channel) return playback_ ? give(viewer, channel, status()) : void();
    const auto made = made_.find(channel);
    if (made != made_.end()) give(viewer, channel, made->second);
    wanted_ = true;
  }
  std::vector<foxglove::Parameter> parameters(const Viewer&, const std::vector<std::string>& names) override {
    std::vector<foxglove::Parameter> all = parameters();
    if (!names.empty())
      std::erase_if(all, [&](const auto& p) { return std::find(names.begin(), names.end(), p.name) == names.end(); });
    return all;
  }
  std::string set_parameter(Viewer& viewer, const foxglove::Parameter& wanted) override;
  bool steer_playback(Viewer& viewer, const foxglove::PlaybackControl& asked) override;
  void call(Viewer& viewer, const foxglove::ServiceCall& call) override { viewer.fail(call, no_requests); }

 private:
  using Payloads = std::map<std::uint32_t, ViewPayloadPointer>;
  struct Work {
    std::optional<RecordingPlayer> player;
    PicturePainter painter{view_fan_style()};
    std::string failure;  // reason if the recording cannot be played
    bool is_measured = false;
    bool is_behind = false;  // true: the slice ended before the ping was found
    std::optional<RecordingPlayer::Ns> drawn_at;
    Payloads made;  // payloads that the slice made
    protocol::PingFacts facts;
  };

  static void go_on(Work& work, RecordingPlayer::Ns at);
  static void draw(Work& work, const RecordingPlayer::Shown& shown);

  void add(std::uint32_t id, const std::string& name, const std::string& schema, ViewChannel::Kind kind, double most_hz) {
    const std::string topic = name.empty() ? "/status" : std::string("/") + sonar_name + "/" + name;
    channels_[id] = {{id, topic, "protobuf", foxglove::protobuf_schema(schema)}, kind, most_hz};
  }
  void give(Viewer& viewer, std::uint32_t channel, const ViewPayloadPointer& payload) {
    if (payload != nullptr && viewer.subscribes(channel)) viewer.offer(channel, payload, ViewConnection::now());
  }

  void post(auto job) {
    busy_ = true;
    asio::post(thread_, [self = shared_from_this(), work = work_, job = std::move(job)]() mutable {
      try {
        job(*work);
      } catch (const std::bad_alloc&) {
        work->failure = "there is not enough memory to play this recording";
      } catch (const std::exception& e) {
        work->failure = std::string("the recording cannot be played: ") + e.what();
      }
      asio::io_context& io = self->io_;
      asio::post(io, [self = std::move(self)] { self->take(); });
    });
  }
  void take();
  void tick();
  void arm();
  void publish();
  std::string server_info() const;
  ViewPayloadPointer status() const;
  std::vector<foxglove::Parameter> parameters() const;
  void say_changes();
  motion::Playback& line() { return *playback_; }
  foxglove::PlaybackState state() {
    foxglove::PlaybackState holds = PlaybackWatch(line(), now()).state(now());
    holds.at += begin_ - Time{};
    return holds;
  }
  bool stands(Time at) const { return playback_->paused() || playback_->ended(at); }
  void play(bool on);

  asio::io_context& io_;
  asio::thread_pool& thread_;
  PlayedRecording of_;
  ViewerLeft left_ = std::make_shared<std::atomic<bool>>(false);
  std::weak_ptr<ViewConnection> connection_;
  std::map<std::uint32_t, ViewChannel> channels_;
  std::shared_ptr<Work> work_ = std::make_shared<Work>();
  std::optional<motion::Playback> playback_;  // set when the length is known
  // Results of the last slice:
  std::string failure_;
  std::shared_ptr<const SonarModel> model_;  // null: no message names the model
  Time begin_{};
  std::uint64_t count_ = 0;
  protocol::PingFacts facts_;
  Payloads made_;
  std::optional<RecordingPlayer::Ns> shown_for_;
  asio::steady_timer timer_;
  Steady::time_point status_at_{};
  std::vector<foxglove::Parameter> sent_;
  bool busy_ = false, behind_ = false, wanted_ = false;
};

/// Does one slice of the work: measures the recording, or finds the ping at the present time and draws it.
void RecordingViews::Seen::go_on(Work& work, RecordingPlayer::Ns at) {
  if (!work.player) return;
  RecordingPlayer& player = *work.player;
  const auto until = Steady::now() + longest_slice;
  work.is_behind = true;
  while (work.is_behind && Steady::now() < until) work.is_behind = work.is_measured ? player.approach(at) : player.measure();
  if (!work.is_measured) {
    work.is_measured = !work.is_behind;
    work.is_behind = true;  // nothing is drawn yet
    if (work.is_measured && player.count() == 0) work.failure = "the recording holds no ping that can be shown";
  } else if (const auto* const shown = player.shown(); shown != nullptr && work.drawn_at != shown->at) {
    draw(work, *shown);
  }
}

void RecordingViews::Seen::draw(Work& work, const RecordingPlayer::Shown& shown) {
  work.drawn_at = shown.at;
  work.facts = shown.ping.facts;
  const Time at = work.player->begin() + shown.at;
  v1::PingEvent event;
  event.set_sonar(sonar_name);
  event.set_number(shown.ping.facts.number);
  event.set_fired_at_ns(at.time_since_epoch().count());
  event.set_range_m(shown.ping.facts.range_m);
  event.set_beams(shown.ping.facts.beams);
  event.set_rows(shown.ping.facts.rows);
  wire::Bytes bytes(event.ByteSizeLong());
  event.SerializeToArray(bytes.data(), static_cast<int>(bytes.size()));
  work.made[ping_channel] = view_payload(at, std::move(bytes));
  const auto picture = protocol::drawing_of(shown.ping);
  if (!picture) return;  // for example, if the sweep has too few lines yet
  work.made[picture_channel] = picture_payload(at, *picture);
  work.made[fan_channel] = fan_payload(sonar_name, at, *picture, work.painter);
}

/// Takes the results on the I/O thread after each slice of work. While `busy_`, only the work thread uses `work_`.
void RecordingViews::Seen::take() {
  busy_ = false;
  const auto connection = connection_.lock();
  if (!connection || connection->over()) return;
  Work& work = *work_;
  behind_ = work.is_behind || !work.is_measured;
  if (work.player && work.player->by().sender.names_model) model_ = work.player->by().sender.model;
  if (!work.failure.empty() && std::exchange(failure_, work.failure).empty()) {
    connection->viewer().say(server_info());
    connection->wake();
    return;
  }
  if (!failure_.empty()) return;
  if (work.is_measured && !playback_) {
    begin_ = work.player->begin();
    count_ = work.player->count();
    playback_.emplace(work.player->length(), motion::PlaybackRules{}, now());
    connection->viewer().say(server_info());
    connection->viewer().say_frame(foxglove::playback_frame(state()));
    wanted_ = true;
  }
  facts_ = work.facts;
  for (auto& [channel, payload] : std::exchange(work.made, {})) {
    made_[channel] = payload;
    give(connection->viewer(), channel, payload);
  }
  connection->wake();
  behind_ ? tick() : arm();
}

void RecordingViews::Seen::arm() {
  timer_.expires_after(look_every);
  timer_.async_wait([weak = weak_from_this()](const error_code& ec) {
    if (const auto self = weak.lock(); self && !ec) self->tick();
  });
}

/// Begins a slice if one is due. take() and the timer call it.
void RecordingViews::Seen::tick() {
  const auto connection = connection_.lock();
  if (!connection || connection->over()) return;
  publish();
  if (busy_) return;
  const auto at = playback_ ? line().place(now()).at : RecordingPlayer::Ns{0};
  if (!behind_ && shown_for_ == at && !std::exchange(wanted_, false)) return arm();
  shown_for_ = at;
  post([at](Work& work) { go_on(work, at); });
}

void RecordingViews::Seen::publish() {
  const auto connection = connection_.lock();
  if (!connection || !playback_) return;
  say_changes();
  if (Steady::now() < status_at_ + say_status_every) return;
  status_at_ = Steady::now();
  give(connection->viewer(), status_channel, status());
  connection->viewer().set_time(begin_ + line().place(now()).at);
  connection->wake();
}

std::string RecordingViews::Seen::server_info() const {
  foxglove::ServerInfo info;
  info.name = "sonard " SONARD_VERSION;
  info.capabilities = {"parameters", "parametersSubscribe", "time"};
  if (playback_) {
    info.capabilities.emplace_back("playbackControl");
    info.data = {begin_, begin_ + playback_->duration()};
  }
  info.metadata = {{"sonard.version", SONARD_VERSION},
                   {"sonard.recording", of_.file.filename().string()},
                   {"sonard.clock", "realtime"},
                   {"sonard.may_steer", "true"}};
  if (!failure_.empty()) info.metadata["sonard.recording_failure"] = failure_;
  if (model_) info.metadata["sonard.product." + model_->profile] = model_->name;
  info.session = "recording " + of_.file.filename().string();
  return foxglove::text_of(info);
}

/// Returns the status for the page's time line, in which the recording has the role of a vehicle's trajectory.
ViewPayloadPointer RecordingViews::Seen::status() const {
  v1::DaemonStatus status;
  status.set_version(SONARD_VERSION);
  status.set_clock("realtime");
  v1::SonarStatus& sonar = *status.add_sonars();
  sonar.set_name(sonar_name);
  if (model_) sonar.set_profile(model_->profile);
  sonar.set_transmits(true);
  sonar.set_range_m(facts_.range_m);
  sonar.set_beams(facts_.beams);
  sonar.set_rows(facts_.rows);
  sonar.set_frequency_hz(facts_.frequency_hz);
  sonar.mutable_figures()->set_pings(count_);
  Time at = begin_;
  if (playback_) {
    const Time when = now();
    at += playback_->place(when).at;
    v1::VehicleStatus& vehicle = *status.add_vehicles();
    vehicle.set_name(sonar_name);
    v1::TrajectoryStatus& trajectory = *vehicle.mutable_trajectory();
    trajectory.set_file(of_.file.filename().string());
    trajectory.set_position_s(seconds(playback_->place(when).at));
    trajectory.set_duration_s(seconds(playback_->duration()));
    trajectory.set_speed(playback_->rules().speed.factor());
    trajectory.set_paused(stands(when));
  }
  status.set_now_ns(at.time_since_epoch().count());
  return status_payload(at, status);
}

std::vector<foxglove::Parameter> RecordingViews::Seen::parameters() const {
  if (!playback_) return {};
  const std::string own = std::string("/") + sonar_name + "/trajectory/";
  const Time when = now();
  return {{own + "paused", stands(when)},
          {own + "position_s", seconds(playback_->place(when).at)},
          {own + "speed", playback_->rules().speed.factor()}};
}

void RecordingViews::Seen::say_changes() {
  const auto connection = connection_.lock();
  std::vector<foxglove::Parameter> holds = parameters(), changed;
  for (const foxglove::Parameter& p : holds)
    if (std::find(sent_.begin(), sent_.end(), p) == sent_.end()) changed.push_back(p);
  sent_ = std::move(holds);
  if (!connection || changed.empty() || (changed.size() == 1 && changed.front().name.ends_with("position_s") && !stands(now())))
    return;
  connection->viewer().on_parameters(changed);
  connection->viewer().say_frame(foxglove::playback_frame(state()));
  connection->wake();
}

void RecordingViews::Seen::play(bool on) {
  const Time when = now();
  if (on && line().ended(when)) line().seek(when, RecordingPlayer::Ns{0});
  if (on && line().paused()) line().resume(when);
  if (!on && !line().paused()) line().pause(when);
}

std::string RecordingViews::Seen::set_parameter(Viewer&, const foxglove::Parameter& wanted) {
  if (!playback_) return "the recording is still being read";
  const auto number = number_of(wanted.value);
  if (wanted.name.ends_with("/trajectory/paused")) {
    const bool* const paused = std::get_if<bool>(&wanted.value);
    if (paused == nullptr) return "must be true or false";
    play(!*paused);
  } else if (wanted.name.ends_with("/trajectory/position_s")) {
    if (!number) return "must be a number of seconds";
    const double at_s = std::clamp(*number, 0.0, seconds(line().duration()));
    line().seek(now(), std::min(nanoseconds_from(at_s), line().duration()));
  } else if (wanted.name.ends_with("/trajectory/speed")) {
    const auto speed = number ? motion::Speed::from(*number) : std::nullopt;
    if (!speed) return "must be a number from 0.001 to 1000";
    line().use_speed(now(), *speed);
  } else {
    return no_requests;
  }
  publish();
  return {};
}

bool RecordingViews::Seen::steer_playback(Viewer& viewer, const foxglove::PlaybackControl& asked) {
  if (!playback_) return false;
  if (asked.seeks) line().seek(now(), std::clamp(asked.to - begin_, RecordingPlayer::Ns{0}, line().duration()));
  play(!asked.pause);
  if (const auto speed = motion::Speed::from(static_cast<double>(asked.speed))) line().use_speed(now(), *speed);
  foxglove::PlaybackState holds = state();
  holds.did_seek = asked.seeks;
  holds.request = asked.request;
  viewer.say_frame(foxglove::playback_frame(holds));
  return true;
}

RecordingViews::RecordingViews(asio::io_context& io, Log& log) : io_(io), log_(log) {
  asio::post(thread_, [] { [[maybe_unused]] const int niceness = ::nice(5); });  // if this fails, the thread keeps its priority
}

RecordingViews::~RecordingViews() {
  for (const Viewing& one : viewings_) *one.left = true;
  thread_.stop();
  thread_.join();
}

std::shared_ptr<HttpTakeover> RecordingViews::open(ConnectionServices& services, HttpConnection& from, const HttpRequest& request,
                                                   ViewWelcome welcome, const PlayedRecording& wanted) {
  welcome.may_steer = true;  // a viewer can steer only its own time line
  const auto seen = std::make_shared<Seen>(io_, thread_, wanted);
  // The connection owns the function below and thereby this object, so the work ends with the connection.
  const std::shared_ptr<void> connected(nullptr, [left = seen->left()](void*) { *left = true; });
  return std::make_shared<ViewConnection>(
      services, from, *seen, request, welcome, [this, seen, wanted, connected](const std::shared_ptr<ViewConnection>& viewer) {
        std::erase_if(viewings_, [](const Viewing& one) { return one.connection.expired(); });
        viewings_.push_back({viewer, seen->left()});
        log_.info("viewer plays a recording", {{"file", wanted.file.filename().string()}, {"from", viewer->viewer().who()}});
        seen->begin(viewer);
      });
}

int RecordingViews::count() const {
  return static_cast<int>(std::count_if(viewings_.begin(), viewings_.end(), [](const Viewing& one) {
    const auto connection = one.connection.lock();
    return connection && !connection->over();
  }));
}

}  // namespace sonar
