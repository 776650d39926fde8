#include "tests/daemon/server/loopback.hpp"
#include "protocol/control/answers.hpp"

#include <arpa/inet.h>
#include <fcntl.h>
#include <linux/filter.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <filesystem>
#include <fstream>

namespace sonar::testing_daemon {
namespace {

sockaddr_in endpoint(const std::string& address, std::uint16_t port) {
  sockaddr_in a{};
  a.sin_family = AF_INET;
  a.sin_port = htons(port);
  inet_pton(AF_INET, address.c_str(), &a.sin_addr);
  return a;
}
const sockaddr* plain(const sockaddr_in& a) { return static_cast<const sockaddr*>(static_cast<const void*>(&a)); }

}  // namespace

std::shared_ptr<const Mesh> small_mesh() {
  auto mesh = std::make_shared<Mesh>();
  mesh->vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  mesh->triangles = {{0, 1, 2}, {0, 1, 3}};
  mesh->material = {0, 0};
  return mesh;
}

std::shared_ptr<Scene> small_scene(bool moving_object) {
  auto scene = std::make_shared<Scene>();
  scene->name = "test";
  scene->materials = {Material{.name = "mud"}, Material{.name = "steel"}};
  scene->objects = {Object{.name = "floor", .mesh = small_mesh(), .in_world = {{0, 0, -10}, {}}},
                    Object{.name = "box", .mesh = small_mesh(), .in_world = {{3, 0, -3}, {}}}};
  if (moving_object) {
    scene->body_names = {"crate"};
    scene->bodies_in_world = {Pose{{5, 0, -3}, {}}};
    scene->objects.push_back(Object{.name = "crate", .mesh = small_mesh(), .in_world = {{5, 0, -3}, {}}, .body = 0});
  }
  return scene;
}

std::string yaml_of(const DaemonSetup& s) {
  const std::string poses =
      s.more.find("poses:") == std::string::npos ? "poses: {protobuf: '" + s.address + ":0', json: '" + s.address + ":0'}\n" : "";
  const std::string control = s.more.find("control:") == std::string::npos ? "control: {stream: off, http: off}\n" : "";
  const std::string status =
      s.sonar_lines.find("status_to") == std::string::npos ? "    status_to: ['" + s.address + ":9']\n" : "";
  return std::string(
             "world: {scene: scene.yaml}\n"
             "vehicles:\n  - {name: rov, initial_pose: {frame: ENU_FLU, xyz_m: [0, 0, -3]}}\n") +
         s.vehicle_lines + "sonars:\n  - name: front\n    profile: " + s.profile + "\n    bind_ip: " + s.address + "\n" + status +
         s.sonar_lines + poses + control + s.more;
}

std::string own_path(const std::string& name) {
  static std::atomic<unsigned> count{0};
  return ::testing::TempDir() + "/" + name + "-" + std::to_string(getpid()) + "-" + std::to_string(++count);
}

std::uint8_t FakeEngine::sample(std::uint32_t ping, std::size_t row, std::size_t beam) {
  return static_cast<std::uint8_t>((ping * 31 + row * 7 + beam) % 255);
}

/// Copies row by row from one endless row, because single samples take long without optimisation.
std::vector<std::byte> FakeEngine::samples(std::uint32_t ping, std::size_t rows, std::size_t beams, std::size_t sample_bytes) {
  constexpr std::size_t period = 255;
  std::vector<std::byte> long_row((period + beams) * sample_bytes);
  for (std::size_t b = 0; b < period + beams; ++b) long_row[b * sample_bytes] = static_cast<std::byte>(sample(0, 0, b));
  std::vector<std::byte> all(rows * beams * sample_bytes);
  for (std::size_t r = 0; r < rows; ++r)
    std::copy_n(long_row.begin() + static_cast<std::ptrdiff_t>(sample(ping, r, 0) * sample_bytes), beams * sample_bytes,
                all.begin() + static_cast<std::ptrdiff_t>(r * beams * sample_bytes));
  return all;
}

std::vector<Ping> FakeEngine::run(std::span<const PingRequest> requests) {
  std::vector<Ping> pings;
  for (const PingRequest& request : requests) {
    {
      std::lock_guard lock(record_->mutex);
      record_->requests.push_back(request);
      record_->scenes.push_back(scene_);
    }
    if (takes_.count() > 0) std::this_thread::sleep_for(takes_);
    const auto number = static_cast<std::uint32_t>(request.number);
    if (before_) before_(number);
    Ping ping;
    ping.request = request;
    const auto rows = static_cast<std::size_t>(request.settings.range_bin_count);
    const auto beams = static_cast<std::size_t>(request.settings.beam_count);
    const double edge = 0.5 * static_cast<double>(ping.mode().horizontal_aperture_rad);
    for (std::size_t b = 0; b < beams; ++b)
      ping.beam_azimuth_rad.push_back(
          static_cast<float>(edge - 2 * edge * static_cast<double>(b) / static_cast<double>(beams - 1)));
    ping.samples = samples(number, rows, beams, static_cast<std::size_t>(request.settings.format.bits / 8));
    if (request.settings.format.row_gains) ping.row_gain.assign(rows, 1);
    pings.push_back(std::move(ping));
  }
  return pings;
}

void PingGate::allow(int pings) {
  std::lock_guard lock(mutex_);
  allowed_ += pings;
  changed_.notify_all();
}

void PingGate::open() {
  std::lock_guard lock(mutex_);
  open_ = true;
  changed_.notify_all();
}

void PingGate::pass() {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [this] { return open_ || allowed_ > 0; });
  if (!open_) --allowed_;
}

