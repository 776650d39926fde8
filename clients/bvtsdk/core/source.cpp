#include "clients/bvtsdk/core/source.hpp"

#include "clients/bvtsdk/core/log.hpp"

namespace sonar::bvt {
namespace {

using blueview::Kind;

int kilobytes_of(std::uint64_t bytes) { return static_cast<int>((bytes + 1023) / 1024); }

class LiveSource : public Source {
 public:
  LiveSource(SonarDescription sonar, std::unique_ptr<Link> link) : Source(std::move(sonar)), link_(std::move(link)) {}

  bool is_file() const override { return false; }
  bool connected() const override { return link_->connected(); }
  void close() override { link_->close(); }

  int set(int head, Key key, std::int32_t& value) override { return set_value(head, key, Kind::integer, value); }
  int set(int head, Key key, float& value) override { return set_value(head, key, Kind::number, value); }
  int set(int head, RangeLimits& limits) override {
    Bytes request = address(head, Key::range);
    put(request, static_cast<std::uint8_t>(Kind::number));
    put(request, limits.start_m);
    put(request, limits.stop_m);
    return ask_limits(FrameType::set, request, limits);
  }
  int get(int head, RangeLimits& limits) override { return ask_limits(FrameType::get, address(head, Key::range), limits); }

  int get_ping(int head, int, std::chrono::milliseconds patience, PolarPing& ping, HeadDescription&) override {
    Bytes request, answer;
    put(request, static_cast<std::int32_t>(head));
    put(request, static_cast<std::uint32_t>(patience.count()));
    // The sonar ends its own wait; this longer limit applies only to a sonar that hangs.
    const int code = link_->ask(FrameType::ping, request, answer, patience + std::chrono::seconds(5));
    if (code != success) return code;
    std::string why;
    std::optional<PolarPing> decoded = decode_ping(answer, &why);
    if (!decoded) {
      log(LogLevel::warning, "invalid ping: " + why);
      return bad_ping;
    }
    ping = std::move(*decoded);
    return success;
  }

 private:
  static Bytes address(int head, Key key) {
    Bytes out;
    put(out, static_cast<std::int32_t>(head));
    put(out, static_cast<std::uint16_t>(key));
    return out;
  }

  template <class T>
  int set_value(int head, Key key, Kind kind, T& value) {
    Bytes request = address(head, key), answer;
    put(request, static_cast<std::uint8_t>(kind));
    put(request, value);
    const int code = link_->ask(FrameType::set, request, answer);
    if (code != success) return code;
    Reader reader(answer);
    const bool same_kind = static_cast<Kind>(reader.read<std::uint8_t>()) == kind;
    const T applied = reader.read<T>();
    if (!reader.ok() || !same_kind) return bad_packet_type;
    value = applied;
    return success;
  }

  int ask_limits(FrameType type, const Bytes& request, RangeLimits& limits) {
    Bytes answer;
    const int code = link_->ask(type, request, answer);
    if (code != success) return code;
    Reader reader(answer);
    const bool floats = static_cast<Kind>(reader.read<std::uint8_t>()) == Kind::number;
    const RangeLimits applied{reader.read<float>(), reader.read<float>()};
    if (!reader.ok() || !floats) return bad_packet_type;
    limits = applied;
    return success;
  }

  const std::unique_ptr<Link> link_;
};

void copy_recorded_settings(RecordingReader& reader, int n, HeadDescription& head) {
  const std::optional<SonarDescription> then = decode_description(reader.hello_of_ping(head.id, n));
  if (!then) return;
  for (const HeadDescription& h : then->heads)
    if (h.id == head.id) copy_settings(head, h);
}

class PlayedSource : public Source {
 public:
  PlayedSource(SonarDescription sonar, std::string path, std::unique_ptr<RecordingReader> reader)
      : Source(std::move(sonar)), path_(std::move(path)), reader_(std::move(reader)) {}

