// The picture of a flat bed sample by sample, in expected power: no holes for some modes and rows. All products are
// tested in shipped_sonars_test.cpp.
#include <gtest/gtest.h>

#include <tuple>

#include "tests/core/pipeline/coverage.hpp"

namespace sonar::test {
namespace {

using coverage::coverage_of;
using coverage::record_coverage;

TEST(CoverageOracles, Oracle32_FlatBedIsFilled) {
  for (const auto& [mode, settings, what] : {std::tuple{p900(), native_rows(10, 0.0254), "P900 10 m, 928 rows"},
                                             std::tuple{p900(), default_rows(10, 354), "P900 10 m, 354 rows"},
                                             std::tuple{oculus_high(), default_rows(10, 720), "M1200d HF 10 m, 720 rows"},
                                             std::tuple{oculus_high(), default_rows(10, 437), "M1200d HF 10 m, 437 rows"},
                                             std::tuple{oculus_low(), default_rows(30, 720), "M1200d LF 30 m, 720 rows"}})
    record_coverage(what, coverage_of(mode, settings, 2, 0.25, 0), 50000);
  // Looks along the diagonal of the lattice.
  record_coverage("M1200d HF 10 m, 437 rows, 45 degrees round", coverage_of(oculus_high(), default_rows(10, 437), 2, 0.25, 0.785),
                  50000);
}

}  // namespace
}  // namespace sonar::test
