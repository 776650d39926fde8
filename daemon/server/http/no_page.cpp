#include "daemon/server/http/page.hpp"

namespace sonar {

std::span<const PageFile> page_files() { return {}; }

}  // namespace sonar