  int get_ping(int head, int n, std::chrono::milliseconds, PolarPing& ping, HeadDescription& settings) override {
    const std::lock_guard lock(mutex_);
    int& next = next_[head];
    const int wanted = n < 0 ? next : n;
    std::string why;
    const int code = reader_->read_ping(head, wanted, ping, &why);
    if (!why.empty()) log(LogLevel::warning, path_ + ": " + why);
    if (code != success) return code;
    next = wanted + 1;
    copy_recorded_settings(*reader_, wanted, settings);
    return code;
  }
  int ping_count(int head) const override { return reader_->ping_count(head); }
  int ping_count() const override {
    int sum = 0;
    for (const HeadDescription& h : sonar().heads) sum += reader_->ping_count(h.id);
    return sum;
  }
  int nav_count() const override { return reader_->nav_count(); }
  int kilobytes() const override { return kilobytes_of(reader_->size_bytes()); }

 private:
  std::mutex mutex_;
  const std::string path_;
  const std::unique_ptr<RecordingReader> reader_;
  std::map<int, int> next_;  // number of the next ping of each head
};

class WrittenSource : public Source {
 public:
  WrittenSource(SonarDescription sonar, std::unique_ptr<RecordingWriter> writer)
      : Source(std::move(sonar)), now_(this->sonar()), writer_(std::move(writer)) {}

  int put_ping(int head, const PolarPing& ping, const HeadDescription& settings) override {
    const std::lock_guard lock(mutex_);
    for (HeadDescription& h : now_.heads)
      if (h.id == head) copy_settings(h, settings);
    return writer_->put_ping(head, ping, encode_description(now_));
  }
  int put_event(const EventMark& mark) override {
    const std::lock_guard lock(mutex_);
    return writer_->put_event(mark);
  }
  int ping_count(int head) const override {
    const std::lock_guard lock(mutex_);
    return writer_->ping_count(head);
  }
  int ping_count() const override { return count(FrameType::ping_data); }
  int nav_count() const override { return count(FrameType::nav_data); }
  int kilobytes() const override {
    const std::lock_guard lock(mutex_);
    return kilobytes_of(writer_->size_bytes());
  }
  void close() override {
    const std::lock_guard lock(mutex_);
    writer_->close();
  }

 private:
  int count(FrameType type) const {
    const std::lock_guard lock(mutex_);
    return writer_->count(type);
  }
  mutable std::mutex mutex_;
  SonarDescription now_;  // with the settings of the last ping
  const std::unique_ptr<RecordingWriter> writer_;
};

}  // namespace

Code open_live(const std::string& endpoint, int abi, std::shared_ptr<Source>& source) {
  std::unique_ptr<Link> link;
  SonarDescription sonar;
  const Code code = Link::open(endpoint, abi, link, sonar);
  if (code == success) source = std::make_shared<LiveSource>(std::move(sonar), std::move(link));
  return code;
}

Code open_recording(const std::string& path, std::shared_ptr<Source>& source) {
  auto reader = std::make_unique<RecordingReader>();
  std::string why;
  const Code code = reader->open(path, &why);
  if (code != success) {
    log(LogLevel::warning, why);
    return code;
  }
  std::optional<SonarDescription> sonar = decode_description(reader->hello());
  if (!sonar) {
    log(LogLevel::warning, path + " does not name its sonar; its header is damaged");
    return file_header_bad;
  }
  for (HeadDescription& head : sonar->heads) copy_recorded_settings(*reader, 0, head);
  source = std::make_shared<PlayedSource>(std::move(*sonar), path, std::move(reader));
  return success;
}

Code create_recording(const std::string& path, const SonarDescription& sonar, std::shared_ptr<Source>& source) {
  auto writer = std::make_unique<RecordingWriter>();
  const Code code = writer->create(path, encode_description(sonar));
  if (code == success)
    source = std::make_shared<WrittenSource>(sonar, std::move(writer));
  else
    log(LogLevel::warning, path + " cannot be created; check that its folder exists, is writable and has space");
  return code;
}

}  // namespace sonar::bvt
