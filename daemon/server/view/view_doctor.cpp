#include "daemon/server/view/view_doctor.hpp"

#include <fstream>
#include <string>

#include "protocol/control/answers.hpp"
#include "protocol/foxglove/foxglove_messages.hpp"

namespace sonar {
namespace {

constexpr double longest_gap_s = 10;  // longest time between two compared statuses; without viewers no status is read
constexpr auto failures_counted_for = std::chrono::seconds(8);
constexpr std::size_t most_bytes = 256 << 10;  // limit for a table of the kernel, which takes a millisecond to read

/// Returns the beginning of a file, up to most_bytes; empty if the file cannot be read.
std::string content_of(const char* file) {
  std::string text(most_bytes, '\0');
  std::ifstream in(file);
  in.read(text.data(), static_cast<std::streamsize>(text.size()));
  text.resize(static_cast<std::size_t>(in.gcount()));
  return text;
}

}  // namespace

ViewPayloadPointer ViewDoctor::newest() {
  if (newest_ == nullptr || Steady::now() - looked_at_ >= period) look();
  return newest_;
}

ViewPayloadPointer ViewDoctor::news() {
  if (newest() == sent_) return nullptr;
  return sent_ = newest_;
}

void ViewDoctor::look() {
  looked_at_ = Steady::now();
  std::shared_ptr<const v1::DaemonStatus> now;
  operations_.perform(control::GetStatus{}, {"live view", "live view"},
                      [&now](const OperationResult& result) { now = result.status; });
  if (now == nullptr) return;
  const auto before = std::exchange(last_, now);
  const bool compares = before != nullptr && now->uptime_s() - before->uptime_s() < longest_gap_s;
  newest_ =
      view_payload(clock_.now(), foxglove::findings(doctor::judge(*now, compares ? before.get() : nullptr, look_elsewhere())));
}

doctor::Elsewhere ViewDoctor::look_elsewhere() {
  if (!doctor::looks_elsewhere(*last_)) {
    failed_.clear();
    return {};
  }
  failed_.emplace_back(looked_at_, doctor::failed_attempts(content_of("/proc/net/snmp")));
  while (looked_at_ - failed_.front().first > failures_counted_for) failed_.pop_front();
  return {doctor::parse_proc_net(content_of("/proc/net/tcp") + content_of("/proc/net/tcp6")),
          failed_.back().second - failed_.front().second};
}

}  // namespace sonar
