// Carries out requests for sonars: settings, water, and recordings.
#pragma once

#include "daemon/server/api/operations.hpp"
#include "daemon/server/recording/recordings.hpp"
#include "daemon/server/sonars/fleet.hpp"

namespace sonar {

class SonarOperations {
 public:
  /// Changed water is written to `config`.
  SonarOperations(Config& config, Fleet& fleet, Recordings& recordings, Log& log)
      : config_(config), fleet_(fleet), recordings_(recordings), log_(log) {}

  OperationResult set(const control::SetSonar& asked, const Sender& sender);
  OperationResult set(const control::SetEnvironment& asked, const Sender& sender);
  void start(const control::StartRecording& asked, const Sender& sender, Operations::Done done);
  void stop(const control::StopRecording& asked, Operations::Done done);

 private:
  /// Finds a sonar; an empty name means the only one.
  Result<Device*> find(const std::string& name);

  Config& config_;
  Fleet& fleet_;
  Recordings& recordings_;
  Log& log_;
};

}  // namespace sonar
