// Tests the interface to the CUDA module on every machine: without the module, with an invalid one, without a device and with
// a device.
#include <dlfcn.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cstdlib>
#include <string>

#include "cuda/cuda_engine.hpp"
#include "cuda/cuda_module.hpp"
#include "cuda/cuda_status.hpp"

namespace sonar {
namespace {

using testing::AnyOf;
using testing::HasSubstr;
using testing::StartsWith;

#ifdef SONARD_CUDA_MODULE
/// The value in the environment when the program began. A packed test is not in the build folder.
const std::string built_module = [] {
  const char* const given = std::getenv("SONARD_CUDA_MODULE");
  return std::string(given ? given : SONARD_CUDA_MODULE);
}();
#endif
void use_module(const char* module) { setenv("SONARD_CUDA_MODULE", module, 1); }

void expect_no_engine() {
  Parallel pool;
  const auto engine = make_cuda_engine(std::make_shared<const Scene>(), pool);
  ASSERT_FALSE(engine);
  EXPECT_EQ(engine.error().kind, ErrorKind::unavailable);
  EXPECT_THAT(engine.error().text, HasSubstr("CUDA: " + cuda_status()));
}

TEST(CudaSeam, SaysThatThereIsNoModule) {
  use_module("/nowhere/libsonard_cuda.so");
  EXPECT_EQ(cuda_status(), "not installed");
  EXPECT_EQ(cuda_presence(), "not installed");
  expect_no_engine();
}

TEST(CudaSeam, SaysThatAFileIsNotAModule) {
  use_module(SONARD_SOURCE_DIR "/LICENSE");
  EXPECT_THAT(cuda_status(), StartsWith("not loadable: "));
  EXPECT_EQ(cuda_presence(), "not used");  // cuda_presence() does not load the module
  expect_no_engine();
}

TEST(CudaSeam, NamesTheDeviceOrSaysThatThereIsNone) {
#ifdef SONARD_CUDA_MODULE
  use_module(built_module.c_str());
  EXPECT_THAT(cuda_status(), AnyOf(StartsWith("no device"), HasSubstr("GiB, compute ")));
  if (cuda_status().starts_with("no device")) expect_no_engine();
#else
  GTEST_SKIP() << "this build has no CUDA module: nvcc was not found";
#endif
}

// Loads only the module. Without a device too, the module names the cuFFT that it uses, or the missing file.
TEST(CudaSeam, FindsCufftOrSaysWhichFileIsMissing) {
#ifdef SONARD_CUDA_MODULE
  void* library = dlopen(built_module.c_str(), RTLD_NOW | RTLD_LOCAL);
  ASSERT_NE(library, nullptr) << dlerror();
  const auto entry = reinterpret_cast<cuda::CudaModuleEntry>(dlsym(library, cuda::module_entry));
  ASSERT_NE(entry, nullptr);
  std::array<char, 256> name{};
  const bool there = entry()->transforms(name.data(), name.size()) != 0;
  EXPECT_THAT(std::string(name.data()), StartsWith(there ? "cuFFT " : "no libcufft.so."));
  if (!there) GTEST_SKIP() << name.data();
#else
  GTEST_SKIP() << "this build has no CUDA module: nvcc was not found";
#endif
}

TEST(CudaSeam, UsesTheDeviceOfAModule) {
  use_module(SONARD_HOST_MODULE);
  EXPECT_EQ(cuda_status(), "host loops");
  Parallel pool;
  const auto engine = make_cuda_engine(std::make_shared<const Scene>(), pool);
  ASSERT_TRUE(engine);
  EXPECT_THAT((*engine)->description(), StartsWith("cuda, host loops, "));
}

TEST(CudaSeam, ReportsADeviceThatIsLostDuringTheStart) {
  use_module(SONARD_HOST_MODULE);
  setenv("SONARD_TEST_DEVICE_LASTS", "2", 1);
  Parallel pool;
  const auto engine = make_cuda_engine(std::make_shared<const Scene>(), pool);
  unsetenv("SONARD_TEST_DEVICE_LASTS");
  ASSERT_FALSE(engine);
  EXPECT_EQ(engine.error().text, "no CUDA engine (CUDA: host loops: the device is lost)");
}

}  // namespace
}  // namespace sonar
