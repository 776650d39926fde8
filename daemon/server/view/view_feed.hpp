// The live view in the daemon: viewers, channels, and the messages on the channels (docs/live-view.md). It gets the same pings as
// recordings, but none without viewers. Slow work runs on a separate thread, and is skipped while that thread is busy. No driver
// waits for a viewer. App owns it, and only the I/O thread uses it.
#pragma once

#include <deque>
#include <list>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "daemon/config/config.hpp"
#include "daemon/emulator/view/ping_payloads.hpp"
#include "daemon/emulator/view/recording_player.hpp"
#include "daemon/emulator/view/viewer.hpp"
#include "daemon/emulator/world/world.hpp"
#include "daemon/server/api/operations.hpp"
#include "daemon/server/engine/scene_changes.hpp"
#include "daemon/server/http/door.hpp"
#include "daemon/server/sonars/fleet.hpp"
#include "daemon/server/time/clock.hpp"
#include "daemon/server/view/recording_views.hpp"
#include "daemon/server/view/scene_shapes.hpp"
#include "daemon/server/view/view_connection.hpp"
#include "daemon/server/view/view_doctor.hpp"
#include "daemon/server/view/view_parameters.hpp"

namespace sonar {

/// The parts of the daemon that the feed reads. They must outlive the feed.
struct Viewed {
  asio::io_context& io;
  const Config& config;
  const Clock& clock;
  const World& world;
  const SceneChanges& changes;
  Fleet& fleet;
  Operations& operations;
  Log& log;
};

class ViewFeed final : public ViewerHost {
 public:
  static constexpr std::size_t lines_kept = 100;
  static constexpr double usual_threshold = 0.35;  // default threshold of a cloud, as a fraction of full scale

  explicit ViewFeed(const Viewed& of);
  /// Waits for the picture that is being made.
  ~ViewFeed() override;
  ViewFeed(const ViewFeed&) = delete;
  ViewFeed& operator=(const ViewFeed&) = delete;

  /// Adds a viewer and greets it.
  void add(const std::shared_ptr<ViewConnection>& viewer);
  /// Call it when a browser loads the page. In the demo the first ping is computed while the page starts.
  void expect_viewer();
  bool is_full() const;
  std::vector<ViewerFigures> viewers() const;
  ViewSecrets& secrets() { return secrets_; }
  /// Returns the viewers of recordings.
  RecordingViews& recordings() { return recordings_; }
  const std::filesystem::path& folder_of_recordings() const { return of_.config.recording.folder; }
  const ViewSecrets& secrets() const { return secrets_; }
  void stop();

  const ViewChannel* channel(std::uint32_t id) const override;
  void on_subscribed(Viewer& viewer, std::uint32_t channel) override;
  std::vector<foxglove::Parameter> parameters(const Viewer& viewer, const std::vector<std::string>& names) override;
  std::string set_parameter(Viewer& viewer, const foxglove::Parameter& wanted) override;
  bool steer_playback(Viewer& viewer, const foxglove::PlaybackControl& asked) override;
  void call(Viewer& viewer, const foxglove::ServiceCall& call) override;

 private:
  using Steady = std::chrono::steady_clock;
  using MakePayload = std::function<ViewPayloadPointer(std::uint32_t channel, double threshold)>;
  /// A payload that the thread makes from the newest ping, for all channels that need it. It may be a few pings old.
  struct Slow {
    std::vector<std::uint32_t> channels{};
    std::string threshold = {};  // parameter on which the payload depends; empty = none
    bool under_way = false;
    Steady::time_point begun_at{};
    Time of{Time::min()};                                                   // time of its ping
    std::map<std::pair<std::uint32_t, double>, ViewPayloadPointer> made{};  // key: channel and threshold
  };
  struct SonarView {
    std::string name;
    std::uint32_t image = 0, geometry = 0, ping = 0, figures = 0, truth = 0, cloud = 0;
    std::uint32_t fan = 0, about = 0;  // channels; about: sonar.v1.Picture of the fan
    bool by_lines = false;             // true: the sonar has one beam, and `cloud` gets every ping
    Slow drawn{}, points{};            // fan and about; cloud
    const protocol::Make* make = nullptr;
    std::shared_ptr<const Ping> last = nullptr;
    ViewPayloadPointer picture = nullptr;               // picture of `last`, once it was requested
    wire::Bytes shape = {};                             // geometry of `last`, without the ping number
    std::string volume = {};                            // the settings on which the swath depends
    std::shared_ptr<PicturePainter> painter = nullptr;  // used only by the view thread
    std::unique_ptr<DriverPicture> driver = nullptr;
    DriverPicture::Drawing drawing = nullptr;  // drawing of `last`

