// The seam answers on every machine: without nvcc, without a device, and with one.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "cuda/cuda_engine.hpp"
#include "cuda/cuda_status.hpp"

namespace sonar {
namespace {

using testing::AnyOf;
using testing::HasSubstr;
using testing::StartsWith;

TEST(CudaSeam, SaysWhatThisBuildAndMachineCanDo) {
#ifdef SONAR_CUDA_BUILT
  EXPECT_THAT(cuda_status(), AnyOf(StartsWith("no device"), HasSubstr("GiB, compute ")));
#else
  EXPECT_EQ(cuda_status(), "not built");
#endif
}

TEST(CudaSeam, RefusesAnEngineWithThatReason) {
  const auto engine = make_cuda_engine(std::make_shared<const Scene>());
  ASSERT_FALSE(engine);
  EXPECT_EQ(engine.error().kind, ErrorKind::unavailable);
  EXPECT_THAT(engine.error().text, HasSubstr("CUDA: " + cuda_status()));
}

TEST(CudaSeam, NamesTheDeviceWhereThereIsOne) {
  if (cuda_status() == "not built" || cuda_status().starts_with("no device")) GTEST_SKIP() << "CUDA: " << cuda_status();
  EXPECT_THAT(cuda_status(), HasSubstr(", compute "));
}

}  // namespace
}  // namespace sonar
