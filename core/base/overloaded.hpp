// The handlers of the types of a std::variant as one visitor.
#pragma once

namespace sonar {

template <class... F>
struct Overloaded : F... {
  using F::operator()...;
};
template <class... F>
Overloaded(F...) -> Overloaded<F...>;  // clang 14 does not deduce it

}  // namespace sonar