    /// Clears all data of earlier pings.
    void forget();
    /// Clears the data if the make has changed, because a reload may change a sonar's profile.
    void be_of(const Device& device);
  };

  void on_ping(const Device& of, const PingQueued& queued);
  std::string set_preview(Viewer& viewer, Device& device, bool on);
  void end_preview(Device& device, const std::string& why);
  bool previews_by_itself(const Device& device);
  void drive_previews();
  void on_preview(const std::string& sonar, const PingOutcome& outcome);
  void make_slowly(SonarView& sonar, Slow SonarView::*which, MakePayload make);
  void begin_slow_ones(SonarView& sonar);
  void offer_line(const SonarView& sonar);
  void on_log(LogLevel level, const std::string& line, const std::vector<LogField>& fields);
  void arm();
  void tick();
  void sync_sonars();
  void offer_status();
  void offer_scene(std::vector<ViewPayload::Piece> pieces);
  std::uint32_t add_channel(const std::string& topic, const std::string& schema, ViewChannel::Kind kind, double most_hz = 0);
  void add_cloud(SonarView& sonar, bool by_lines);
  void remove(const SonarView& sonar);
  void remove_channels(const std::vector<std::uint32_t>& gone);
  SonarView* find(const std::string& name);
  bool wants_truth(const std::string& sonar);
  bool wanted(std::uint32_t channel) const;
  std::weak_ptr<ViewConnection> connection_of(const Viewer& viewer) const;
  void offer(std::uint32_t channel, const ViewPayloadPointer& payload);
  std::string server_info(const Viewer& viewer) const;
  ViewPayloadPointer places() const;
  ViewPayloadPointer status() const;
  ViewPayloadPointer faults() const;
  ParameterSource source() const;
  std::string perform_at_once(const control::Operation& operation, const Viewer& viewer);
  void push_parameters();
  static std::string services_word();
  ViewPayloadPointer current(const Viewer& viewer, std::uint32_t channel);
  void send_time(Viewer& viewer) const;
  /// Offers a payload to one viewer.
  void give(Viewer& viewer, std::uint32_t channel, const ViewPayloadPointer& payload);
  void give(Viewer& viewer, const Slow& slow);
  static double threshold_of(const Viewer& viewer, const Slow& slow) { return viewer.choice(slow.threshold, usual_threshold); }
  // Playback (view_steering.cpp).
  const motion::Playback* playback_of(const std::string& vehicle) const;
  std::string begin_playback(Viewer& viewer, const std::string& vehicle);
  void watch_playback(const Viewer* but = nullptr);
  ViewPayloadPointer in_time_of(const Viewer& viewer, std::uint32_t channel, const ViewPayloadPointer& payload) const;
  /// Sets a parameter of the view. Returns the reason if it was not set, else an empty text; nullopt for a parameter of control.
  std::optional<std::string> set_own(Viewer& viewer, const foxglove::Parameter& wanted);
  void each(auto visit) const {
    for (const auto& weak : connections_)
      if (const auto connection = weak.lock(); connection && !connection->over()) visit(*connection);
  }

  Viewed of_;
  ViewSecrets secrets_;
  RecordingViews recordings_{of_.io, of_.log};
  std::vector<std::weak_ptr<ViewConnection>> connections_;
  std::map<std::uint32_t, ViewChannel> channels_;
  std::uint32_t last_channel_ = 0, tf_ = 0, scene_ = 0, swath_ = 0, log_ = 0, status_ = 0, faults_ = 0, doctor_channel_ = 0;
  std::list<SonarView> sonars_;
  std::map<std::string, PlaybackWatch> watches_;                     // key: vehicle
  std::map<std::string, std::weak_ptr<ViewConnection>> previewers_;  // viewer that requested the preview of each sonar
  std::set<std::string> no_preview_;                                 // sonars whose preview a viewer has switched off
  std::map<std::string, Steady::time_point> preview_failed_at_;      // key: sonar
  SceneShapes shapes_;
  ViewDoctor doctor_{of_.operations, of_.clock};
  std::deque<ViewPayloadPointer> lines_;
  ViewPayloadPointer last_sent_faults_;
  std::vector<foxglove::Parameter> pushed_;
  asio::steady_timer timer_;
  bool armed_ = false, stopping_ = false, changed_ = false;
  Time last_sent_time_{Time::min()};                               // time of the daemon that was last sent to viewers
  Steady::time_point status_at_{}, ping_at_{}, expected_until_{};  // expected_until_: a viewer is expected until then
  std::string session_;
  std::uint64_t sessions_ = 0;
  LogLimiter failures_;
  asio::thread_pool thread_{1};
};

}  // namespace sonar