Daemon::Daemon(DaemonSetup setup) : address_(setup.address), gate_(setup.gate) {
  const std::string directory = ::testing::TempDir();
  std::ofstream(directory + "/scene.yaml") << "name: test\n";
  config_path_ = own_path("config.yaml");
  if (setup.config_file) write_config(yaml_of(setup));
  auto config = setup.config_file ? load_config(config_path_) : parse_config(yaml_of(setup), "test.yaml", directory);
  if (!config) throw std::runtime_error(config.error().text);
  if (setup.edit_config) setup.edit_config(*config);
  LogOptions log;
  log.sink = [this](LogLevel, const std::string& line) {
    std::lock_guard lock(log_mutex_);
    log_text_ += line + "\n";
  };
  log_ = std::make_unique<Log>(log);
  if (gate_)
    setup.engine_before = [gate = gate_, before = setup.engine_before](std::uint32_t ping) {
      gate->pass();
      if (before) before(ping);
    };
  const auto make_engine = [record = record_, takes = setup.engine_takes, before = setup.engine_before,
                            before_engine = setup.before_engine,
                            first = true](ScenePointer scene) mutable -> std::unique_ptr<PingEngine> {
    if (!std::exchange(first, false) && before_engine) before_engine(*scene);
    return std::make_unique<FakeEngine>(record, takes, before, std::move(scene));
  };
  const ScenePointer scene = setup.scene ? setup.scene : small_scene(setup.moving_object);
  if (!setup.options.load_scene) setup.options.load_scene = [scene](const SceneFile&) -> Result<ScenePointer> { return scene; };
  if (setup.config_file) setup.options.read_config = [file = config_path_] { return load_config(file); };
  app_ = std::make_unique<App>(*std::move(config), scene, make_engine, setup.options, *log_);
  if (const auto opened = app_->open(); !opened) throw std::runtime_error(opened.error().text);
  thread_ = std::thread([this] { code_ = app_->run(); });
}

Daemon::~Daemon() {
  stop();
  std::filesystem::remove(config_path_);
}

int Daemon::stop() {
  if (gate_) gate_->open();
  app_->request_stop();
  return wait();
}

int Daemon::wait() {
  if (thread_.joinable()) thread_.join();
  return code_.value_or(-1);
}

void Daemon::write_config(const std::string& yaml) const { std::ofstream(config_path_) << yaml; }

std::vector<ScenePointer> Daemon::scenes() {
  std::lock_guard lock(record_->mutex);
  return record_->scenes;
}

void Daemon::on_io_thread(const std::function<void()>& work) {
  std::promise<void> done;
  app_->post([&] {
    work();
    done.set_value();
  });
  done.get_future().wait();
}

std::future<OperationResult> Daemon::ask_later(const control::Operation& operation) {
  auto answer = std::make_shared<std::promise<OperationResult>>();
  auto future = answer->get_future();
  app_->post([this, operation, answer] {
    app_->operations().perform(operation, {"control test", "control"},
                               [answer](OperationResult result) { answer->set_value(std::move(result)); });
  });
  return future;
}

v1::DaemonStatus Daemon::status() { return *ask(control::GetStatus{}).status; }

OperationResult Daemon::ask(const control::Operation& operation) {
  auto answer = ask_later(operation);
  if (answer.wait_for(patience) == std::future_status::ready) return answer.get();
  ADD_FAILURE() << "no answer";
  return {OperationResult::Code::failed, "no answer", {}};
}

std::string Daemon::log_text() {
  std::lock_guard lock(log_mutex_);
  return log_text_;
}

