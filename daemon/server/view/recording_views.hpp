// Recordings on the page: a viewer that asks for one gets a socket of its own (?recording=NAME), with the recording's pictures
// and a time line of its own. Files are read and pictures drawn in short slices on one thread for all such viewers, so that
// neither drivers nor other viewers wait. I/O thread only. Owned by ViewFeed and by `sonard replay`.
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "daemon/server/view/view_connection.hpp"

namespace sonar {

/// The one that is played.
struct PlayedRecording {
  std::filesystem::path file;
  std::string sonar = {};  // one of several in it, as --sonar of `sonard replay`
  double rate_hz = 10;     // rate of files that store no times
};

class RecordingViews {
 public:
  RecordingViews(asio::io_context& io, Log& log);
  /// Waits for the slice under way.
  ~RecordingViews();
  RecordingViews(const RecordingViews&) = delete;
  RecordingViews& operator=(const RecordingViews&) = delete;

  std::shared_ptr<HttpTakeover> open(ConnectionServices& services, HttpConnection& from, const HttpRequest& request,
                                     ViewWelcome welcome, const PlayedRecording& wanted);
  /// Viewers of recordings, now.
  int count() const;

 private:
  class Seen;

  asio::io_context& io_;
  Log& log_;
  std::vector<std::weak_ptr<ViewConnection>> connections_;
  asio::thread_pool thread_{1};
};

}  // namespace sonar
