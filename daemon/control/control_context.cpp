#include "daemon/control/control_context.hpp"

namespace sonar {

void say_refused(ControlContext& context, const std::string& why, const std::string& from) {
  std::uint64_t unsaid = 0;
  if (context.refusals.allows(LogLimiter::Clock::now(), unsaid))
    context.log.warning("control refused: " + why, {{"from", from}, {"unsaid", unsaid}});
}

void say_fault(ControlContext& context, const std::exception_ptr& fault, const std::string& at) {
  std::uint64_t unsaid = 0;
  if (context.faults.allows(LogLimiter::Clock::now(), unsaid))
    context.log.error("internal fault: " + text_of(fault) + " (please report it)", {{"at", at}, {"unsaid", unsaid}});
}

}  // namespace sonar
