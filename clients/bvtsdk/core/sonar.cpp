#include "clients/bvtsdk/core/sonar.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "clients/bvtsdk/core/log.hpp"

namespace sonar::bvt {
namespace {

constexpr std::uint32_t index_bits = 20, most_indices = (1u << index_bits) - 1, generations = 1u << 11;
constexpr std::size_t rest = 1024;  // number of freed indices that wait before one is reused

std::uintptr_t number_of(const void* handle) {
  std::uintptr_t number;
  std::memcpy(&number, &handle, sizeof number);
  return number;
}

void* handle_of(std::uintptr_t number) {
  void* handle;
  std::memcpy(&handle, &number, sizeof handle);
  return handle;
}

}  // namespace

// A handle is generation << 20 | (index + 1): never null, since the generation starts at 1.
void* Handles::add(std::shared_ptr<Object> object) {
  const std::lock_guard lock(mutex_);
  std::uint32_t index;
  const bool full = slots_.size() >= most_indices;
  if (free_.size() > (full ? 0 : rest)) {
    index = free_.front();
    free_.pop_front();
  } else if (!full) {
    index = static_cast<std::uint32_t>(slots_.size());
    slots_.emplace_back();
  } else {
    return nullptr;
  }
  slots_[index].object = std::move(object);
  ++live_;
  return handle_of(static_cast<std::uintptr_t>(slots_[index].generation) << index_bits | (index + 1));
}

Handles::Slot* Handles::slot_of(const void* handle) {
  const std::uintptr_t number = number_of(handle), index = number & most_indices;
  if (index == 0 || index > slots_.size()) return nullptr;
  Slot& p = slots_[index - 1];
  return p.object && p.generation == number >> index_bits ? &p : nullptr;
}

std::shared_ptr<Object> Handles::find_any(const void* handle) {
  const std::lock_guard lock(mutex_);
  const Slot* p = slot_of(handle);
  return p ? p->object : nullptr;
}

std::shared_ptr<Object> Handles::remove_any(const void* handle) {
  const std::lock_guard lock(mutex_);
  Slot* p = slot_of(handle);
  if (!p) return nullptr;
  std::shared_ptr<Object> object = std::move(p->object);
  p->object.reset();
  p->generation = p->generation + 1 == generations ? 1 : p->generation + 1;
  free_.push_back(static_cast<std::uint32_t>(p - slots_.data()));
  --live_;
  return object;
}

std::size_t Handles::live() {
  const std::lock_guard lock(mutex_);
  return live_;
}

Handles& handles() {
  static Handles& table = *new Handles;
  return table;
}

namespace {

using std::chrono::milliseconds;

// Limit for the answer to a ping request, in addition to twice the two-way travel time of sound and twice the ping interval.
constexpr milliseconds ping_patience{20000};
constexpr std::size_t longest_mark_key = 80, longest_mark_text = 512;

double seconds_since_1970() { return std::chrono::duration<double>(std::chrono::system_clock::now().time_since_epoch()).count(); }

}  // namespace

Head::Head(std::shared_ptr<Source> source, const HeadDescription& description) : now(description), source_(std::move(source)) {
  if (now.name.empty()) now.name = "Head";
}

int Head::set_range(float start_m, float stop_m) {
  if (!std::isfinite(start_m) || !std::isfinite(stop_m)) return bad_parameter;
  RangeLimits limits{start_m, stop_m};
  const int code = source_->set(now.id, limits);
  if (code != success) return code;
  now.start_m = limits.start_m;
  now.stop_m = limits.stop_m;
  return success;
}

int Head::set_start(float start_m) {
  const int code = set(Key::start_range, start_m, now.start_m);
  RangeLimits limits{now.start_m, now.stop_m};
  if (code == success && source_->get(now.id, limits) == success)
    now.stop_m = limits.stop_m;  // the sonar may have changed the end, too
  return code;
}

int Head::set_stop(float stop_m) {
  const int code = set(Key::stop_range, stop_m, now.stop_m);
  RangeLimits limits{now.start_m, now.stop_m};
  if (code == success && source_->get(now.id, limits) == success) now.start_m = limits.start_m;
  return code;
}

int Head::set(Key key, int value, std::int32_t& kept) {
  std::int32_t applied = value;
  const int code = source_->set(now.id, key, applied);
  if (code == success) kept = applied;
  return code;
}

int Head::set(Key key, float value, float& kept) {
  if (!std::isfinite(value)) return bad_parameter;
  float applied = value;
  const int code = source_->set(now.id, key, applied);
  if (code == success) kept = applied;
  return code;
}

int Head::get_ping(int n, std::shared_ptr<PingObject>& ping) {
  const double travel_s = std::isfinite(now.stop_m) ? 2 * static_cast<double>(now.stop_m) / std::max(now.sound_speed_mps, 1) : 0;
  const milliseconds patience = ping_patience + 2 * milliseconds(std::clamp(ping_interval_ms, 0, 600000)) +
                                milliseconds(static_cast<int>(2000 * std::clamp(travel_s, 0.0, 600.0)));
  auto fresh = std::make_shared<PingObject>();
  fresh->settings = now;
  const int code = source_->get_ping(now.id, n, patience, fresh->polar, fresh->settings);
  if (code != success) return code;
  copy_settings(now, fresh->settings);
  fresh->imaging = imaging;
  fresh->imager = imager_;
  ping = std::move(fresh);
  return success;
}

int Sonar::open(const std::string& type, const std::string& parameter, int abi) {
  if (type == "NET") reset();
  std::shared_ptr<Source> source;
  int code = bad_parameter;
  if (type == "NET")
    code = open_live(parameter, abi, source);
  else if (type == "FILE")
    code = open_recording(parameter, source);
  else
    log(LogLevel::warning, "cannot open type \"" + type + "\": pass NET and an address, or FILE and a path");
  if (code != success) return code;
  reset();
  use(std::move(source));
  return success;
}

int Sonar::create_file(const std::string& path, const SonarDescription& of) {
  reset();
  std::shared_ptr<Source> source;
  const int code = create_recording(path, of, source);
  if (code == success) use(std::move(source));
  return code;
}

void Sonar::use(std::shared_ptr<Source> source) {
  source_ = std::move(source);
  for (const HeadDescription& h : source_->sonar().heads) heads_.push_back(std::make_shared<Head>(source_, h));
}

void Sonar::reset() {
  for (const std::shared_ptr<Head>& h : heads_)
    if (h->borrowed) handles().remove<Head>(h->borrowed);
  heads_.clear();
  if (source_) source_->close();
  source_.reset();
}

int Sonar::head(int number, std::shared_ptr<Head>& head) const {
  if (!source_) return net_not_connected;
  const HeadDescription* meant = source_->sonar().head(number);
  if (!meant) return no_head;
  for (const std::shared_ptr<Head>& h : heads_)
    if (h->now.id == meant->id) head = h;
  return success;
}

SonarDescription Sonar::description() const {
  SonarDescription out = source_->sonar();
  for (std::size_t i = 0; i < out.heads.size(); ++i) {  // heads_ are in the same order
    const std::lock_guard lock(heads_[i]->mutex);
    copy_settings(out.heads[i], heads_[i]->now);
  }
  return out;
}

int Sonar::put_event(const std::string& key, const std::string& text) {
  if (key.size() > longest_mark_key || text.size() > longest_mark_text) return bad_parameter;
  return source_ ? source_->put_event({seconds_since_1970(), key, text}) : read_only_file;
}

int Sonar::set_local_clock(int on) {
  std::int32_t applied = on != 0;
  const int code = source_ && !heads_.empty() ? source_->set(heads_.front()->now.id, Key::local_clock, applied) : success;
  if (code == success) local_clock_ = applied;
  return code;
}

}  // namespace sonar::bvt
