// The banner's text about CUDA in this build and on this machine. It is separate from cuda_engine.hpp, so that the texts of the
// daemon need no engine.
#pragma once

#include <string>

namespace sonar {

/// Returns "not installed" (no CUDA module), "no device", "no device (<the driver's reason>)", the error of the module, or
/// "NVIDIA H200, 139.8 GiB, compute 9.0". Every call queries the device, because a device can disappear.
std::string cuda_status();
/// Returns "not installed" or "not used" without loading the module. Loading takes seconds, and powers a suspended device up.
std::string cuda_presence();

}  // namespace sonar
