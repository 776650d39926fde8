// Makes one visitor of a std::variant from a handler for each of its types.
#pragma once

namespace sonar {

template <class... F>
struct Overloaded : F... {
  using F::operator()...;
};
template <class... F>
Overloaded(F...) -> Overloaded<F...>;  // clang 14 needs this guide

}  // namespace sonar
