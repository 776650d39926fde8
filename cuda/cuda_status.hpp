// The banner's text about CUDA in this build and on this machine. It is separate from cuda_engine.hpp, so that the daemon's
// texts need no engine.
#pragma once

#include <string>

namespace sonar {

/// "not installed" (there is no CUDA module), "no device", "no device (<the driver's reason>)", what is wrong with the module, or
/// "NVIDIA H200, 139.8 GiB, compute 9.0". Queried every time: a device can disappear.
std::string cuda_status();
/// "not installed" or "not used", without loading the module, which takes seconds and powers the device up if it is suspended.
std::string cuda_presence();

}  // namespace sonar
