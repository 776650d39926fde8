#include "daemon/server/view/page_files.hpp"

namespace sonar {

std::span<const PageFile> page_files() { return {}; }

}  // namespace sonar
