#include "daemon/server/api/events.hpp"

#include <utility>

#include "protocol/control/answers.hpp"

namespace sonar {

/// A listener is removed when its token is destroyed.
Events::Token Events::listen(Listener listener) {
  remove_expired();
  auto kept = std::make_shared<Listener>(std::move(listener));
  listeners_.push_back(kept);
  return kept;
}

void Events::remove_expired() {
  listeners_.remove_if([](const std::weak_ptr<Listener>& l) { return l.expired(); });
}

void Events::publish(const v1::Event& event) {
  remove_expired();
  for (const std::weak_ptr<Listener>& l : listeners_)
    // lock() is empty if an earlier listener has just ended this one.
    if (const auto listener = l.lock()) (*listener)(event);
}

void Events::publish_client(const std::string& sonar, const std::string& client, bool connected, const std::string& why) {
  if (!has_listeners()) return;
  v1::Event event;
  event.mutable_client()->set_sonar(sonar);
  event.mutable_client()->set_client(client);
  event.mutable_client()->set_connected(connected);
  event.mutable_client()->set_why(why);
  publish(event);
}

void Events::publish_pose(const std::string& vehicle, bool stale, const std::string& text) {
  if (!has_listeners()) return;
  v1::Event event;
  event.mutable_pose()->set_vehicle(vehicle);
  event.mutable_pose()->set_stale(stale);
  event.mutable_pose()->set_text(text);
  publish(event);
}

void Events::publish_scene(const std::string& scene, const std::string& text) {
  if (!has_listeners()) return;
  v1::Event event;
  event.mutable_scene()->set_scene(scene);
  event.mutable_scene()->set_text(text);
  publish(event);
}

/// The next queued event states the number of dropped events.
bool EventQueue::offer(const v1::Event& event) {
  if (!subscribes_to(event)) return false;
  if (waiting_.size() == limit) {
    ++unsent_;
    return false;
  }
  waiting_.push_back(std::make_shared<v1::Event>(event));
  waiting_.back()->set_unsent(std::exchange(unsent_, 0));
  return true;
}

std::shared_ptr<v1::Event> EventQueue::next() {
  if (waiting_.empty()) return nullptr;
  auto event = std::move(waiting_.front());
  waiting_.pop_front();
  return event;
}

bool EventQueue::subscribes_to(const v1::Event& event) const {
  switch (event.what_case()) {
    case v1::Event::kPing:
      return wanted_.pings;
    case v1::Event::kClient:
      return wanted_.clients;
    case v1::Event::kPose:
      return wanted_.poses;
    case v1::Event::kScene:
      return wanted_.scene;
    case v1::Event::kFault:
      return wanted_.faults;
    case v1::Event::WHAT_NOT_SET:
      break;
  }
  return false;
}

}  // namespace sonar
