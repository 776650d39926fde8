// What a running daemon can be asked, for the servers of the control protocol: the App carries it out, the stream server and the
// HTTP server only translate. I/O thread only.
#pragma once

#include <functional>
#include <list>
#include <memory>
#include <string>
#include <utility>
#include <variant>

#include "daemon/emulator/world/world.hpp"
#include "protocol/control/operations.hpp"

namespace sonar {

struct OperationResult {
  enum class Code { done, refused, failed };  // refused: the request is wrong; failed: right, but it could not be done
  Code code = Code::done;
  std::string text;  // one sentence when it was not done
  std::variant<std::monostate, control::DaemonStatus, control::Stepped> body;
};

class Operations {
 public:
  using Done = std::function<void(OperationResult)>;
  virtual ~Operations() = default;

  /// `done` is called once: before this returns, or later when the operation takes time (scenes); never after stop().
  virtual void perform(const control::Operation& operation, const Sender& sender, Done done) = 0;
  /// Counters and histograms as Prometheus text, version 0.0.4.
  virtual std::string metrics() const = 0;
  /// Empty when all is well, else one sentence: /healthz and the service manager's watchdog ask.
  virtual std::string problem() const = 0;
};

/// Publishes what happens to its listeners. A listener must not add or remove listeners while it is called.
class Events {
 public:
  using Listener = std::function<void(const control::Event&)>;
  using Token = std::shared_ptr<void>;  // the listener is called as long as its token lives
  [[nodiscard]] Token listen(Listener listener) {
    remove_expired();
    auto kept = std::make_shared<Listener>(std::move(listener));
    listeners_.push_back(kept);
    return kept;
  }
  bool has_listeners() const { return !listeners_.empty(); }  // else no event needs to be made
  void publish(const control::Event& event) {
    remove_expired();
    for (const std::weak_ptr<Listener>& l : listeners_)
      if (const auto listener = l.lock()) (*listener)(event);
  }

 private:
  void remove_expired() {
    listeners_.remove_if([](const std::weak_ptr<Listener>& l) { return l.expired(); });
  }

  std::list<std::weak_ptr<Listener>> listeners_;
};

}  // namespace sonar
