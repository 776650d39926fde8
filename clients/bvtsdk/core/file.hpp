// A pointer to a C stream that closes the stream when it is destroyed.
#pragma once

#include <cstdio>
#include <memory>

namespace sonar::bvt {

struct CloseFile {
  void operator()(std::FILE* file) const { std::fclose(file); }
};
using File = std::unique_ptr<std::FILE, CloseFile>;

}  // namespace sonar::bvt
