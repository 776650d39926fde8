#include "protocol/blueview/options.hpp"

#include <array>

namespace sonar::blueview {

std::span<const protocol::Option> options() {
  static const std::array<protocol::Option, 3> all{{
      {option_name::heads_base,
       {"0", "1", "strict"},
       "0",
       "id of the first head: 0 or 1, the other one being accepted too; strict = 0, and no other"},
      {option_name::strict_range,
       {"off", "on"},
       "off",
       "a range beyond the product's is refused with 4009 instead of moved into it"},
      {option_name::compression, {"none", "deflate"}, "none", "of the samples: deflate for slow links"},
  }};
  return all;
}

}  // namespace sonar::blueview
