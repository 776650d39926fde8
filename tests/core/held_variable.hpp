// Changes an environment variable for the duration of a test.
#pragma once

#include <cstdlib>
#include <optional>
#include <string>

namespace sonar::tests {

class HeldVariable {
 public:
  HeldVariable(const char* name, const char* value) : name_(name) {
    if (const char* was = std::getenv(name)) was_ = was;
    ::setenv(name, value, 1);
  }
  ~HeldVariable() {
    if (was_)
      ::setenv(name_, was_->c_str(), 1);
    else
      ::unsetenv(name_);
  }
  HeldVariable(const HeldVariable&) = delete;
  HeldVariable& operator=(const HeldVariable&) = delete;

 private:
  const char* name_;
  std::optional<std::string> was_;
};

}  // namespace sonar::tests
