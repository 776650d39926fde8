#include "daemon/server/http/page_files.hpp"

namespace sonar {

std::span<const PageFile> page_files() { return {}; }

}  // namespace sonar
