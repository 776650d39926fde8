// Gathers the facts of doctor from the network and the kernel without disturbing clients: it first lists the connected clients,
// then connects to sonars without clients. checks.hpp interprets the facts.
#pragma once

#include "clients/sonarctl/control_client.hpp"
#include "clients/sonarctl/doctor/facts.hpp"

namespace sonar::clients::doctor {

struct Questions {
  std::string address;                   // HOST or HOST:PORT; empty = all sonars found, else the demo's address
  Endpoint status_on{"0.0.0.0", 52102};  // address of the status messages
  std::string control, http;             // HOST:PORT; empty = the defaults
  std::filesystem::path token_file;
  bool take = false;  // also connect to sonars that have a client
  double within_s = 8;
};

/// Returns within about `within_s`. Error usage: an invalid address.
Result<Facts> gather(const Questions& questions);

}  // namespace sonar::clients::doctor
