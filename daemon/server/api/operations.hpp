// Operations of a running daemon. AppOperations carries them out; the stream server and the HTTP server of control only translate
// requests and answers. Used only in the I/O thread.
#pragma once

#include <functional>
#include <memory>
#include <string>

#include "daemon/emulator/world/world.hpp"
#include "daemon/server/time/clock.hpp"
#include "protocol/control/operations.hpp"

namespace sonar {

namespace v1 {  // from control.pb.h
class DaemonStatus;
class FaultReport;
class Stepped;
}  // namespace v1

struct OperationResult {
  enum class Code { done, refused, failed };  // refused: an invalid request; failed: a valid request that cannot be carried out
  Code code = Code::done;
  std::string text = {};                                // one sentence if the operation was not done
  std::shared_ptr<const v1::DaemonStatus> status = {};  // answer to GetStatus
  std::shared_ptr<const v1::Stepped> stepped = {};      // answer to Step
  std::shared_ptr<const v1::FaultReport> faults = {};   // answer to GetFaults
};

class Operations {
 public:
  using Done = std::function<void(OperationResult)>;
  virtual ~Operations() = default;

  /// Performs an operation. `done` is called once: before this function returns, or later if the operation takes time (scenes),
  /// but never after stop(). A step ends when `has_left` returns true.
  virtual void perform(const control::Operation& operation, const Sender& sender, Done done, HasLeft has_left = {}) = 0;
  /// Returns counters and histograms as Prometheus text, version 0.0.4.
  virtual std::string metrics() const = 0;
  /// Returns a sentence about a problem, or an empty text. /healthz and the watchdog of the service manager use it.
  virtual std::string problem() const = 0;
};

}  // namespace sonar
