// Replaces protocol/make_list.cpp: the makes of the product and one more.
#include "tests/example_make/example.hpp"
#include "tests/example_make/messages.hpp"

namespace sonar::protocol {

std::span<const Make> makes() {
  static constexpr HostPort ports[]{{HostPort::Kind::tcp, example_make::tcp_port}};
  static const std::vector<Make> all = [] {
    std::vector<Make> makes = product_makes();
    makes.push_back({.device = &example_make::vendor(),
                     .title = "an Example",
                     .request = "message of settings",
                     .remedy = "send settings (type 1) with a rate above 0",
                     .ports = ports,
                     .host = example_make::make_host,
                     .codec = example_make::codec()});
    return makes;
  }();
  return all;
}

}  // namespace sonar::protocol
