// Carries out the requests of the control protocol (operations.hpp) by passing each to the responsible class. Owned by App,
// like these classes.
#pragma once

#include "daemon/server/api/operations.hpp"
#include "daemon/server/operations/fault_operations.hpp"
#include "daemon/server/operations/monitoring.hpp"
#include "daemon/server/operations/scene_operations.hpp"
#include "daemon/server/operations/sonar_operations.hpp"
#include "daemon/server/operations/time_operations.hpp"

namespace sonar {

class AppOperations final : public Operations {
 public:
  AppOperations(SceneOperations& scene, SonarOperations& sonars, TimeOperations& time, const Monitoring& monitoring,
                FaultOperations& faults)
      : scene_(scene), sonars_(sonars), time_(time), monitoring_(monitoring), faults_(faults) {}

  void perform(const control::Operation& operation, const Sender& sender, Done done, HasLeft has_left = {}) override;
  std::string metrics() const override { return monitoring_.metrics(); }
  std::string problem() const override { return monitoring_.problem(); }

 private:
  SceneOperations& scene_;
  SonarOperations& sonars_;
  TimeOperations& time_;
  const Monitoring& monitoring_;
  FaultOperations& faults_;
};

}  // namespace sonar
