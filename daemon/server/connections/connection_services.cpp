#include "daemon/server/connections/connection_services.hpp"

namespace sonar {

WorkRate::Steady::duration ConnectionServices::pause_after(const Sender& of, std::size_t amount) {
  constexpr std::chrono::milliseconds worth_a_word{200};
  const auto pause = work.pause_after(of.source, amount, limits.input_bytes_per_s, WorkRate::Steady::now());
  if (pause > worth_a_word)
    log_limited(
        log, notices, LogLevel::info,
        server + " clients of an address are delayed: they cause more work than limits.input_bytes_per_s (docs/control.md)",
        {{"from", of.source}});
  return pause;
}

void log_refusal(ConnectionServices& services, const std::string& why, const std::string& from) {
  log_limited(services.log, services.refusals, LogLevel::warning, services.server + " refused: " + why, {{"from", from}});
}

void log_fault(ConnectionServices& services, const std::string& fault, const std::string& at) {
  log_fault(services.log, services.faults, fault, {"at", at});
}

asio::awaitable<bool> write_whole(ConnectionServices& services, tcp::socket& socket, Deadline& stall, const Sender& to,
                                  asio::const_buffer bytes) {
  while (bytes.size() > 0) {
    error_code ec;
    stall.within(services.limits.stall);
    bytes += co_await socket.async_write_some(asio::buffer(bytes), into(ec));
    if (stall.passed()) log_refusal(services, "client does not read", to.id);
    if (ec || !socket.is_open()) co_return false;
  }
  stall.none();
  co_return true;
}

}  // namespace sonar
