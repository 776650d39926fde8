// Programs that may fail. Their exit is reported. They inherit three files and nothing else from this process.
#include "core/base/child_process.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>

namespace sonar {
namespace {

using ::testing::HasSubstr;

struct Outcome {
  Result<ChildEnd> end;
  std::string output, errors;
};

std::string contents(const MemoryFile& file) {
  std::array<char, 4096> text{};
  const ssize_t n = ::pread(file.descriptor(), text.data(), text.size(), 0);
  return {text.data(), n > 0 ? static_cast<std::size_t>(n) : 0};
}

Outcome run(const std::string& program, const std::vector<std::string>& arguments, std::string_view given = "") {
  auto input = MemoryFile::make("in"), output = MemoryFile::make("out"), errors = MemoryFile::make("err");
  if (!input || !output || !errors) throw std::runtime_error("no memory files");
  EXPECT_EQ(::pwrite(input->descriptor(), given.data(), given.size(), 0), static_cast<ssize_t>(given.size()));
  Outcome done{run_child(program, arguments, *input, *output, *errors), {}, {}};
  done.output = contents(*output), done.errors = contents(*errors);
  return done;
}
Outcome shell(const std::string& script, std::string_view given = "") { return run("/bin/sh", {"-c", script}, given); }

TEST(ChildProcess, ReadsAndWritesItsFilesAndItsEndIsKnown) {
  const Outcome done = shell("cat; echo wrong >&2; exit 3", "given");
  ASSERT_TRUE(done.end) << done.end.error().text;
  EXPECT_EQ(done.end->exit_code, 3);
  EXPECT_EQ(done.end->signal, 0);
  EXPECT_EQ(done.output, "given");
  EXPECT_EQ(done.errors, "wrong\n");
}

TEST(ChildProcess, ASignalThatEndsItIsKnown) {
  const Outcome done = shell("kill -SEGV $$");
  ASSERT_TRUE(done.end);
  EXPECT_EQ(done.end->signal, SIGSEGV);
}

TEST(ChildProcess, InheritsNoOtherDescriptor) {
  int sockets[2];
  ASSERT_EQ(::socketpair(AF_UNIX, SOCK_STREAM, 0, sockets), 0);  // without close-on-exec, as libraries open them
  const Outcome done = shell(
      "for f in /proc/self/fd/*; do [ -S $f ] && echo socket $f; done; for n in 3 4 5 6 7 8 9; do "
      "(: >&$n) 2>/dev/null && echo open $n; done; echo end");
  EXPECT_EQ(done.output, "end\n");
  ::close(sockets[0]), ::close(sockets[1]);
}

TEST(ChildProcess, InheritsNoBlockedOrIgnoredSignal) {
  sigset_t blocked, before;
  sigemptyset(&blocked);
  sigaddset(&blocked, SIGTERM);
  ASSERT_EQ(::pthread_sigmask(SIG_BLOCK, &blocked, &before), 0);
  const auto handler = ::signal(SIGPIPE, SIG_IGN);
  const Outcome done = shell("grep -E '^Sig(Blk|Ign):' /proc/self/status | tail -c 8; grep '^SigBlk:' /proc/self/status");
  ::signal(SIGPIPE, handler);
  ::pthread_sigmask(SIG_SETMASK, &before, nullptr);
  EXPECT_EQ(done.output,
            "0000000\nSigBlk:\t0000000000000000\n");  // none of the first 28 signals is ignored; the C library uses some above
}

TEST(ChildProcess, AProgramThatIsNotThereIsNamed) {
  const Outcome done = run("/no/such/program", {});
  ASSERT_FALSE(done.end);
  EXPECT_EQ(done.end.error().kind, ErrorKind::missing_file);
  EXPECT_THAT(done.end.error().text, HasSubstr("/no/such/program cannot be started: No such file"));
}

TEST(ChildProcess, WorksWhereChildrenAreIgnored) {
  const auto before = ::signal(SIGCHLD, SIG_IGN);
  const Outcome done = shell("echo here");
  ::signal(SIGCHLD, before);
  ASSERT_TRUE(done.end);
  EXPECT_EQ(done.output, "here\n");
}

TEST(ChildProcess, WorksWithClosedStandardStreams) {
  const int kept = ::dup(STDIN_FILENO);
  ::close(STDIN_FILENO);
  const Outcome done = shell("cat", "given");
  if (kept >= 0) ::dup2(kept, STDIN_FILENO), ::close(kept);
  EXPECT_EQ(done.output, "given");
}

}  // namespace
}  // namespace sonar
