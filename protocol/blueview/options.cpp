#include "protocol/blueview/options.hpp"

#include <array>

namespace sonar::blueview {

std::span<const protocol::Option> options() {
  static const std::array<protocol::Option, 3> all{{
      {option_name::heads_base,
       {"0", "1", "strict"},
       "0",
       "id of the first head; a sonar of one head accepts both 0 and 1, unless this is strict (0 only)"},
      {option_name::strict_range,
       {"off", "on"},
       "off",
       "a range outside that of the product is refused with error 4009 (on) or clamped (off)"},
      {option_name::compression, {"none", "deflate"}, "none", "compression of the samples; deflate is for slow links"},
  }};
  return all;
}

}  // namespace sonar::blueview
