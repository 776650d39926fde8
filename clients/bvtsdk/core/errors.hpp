// Names and texts of the return codes (BVTError_GetName, BVTError_GetString). Numbers that are no return code have them, too.
// The names are those of the constants; the texts are sonard's.
#pragma once

namespace sonar::bvt {

/// "BVT_SUCCESS" and so on; "BVT_UNKNOWN_ERROR" for an unknown number. Never null, always valid.
const char* error_name(int code);
/// One sentence with the cause and the remedy.
const char* error_text(int code);

}  // namespace sonar::bvt