Client::Client(const std::string& address, std::uint16_t port, int receive_buffer) {
  fd_ = socket(AF_INET, SOCK_STREAM, 0);
  if (receive_buffer > 0) setsockopt(fd_, SOL_SOCKET, SO_RCVBUF, &receive_buffer, sizeof receive_buffer);
  const sockaddr_in to = endpoint(address, port);
  if (connect(fd_, plain(to), sizeof to) != 0) ADD_FAILURE() << "cannot connect to " << address << ":" << port;
}
Client::~Client() { close(); }

void Client::close() {
  if (fd_ >= 0) ::close(fd_);
  fd_ = -1;
}
void Client::reset() {
  const linger now{1, 0};
  setsockopt(fd_, SOL_SOCKET, SO_LINGER, &now, sizeof now);
  close();
}

void Client::finish_sending() { shutdown(fd_, SHUT_WR); }

void Client::die() {
  sock_filter drop_all{BPF_RET | BPF_K, 0, 0, 0};
  const sock_fprog filter{1, &drop_all};
  if (setsockopt(fd_, SOL_SOCKET, SO_ATTACH_FILTER, &filter, sizeof filter) != 0) ADD_FAILURE() << "no socket filters here";
}

void Client::send(const std::vector<std::byte>& bytes) {
  std::size_t done = 0;
  while (done < bytes.size()) {
    const auto n = ::send(fd_, bytes.data() + done, bytes.size() - done, MSG_NOSIGNAL);
    if (n <= 0) return;
    done += static_cast<std::size_t>(n);
  }
}
void Client::send(const std::string& text) { send(bytes_of(text)); }

bool Client::read_some(milliseconds timeout, std::vector<std::byte>* raw) {
  pollfd p{fd_, POLLIN, 0};
  if (ended || fd_ < 0 || poll(&p, 1, static_cast<int>(timeout.count())) <= 0) return false;
  std::vector<std::byte> buffer(1 << 18);
  const auto n = recv(fd_, buffer.data(), buffer.size(), 0);
  if (n <= 0) {
    ended = true;
    was_reset = n < 0;
    return false;
  }
  buffer.resize(static_cast<std::size_t>(n));
  bytes_read += buffer.size();
  if (digest) digest->add(buffer);
  if (raw != nullptr)
    raw->insert(raw->end(), buffer.begin(), buffer.end());
  else
    decoder.append(buffer);
  return true;
}

std::optional<oculus::Received> Client::next(milliseconds timeout) {
  const auto deadline = Steady::now() + timeout;
  while (true) {
    if (auto message = decoder.next()) return message;
    const auto left = std::chrono::duration_cast<milliseconds>(deadline - Steady::now());
    if (left.count() <= 0 || !read_some(left)) return std::nullopt;
  }
}

std::optional<oculus::DecodedPing> Client::next_ping(milliseconds timeout) {
  const auto deadline = Steady::now() + timeout;
  while (true) {
    const auto left = std::chrono::duration_cast<milliseconds>(deadline - Steady::now());
    auto message = next(std::max(left, milliseconds(0)));
    if (!message) return std::nullopt;
    if (auto* ping = std::get_if<oculus::DecodedPing>(&*message)) return std::move(*ping);
  }
}

bool Client::read_to_end(milliseconds timeout) {
  const auto deadline = Steady::now() + timeout;
  std::vector<std::byte> raw;
  while (!ended && Steady::now() < deadline) read_some(milliseconds(100), &raw);
  decoder.append(raw);
  while (decoder.next()) continue;
  return ended && !was_reset;
}

std::vector<std::byte> Client::read_raw(std::size_t at_least, milliseconds timeout) {
  std::vector<std::byte> raw;
  const auto deadline = Steady::now() + timeout;
  while (raw.size() < at_least && Steady::now() < deadline)
    if (!read_some(milliseconds(100), &raw) && ended) break;
  return raw;
}

oculus::FireRequest fire_at(oculus::PingRate rate, double range_m) {
  oculus::FireRequest f;
  f.settings.mode = 2;
  f.settings.ping_rate = rate;
  f.settings.flags = oculus::flag::range_in_metres | oculus::flag::simple_result;
  f.settings.range = range_m;
  f.settings.gain_percent = 50;
  return f;
}

void send_udp(const std::string& address, std::uint16_t port, const std::vector<std::byte>& bytes) {
  const int fd = socket(AF_INET, SOCK_DGRAM, 0);
  const sockaddr_in to = endpoint(address, port);
  sendto(fd, bytes.data(), bytes.size(), 0, plain(to), sizeof to);
  ::close(fd);
}

std::vector<std::byte> bytes_of(const std::string& text) {
  const auto view = std::as_bytes(std::span(text.data(), text.size()));
  return {view.begin(), view.end()};
}

}  // namespace sonar::testing_daemon
