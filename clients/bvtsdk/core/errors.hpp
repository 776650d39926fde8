// Names and texts of the return codes (BVTError_GetName, BVTError_GetString), for any number.
// The names are those of the constants; the texts are ours.
#pragma once

namespace sonar::bvt {

/// "BVT_SUCCESS" and so on; "BVT_UNKNOWN_ERROR" for a number that is none of ours. Never null, valid for ever.
const char* error_name(int code);
/// One sentence that says what happened and what to do.
const char* error_text(int code);

}  // namespace sonar::bvt
