// Recordings on the page. A viewer requests a recording with ?recording=NAME and gets its pictures; each viewer has its own time
// line. One thread reads files and draws pictures for all such viewers, in short slices, so that neither drivers nor other
// viewers wait. The functions are called on the I/O thread. ViewFeed or `sonard replay` owns the object.
#pragma once

#include <memory>
#include <vector>

#include "daemon/server/view/played_recording.hpp"
#include "daemon/server/view/view_connection.hpp"

namespace sonar {

class RecordingViews {
 public:
  RecordingViews(asio::io_context& io, Log& log);
  /// Stops the present slice, and waits for its end.
  ~RecordingViews();
  RecordingViews(const RecordingViews&) = delete;
  RecordingViews& operator=(const RecordingViews&) = delete;

  std::shared_ptr<HttpTakeover> open(ConnectionServices& services, HttpConnection& from, const HttpRequest& request,
                                     ViewWelcome welcome, const PlayedRecording& wanted);
  /// Returns the present number of viewers of recordings.
  int count() const;

 private:
  class Seen;
  struct Viewing {
    std::weak_ptr<ViewConnection> connection;
    ViewerLeft left;
  };

  asio::io_context& io_;
  Log& log_;
  std::vector<Viewing> viewings_;
  asio::thread_pool thread_{1};
};

}  // namespace sonar
