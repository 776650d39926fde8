// Events of the daemon, published to clients that subscribe. Used only in the I/O thread.
#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <list>
#include <memory>
#include <string>

#include "protocol/control/operations.hpp"

namespace sonar {

namespace v1 {  // from control.pb.h
class Event;
}  // namespace v1

/// Publishes events to its listeners. A listener must not add or remove listeners while it is called.
class Events {
 public:
  using Listener = std::function<void(const v1::Event&)>;
  using Token = std::shared_ptr<void>;  // the listener is called while its token exists
  [[nodiscard]] Token listen(Listener listener);
  bool has_listeners() const { return !listeners_.empty(); }  // if false, events need not be made

  void publish(const v1::Event& event);
  // These functions make and publish an event if there are listeners.
  void publish_client(const std::string& sonar, const std::string& client, bool connected, const std::string& why);
  void publish_pose(const std::string& vehicle, bool stale, const std::string& text);
  void publish_scene(const std::string& scene, const std::string& text);

 private:
  void remove_expired();

  std::list<std::weak_ptr<Listener>> listeners_;
};

/// The events queued for one subscriber: only the kinds it subscribed to, at most `limit`. Events dropped for a slow subscriber
/// are counted; the count is sent with the next event.
class EventQueue {
 public:
  static constexpr std::size_t limit = 64;

  void subscribe(const control::Subscribe& wanted) { wanted_ = wanted; }
  bool subscribes_any() const { return wanted_.pings || wanted_.clients || wanted_.poses || wanted_.scene || wanted_.faults; }
  /// Queues the event if its kind is subscribed and the queue is not full. Returns true if it was queued.
  bool offer(const v1::Event& event);
  /// Returns the next event, or null.
  std::shared_ptr<v1::Event> next();

 private:
  bool subscribes_to(const v1::Event& event) const;

  control::Subscribe wanted_;
  std::deque<std::shared_ptr<v1::Event>> waiting_;
  std::uint64_t unsent_ = 0;
};

}  // namespace sonar
