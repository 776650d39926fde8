// Recordings on the page. A viewer requests one by ?recording=NAME and gets its pictures, with a time line for this viewer. One
// thread for all such viewers reads files and draws pictures in short slices, so that neither drivers nor other viewers wait. I/O
// thread only. ViewFeed and `sonard replay` own it.
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "daemon/server/view/view_connection.hpp"

namespace sonar {

/// The recording that is played.
struct PlayedRecording {
  std::filesystem::path file;
  std::string sonar = {};  // one of several in it, as --sonar of `sonard replay`
  double rate_hz = 10;     // rate of files that store no times
};

class RecordingViews {
 public:
  RecordingViews(asio::io_context& io, Log& log);
  /// Waits for the present slice.
  ~RecordingViews();
  RecordingViews(const RecordingViews&) = delete;
  RecordingViews& operator=(const RecordingViews&) = delete;

  std::shared_ptr<HttpTakeover> open(ConnectionServices& services, HttpConnection& from, const HttpRequest& request,
                                     ViewWelcome welcome, const PlayedRecording& wanted);
  /// The present number of viewers of recordings.
  int count() const;

 private:
  class Seen;

  asio::io_context& io_;
  Log& log_;
  std::vector<std::weak_ptr<ViewConnection>> connections_;
  asio::thread_pool thread_{1};
};

}  // namespace sonar
