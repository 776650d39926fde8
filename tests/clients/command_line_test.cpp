// Tests that sonarctl suggests the nearest known word for an unknown command or option.
#include "clients/sonarctl/command_line.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <CLI/CLI.hpp>
#include <array>
#include <atomic>
#include <filesystem>
#include <fstream>

#include "core/text/arguments.hpp"
#include "protocol/control/answers.hpp"
#include "protocol/control/control.hpp"
#include "tests/clients/bound_socket.hpp"

namespace sonar::clients {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::StartsWith;

std::string complaint(const std::vector<std::string>& words) {
  CLI::App app("", "sonarctl");
  app.require_subcommand(1);
  app.set_version_flag("--version", "1");
  const std::vector<Run> commands{add_view(app), add_listen(app), add_pose(app),
                                  add_set(app)};  // they own the variables of the options
  try {
    app.parse(std::vector<std::string>(words.rbegin(), words.rend()));
  } catch (const CLI::ParseError& error) {
    return text::complaint_about(app, error, words);
  }
  return {};
}

/// Replaces line breaks and columns with single spaces.
std::string unwrapped(const std::string& text) {
  std::string words;
  for (const char c : text)
    if (c != '\n' && c != ' ')
      words.push_back(c);
    else if (!words.empty() && words.back() != ' ')
      words.push_back(' ');
  return words;
}

TEST(CommandLine, NamesTheNearestCommand) {
  EXPECT_EQ(complaint({"veiw"}), "unknown command \"veiw\"; did you mean \"view\"? (sonarctl --help)");
  EXPECT_EQ(complaint({"pose", "cirlce"}), "unknown command \"cirlce\"; did you mean \"circle\"? (sonarctl pose --help)");
  EXPECT_THAT(complaint({"qqq"}), AllOf(StartsWith("unknown command \"qqq\"; commands of sonarctl: view"), HasSubstr("pose")));
}

TEST(CommandLine, NamesTheNearestOption) {
  EXPECT_EQ(complaint({"view", "--rnage", "3"}), "unknown option \"--rnage\"; did you mean \"--range\"? (sonarctl view --help)");
  EXPECT_THAT(complaint({"set", "sonar", "--gian=3"}), HasSubstr("did you mean \"--gain\"? (sonarctl set sonar --help)"));
  EXPECT_THAT(complaint({"--verison"}), HasSubstr("did you mean \"--version\"?"));
}

TEST(CommandLine, HelpNamesTheDefaultsOfSettings) {
  CLI::App app("", "sonarctl");
  const auto command = add_listen(app);
  const std::string help = app.get_subcommand("listen")->help();
  for (const char* words : {"default: the make's own; of an Oculus --mode 2 --range 10 --gain 50 --rate 10; of an Omniscan "
                            "--rate 10; of a Ping1D --rate 10",
                            "default: 512", "Default: 127"})
    EXPECT_THAT(unwrapped(help), HasSubstr(words));
}

TEST(CommandLine, DiscoveryFindsOneMakeOnly) {
  CLI::App app("", "sonarctl");
  const auto command = add_view(app);
  app.parse("view --discover --make blueview --png ping.png");
  const Result<void> done = command();
  ASSERT_FALSE(done);
  EXPECT_EQ(done.error().kind, ErrorKind::usage);
  EXPECT_EQ(done.error().text, "--discover finds an Oculus only: leave it out, and give the address of a BlueView sonar");
}

TEST(CommandLine, ModesAreCountedFromOne) {
  EXPECT_THAT(complaint({"listen", "--mode", "0"}), HasSubstr("\"0\" is not a whole number from 1"));
  EXPECT_THAT(complaint({"set", "sonar", "--mode", "0"}), HasSubstr("\"0\" is not a whole number from 1"));
  SettingArguments listen;
  CLI::App app("", "sonarctl");
  listen.add_to(app);
  app.parse("--mode 2");
  EXPECT_EQ(listen.settings.mode, 1u);
  std::atomic<std::uint32_t> mode = 99;
  const SocketServer sonard("127.0.0.1", 0, [&mode](const Socket& client) {
    control::DelimitedParser parser;
    std::array<std::byte, 4096> chunk;
    for (;;) {
      const Read read = read_some(client, chunk, std::chrono::seconds(20));
      if (read.what != Wait::data) return;
      parser.feed(std::span<const std::byte>(chunk).first(read.size));
      while (const auto message = parser.next()) {
        if (!*message) break;
        const auto request = control::decode_request(**message);
        if (!request) return;
        v1::Response response = control::response_of(request->id, control::StatusCode::ok);
        if (const auto* set = std::get_if<control::SetSonar>(&request->op)) {
          mode = set->mode.value_or(99);
          response = control::response_of(request->id, control::StatusCode::refused, "1 mode(s), counted from 0");
        }
        static_cast<void>(write_all(client, control::delimited(control::encode_response(std::move(response)))));
      }
    }
  });
  CLI::App whole("", "sonarctl");
  const auto run = add_set(whole);
  whole.parse("set sonar --mode 2 --control " + sonard.at());
  const Result<void> refused = run();
  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.error().text, HasSubstr("1 mode(s), counted from 0 (--mode counts from 1)"));
  EXPECT_EQ(mode, 1u);
}

/// A file may have the name of a host.
TEST(CommandLine, ASonarIsNotAFile) {
  const std::filesystem::path before = std::filesystem::current_path();
  std::filesystem::current_path(testing::TempDir());
  for (const char* name : {"localhost", "no host has spaces"}) std::ofstream(name) << "x";
  const auto finished = [](const std::string& address) {
    SourceArguments arguments;
    arguments.device.address = address;
    return arguments.finish();
  };
  EXPECT_TRUE(finished("localhost"));
  for (const char* file : {"no host has spaces", "./localhost"}) {
    const auto refused = finished(file);
    ASSERT_FALSE(refused) << file;
    EXPECT_THAT(refused.error().text, HasSubstr("is a file, not the address of a sonar"));
  }
  for (const char* name : {"localhost", "no host has spaces"}) std::filesystem::remove(name);
  std::filesystem::current_path(before);
}

TEST(CommandLine, GoodLinesAreAccepted) {
  EXPECT_THAT(complaint({"view", "127.0.0.2", "--png", "veiw.png", "--range=3"}), IsEmpty());
  EXPECT_THAT(complaint({"pose", "once", "--xyz", "0,0,-3", "--rpy", "-1,0,0"}), IsEmpty());
  EXPECT_THAT(complaint({"view", "--", "--rnage"}), IsEmpty());
  EXPECT_THAT(complaint({"--version"}), IsEmpty());
}

}  // namespace
}  // namespace sonar::clients
