// Names and texts of the return codes (BVTError_GetName, BVTError_GetString), also for numbers that are not return codes. The
// names are those of the SDK's constants; the texts are sonard's.
#pragma once

namespace sonar::bvt {

/// Returns a name such as "BVT_SUCCESS", and "BVT_UNKNOWN_ERROR" for an unknown number. Never null; always valid.
const char* error_name(int code);
/// Returns one sentence with the cause and the remedy.
const char* error_text(int code);

}  // namespace sonar::bvt
