// Asks the network and the kernel what doctor wants to know, in an order that disturbs nobody: first who is connected, then a
// connection to sonars that are free. See judge.hpp for what is made of it.
#pragma once

#include "clients/sonarctl/control/control_client.hpp"
#include "clients/sonarctl/doctor/facts.hpp"

namespace sonar::clients::doctor {

struct Questions {
  std::string address;                   // HOST or HOST:PORT; empty = every sonar that can be found, or the demo's place
  Endpoint status_on{"0.0.0.0", 52102};  // where status messages are listened for
  std::string control, http;             // HOST:PORT; empty = the usual places
  std::filesystem::path token_file;
  bool take = false;  // connect to sonars that have a client, too
  double within_s = 8;
};

/// Always an answer, within about `within_s`; an address that cannot be read is refused.
Result<Facts> gather(const Questions& questions);

}  // namespace sonar::clients::doctor
