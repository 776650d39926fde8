// Tests the look-up of a host name, with a stand-in for the resolver that the test ends.
#include "clients/sonarctl/net.hpp"

#include <arpa/inet.h>
#include <gmock/gmock.h>
#include <pthread.h>

#include <csignal>
#include <future>
#include <memory>
#include <system_error>
#include <thread>

namespace sonar::clients::resolve_test {
namespace {

using testing::HasSubstr;

TEST(Resolve, AnAddressNeedsNoLookup) {
  const auto found = resolve({"127.0.0.2", 9}, [](const std::string&) -> Result<in_addr> {
    ADD_FAILURE();
    return failure(ErrorKind::usage, "");
  });
  ASSERT_TRUE(found);
  EXPECT_EQ(ntohl(found->sin_addr.s_addr), 0x7F000002u);
  EXPECT_EQ(ntohs(found->sin_port), 9);
}

TEST(Resolve, ANameIsLookedUpOrReportedWithoutAnAddress) {
  const auto found = resolve({"localhost", 9});
  ASSERT_TRUE(found) << found.error().text;
  EXPECT_EQ(ntohl(found->sin_addr.s_addr), 0x7F000001u);
  const auto none = resolve({"no host has spaces", 9});
  ASSERT_FALSE(none);
  EXPECT_EQ(none.error().kind, ErrorKind::usage);
  EXPECT_THAT(none.error().text, HasSubstr("no address for \"no host has spaces\""));
}

TEST(Resolve, TheFirstSignalEndsALookupThatDoesNotEnd) {
  struct Promises {
    std::promise<void> begun, answer, ended;
  };
  const auto promises = std::make_shared<Promises>();  // the abandoned thread may outlive this test
  const auto answers = promises->answer.get_future().share();
  auto found = std::async(std::launch::async, [promises, answers] {
    return resolve({"slow", 9}, [promises, answers](const std::string&) -> Result<in_addr> {
      promises->begun.set_value();
      answers.wait();
      promises->ended.set_value();
      return in_addr{};
    });
  });
  promises->begun.get_future().wait();
  interrupted = 1;
  EXPECT_EQ(found.wait_for(std::chrono::seconds(20)), std::future_status::ready);
  interrupted = 0;
  promises->answer.set_value();
  promises->ended.get_future().wait();
  const auto got = found.get();
  ASSERT_FALSE(got);
  EXPECT_EQ(got.error().kind, ErrorKind::io);
  EXPECT_THAT(got.error().text, HasSubstr("interrupted before the address of slow was found"));
}

/// While an object exists, no thread can start: the stacks of new threads would be larger than any address space.
class NoThreads {
 public:
  NoThreads() {
    ::pthread_getattr_default_np(&before_);
    pthread_attr_t huge;
    ::pthread_attr_init(&huge);
    ::pthread_attr_setstacksize(&huge, std::size_t{1} << 58);
    EXPECT_EQ(::pthread_setattr_default_np(&huge), 0);
    ::pthread_attr_destroy(&huge);
  }
  ~NoThreads() {
    ::pthread_setattr_default_np(&before_);
    ::pthread_attr_destroy(&before_);
  }
  NoThreads(const NoThreads&) = delete;
  NoThreads& operator=(const NoThreads&) = delete;

 private:
  pthread_attr_t before_;
};

TEST(Resolve, ANameIsLookedUpWithoutAThread) {
  const NoThreads limit;
  EXPECT_THROW(std::thread([] {}).join(), std::system_error);
  std::thread::id looked_up_by;
  const auto found = resolve({"near", 9}, [&](const std::string&) -> Result<in_addr> {
    looked_up_by = std::this_thread::get_id();
    return in_addr{htonl(0x7F000003)};
  });
  ASSERT_TRUE(found) << found.error().text;
  EXPECT_EQ(ntohl(found->sin_addr.s_addr), 0x7F000003u);
  EXPECT_EQ(looked_up_by, std::this_thread::get_id());
  sigset_t blocked;
  ::pthread_sigmask(SIG_BLOCK, nullptr, &blocked);
  EXPECT_EQ(sigismember(&blocked, SIGINT), 0);
}

}  // namespace
}  // namespace sonar::clients::resolve_test
