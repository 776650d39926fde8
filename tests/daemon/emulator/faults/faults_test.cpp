// Faults of emulated sonars in virtual time: every kind has its effect and an exact entry in the journal, and has no effect after
// its end.
#include "daemon/emulator/faults/faults.hpp"

#include <gmock/gmock.h>

#include <limits>
#include <set>

#include "daemon/config/fault_support.hpp"
#include "tests/daemon/emulator/sonar/virtual_time.hpp"
#include "tests/is_sanitized.hpp"

namespace sonar {
namespace {

using namespace testing_emulator;
using std::chrono::milliseconds;
using std::chrono::seconds;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

struct Journal final : FaultJournal {
  std::vector<FaultEntry> entries;
  void write(const FaultEntry& entry) override { entries.push_back(entry); }
  std::vector<FaultEntry> injected() const {
    std::vector<FaultEntry> all;
    for (const FaultEntry& e : entries)
      if (e.what == FaultEntry::What::injected) all.push_back(e);
    return all;
  }
};

FaultRecord record(const std::string& what, std::map<std::string, std::string> with = {}) {
  FaultRecord r;
  r.what = what;
  r.with = std::move(with);
  return r;
}
FaultRecord at_ping(const std::string& what, std::uint64_t ping, std::map<std::string, std::string> with = {}) {
  FaultRecord r = record(what, std::move(with));
  r.at.ping = ping;
  return r;
}

const std::string two = oculus_sonar("front", "127.0.0.2", "    clients: {max: 4}\n") + oculus_sonar("rear", "127.0.0.3");

/// A run of two sonars, each with one client. The fault acts on the sonar "front".
struct Played {
  explicit Played(const std::optional<FaultRecord>& fault, int seed = 1, milliseconds length = milliseconds(3000))
      : time(yaml_of(two, seed), &journal) {
    rear = time.connect("rear");
    time.send(rear, fire());
    front = time.connect("front");
    if (fault) time.add_fault("front", *fault);
    time.send(front, fire());
    time.run(length);
  }
  const protocol::Bytes& bytes() { return time.clients[front].received; }

  Journal journal;
  VirtualTime time;
  ConnectionId front = 0, rear = 0;
};

std::size_t first_difference(const protocol::Bytes& a, const protocol::Bytes& b) {
  return static_cast<std::size_t>(std::mismatch(a.begin(), a.end(), b.begin(), b.end()).first - a.begin());
}

// ---- the catalogue

TEST(FaultKinds, HaveOneCodeAndOneNameEach) {
  std::set<std::string_view> words;
  for (const FaultKind& kind : fault_kinds()) {
    EXPECT_TRUE(words.insert(kind.code).second) << kind.code;
    EXPECT_TRUE(words.insert(kind.name).second) << kind.name;
    EXPECT_FALSE(kind.sentence.empty() || kind.good_driver.empty()) << kind.code;
    EXPECT_TRUE(kind.sentence.ends_with('.')) << kind.code;
  }
  for (const Trouble& trouble : troubles()) EXPECT_TRUE(trouble.parts.front().code.size() == 3 && !trouble.sentence.empty());
}

TEST(FaultKinds, DefaultsAndTroublesAreValid) {
  for (const FaultKind& kind : fault_kinds()) {
    const auto faults = check_fault(record(std::string(kind.code)), true);
    ASSERT_TRUE(faults) << faults.error().text;
    EXPECT_EQ(faults->front().kind, &kind);
    EXPECT_TRUE(check_fault(record(std::string(kind.name)), true)) << kind.name;
  }
  for (const Trouble& trouble : troubles())
    for (const std::string severity : {"1", "2", "3"}) {
      const auto faults = check_fault(record(std::string(trouble.name), {{"severity", severity}}), true);
      ASSERT_TRUE(faults) << faults.error().text;
      EXPECT_EQ(faults->front().what, trouble.name);
      EXPECT_EQ(faults->front().name, std::string(trouble.name) + ".1");
    }
}

TEST(FaultKinds, TakeEffectOrGiveTheReason) {
  const std::string table = support_table();
  std::cout << table;
  EXPECT_THAT(table, HasSubstr("| L05 | silent-open | 1 | takes effect | takes effect |"));
  EXPECT_THAT(table, HasSubstr("| U02 | status-gap | 1 | takes effect | has no status message |"));
  EXPECT_THAT(table,
              HasSubstr("| G01 | part-lost | 1 | sends no datagrams of pings | sends no datagrams of pings | takes effect |"));
  EXPECT_THAT(table, HasSubstr("| S01 | slices | 1 | takes effect | takes effect | sends pings by datagrams alone |"));
  EXPECT_THAT(table, HasSubstr("| L06 | vanished-peer | 1 | needs two network namespaces"));
  EXPECT_THAT(table, HasSubstr("| B13 | bad-compression | 1 | only the BlueView link has it | takes effect |"));
}

TEST(FaultRecords, AreRefusedWithWhatIsWrongAndWhatIsPossible) {
  const auto text = [](FaultRecord r, bool manual = true) {
    const auto faults = check_fault(r, manual);
    return faults ? std::string("accepted") : faults.error().text;
  };
  EXPECT_THAT(text(record("silent-opne")), HasSubstr("did you mean \"silent-open\"?"));
  EXPECT_THAT(text(record("F01", {{"bytes", "0"}})), HasSubstr("bytes must be a whole number from 1 to 4096, not \"0\""));
  for (const char* real : {"1.5", "1e-300"})
    EXPECT_THAT(text(record("F01", {{"bytes", real}})), HasSubstr("bytes must be a whole number from 1 to 4096")) << real;
  EXPECT_THAT(text(record("F13", {{"value", "2.5"}})), HasSubstr("value must be a whole number"));
  EXPECT_THAT(text(record("F01", {{"fill", "zeros"}})), HasSubstr("did you mean \"zero\"?"));
  EXPECT_THAT(text(record("F01", {{"byte", "1"}})), HasSubstr("has no parameter \"byte\"; did you mean \"bytes\"?"));
  EXPECT_THAT(text(record("F05", {{"value", "0xZZ"}})), HasSubstr("value must be a whole number"));
  EXPECT_THAT(text(record("power-cycle", {{"severity", "4"}})), HasSubstr("severity must be 1, 2 or 3"));
  FaultRecord r = record("L05");
  r.at.ping = 1;
  r.at.every = 2;
  EXPECT_THAT(text(r), HasSubstr("give one of ping, every, time_s, probability and on"));
  r = record("L05");
  r.at.on = "conect";
  EXPECT_THAT(text(r), HasSubstr("did you mean \"connect\"?"));
  r = record("L05");
  r.lasts.seconds = 601;
  EXPECT_THAT(text(r), HasSubstr("ends after 600 s at the latest"));
  EXPECT_EQ(text(r, false), "accepted");
  r.lasts.seconds = 1e9;
  EXPECT_THAT(text(r), HasSubstr("ends after 600 s at the latest"));
  EXPECT_THAT(text(r, false), HasSubstr("at most 86400"));
  r.lasts.seconds = 0;
  EXPECT_THAT(text(r), HasSubstr("seconds must be above 0"));
  r = record("P01");
  r.client = "newest";
  EXPECT_THAT(text(r), HasSubstr("cannot be limited to the client newest"));
  r = record("F01");
  r.client = "10.0.0.0/33";
  EXPECT_THAT(text(r), HasSubstr("client must be"));
  r.client = "10.0.0.0/8";
  EXPECT_EQ(text(r), "accepted");
}

TEST(FaultRecords, RecordsWithoutANameAreNamedAsRequested) {
  for (const char* asked : {"L05", "silent-open"}) EXPECT_EQ(check_fault(record(asked), true)->front().name, asked);
}

TEST(FaultRecords, RecordsWithoutEffectAreRefused) {
  const auto text = [](const FaultRecord& r) {
    const auto faults = check_fault(r, true);
    return faults ? std::string("accepted") : faults.error().text;
  };
  FaultRecord r = record("L05");
  r.at.every = 1;
  r.at.phase = 5;
  EXPECT_THAT(text(r), HasSubstr("phase must be below every, 1: no ping number modulo 1 is 5"));
  r.at.every = 5;
  EXPECT_THAT(text(r), HasSubstr("phase must be below every"));
  r.at.every = 6;
  EXPECT_EQ(text(r), "accepted");
  r = record("L05");
  for (const double never : {1e-300, 9e-10, 0.0, -1.0, std::numeric_limits<double>::quiet_NaN()}) {
    r.at.probability = never;
    EXPECT_THAT(text(r), HasSubstr("probability must be from 1e-9 to 1")) << never;
  }
  r.at.probability = 1e-9;
  EXPECT_EQ(text(r), "accepted");
}

TEST(FaultRecords, TwoThatChangeTheSamePartAreRefused) {
  Played run(at_ping("F03", 1000));
  const auto why = [&](const FaultRecord& r) { return run.time.sonar("front").why_no_faults(*check_fault(r, true)).value(); };
  const FaultRefusal same_part = why(record("F05")), no_datagrams = why(record("G01"));
  EXPECT_EQ(same_part.code, FaultRefusal::Code::conflict);
  EXPECT_THAT(same_part.text, HasSubstr("would both write the same part (payload_size)"));
  EXPECT_EQ(no_datagrams.code, FaultRefusal::Code::no_effect);
  EXPECT_THAT(no_datagrams.text, HasSubstr("has no effect on the sonar front (sends no datagrams of pings)"));
}

// ---- every kind

/// Runs with one kind of fault, which is the parameter.
class EveryKind : public ::testing::TestWithParam<std::string> {};

TEST_P(EveryKind, IsTheSameInEveryRunAndActsOnOneSonarAndEnds) {
  const FaultKind& kind = *find_fault_kind(GetParam());
  FaultRecord fault = record(GetParam());
  fault.at.ping = 5;
  if (!kind.per_ping()) fault.lasts.seconds = 0.8;
  if (kind.effect == FaultEffect::power_cycle) fault.with = {{"boot-s", "0.5"}, {"gap-s", "0.1"}};
  if (kind.effect == FaultEffect::delay) fault.with = {{"ms", "250"}};
  const auto play = [&] {
    auto run = std::make_unique<Played>(fault);
    for (int i = 0; i < 3; ++i)
      run->time.send(run->front, fire(oculus::PingRate::hz15));  // requests, for the faults that act on requests
    run->time.sonar("front").beacons(run->time.now);
    run->time.run(milliseconds(100));
    return run;
  };
  Played undisturbed(std::nullopt);
  undisturbed.time.run(milliseconds(100));
  const auto first = play(), second = play();
  EXPECT_EQ(first->bytes(), second->bytes());
  ASSERT_EQ(first->journal.entries.size(), second->journal.entries.size());
  for (std::size_t i = 0; i < first->journal.entries.size(); ++i) {
    EXPECT_EQ(first->journal.entries[i].offset, second->journal.entries[i].offset);
    EXPECT_EQ(first->journal.entries[i].ping, second->journal.entries[i].ping);
  }
  EXPECT_EQ(first->time.clients[first->rear].received, undisturbed.time.clients[undisturbed.rear].received)
      << "the fault changed the bytes of the other sonar";

  ASSERT_FALSE(first->journal.entries.empty());
  EXPECT_EQ(first->journal.entries.front().what, FaultEntry::What::began);
  EXPECT_EQ(first->journal.entries.front().kind, &kind);
  first->time.end_faults("front");
  for (const Faults::Listed& listed : first->time.sonar("front").faults().list()) EXPECT_TRUE(listed.over && !listed.active);

  // After the end: a client that connects anew is served and gets whole messages.
  EXPECT_TRUE(first->time.listens("front"));
  const ConnectionId next = first->time.connect("front");
  EXPECT_TRUE(first->time.clients[next].served && first->time.clients[next].is_read);
  first->time.send(next, fire());
  first->time.run(seconds(1));
  EXPECT_GE(ping_numbers(first->time.clients[next].received).size(), 3u);
  const auto beacons = first->time.sonar("front").beacons(first->time.now);
  ASSERT_EQ(beacons.size(), 1u);
  EXPECT_EQ(beacons.front().size(), undisturbed.time.sonar("front").beacons(undisturbed.time.now).front().size());
}

std::vector<std::string> codes_of_oculus() {
  std::vector<std::string> codes;
  const protocol::Vendor& vendor = *protocol::find_profile("oculus-m1200d")->vendor;
  for (const FaultKind& kind : fault_kinds())
    if (why_without_effect(kind, vendor).empty()) codes.emplace_back(kind.code);
  return codes;
}
INSTANTIATE_TEST_SUITE_P(Oculus, EveryKind, ::testing::ValuesIn(codes_of_oculus()), [](const auto& test) { return test.param; });

// ---- exact places

TEST(FaultJournals, NameTheFirstByteThatDiffersAThousandTimes) {
  // (kind, parameters): the first difference of the streams must be the journal's offset.
  const std::vector<std::pair<std::string, std::map<std::string, std::string>>> kinds = {
      {"F01", {}},
      {"F01", {{"fill", "random"}, {"bytes", "100"}}},
      {"F01", {{"fill", "S"}}},
      {"F02", {}},
      {"F03", {}},
      {"F04", {}},
      {"F05", {}},
      {"F07", {}},
      {"F08", {}},
      {"F09", {}},
      {"F10", {}},
      {"F11", {}},
      {"F12", {}},
      {"F13", {}},
      {"F14", {}},
      {"F19", {}},
      {"F19", {{"region", "header"}}},
      {"F19", {{"region", "metadata"}, {"bits", "9"}}},
      {"F20", {}},
      {"F22", {}},
      {"F06", {{"lengths", "declared"}}},
      {"D08", {}},
      {"D26", {}},
      {"D27", {}},
      {"D28", {}}};
  Played undisturbed(std::nullopt);
  const protocol::Bytes expected = undisturbed.bytes();
  constexpr int wanted = test::is_sanitized ? 100 : 1000;
  int injections = 0;
  for (int seed = 1; injections < wanted; ++seed) {
    const auto& [kind, with] = kinds[static_cast<std::size_t>(seed) % kinds.size()];
    FaultRecord fault = at_ping(kind, 2 + static_cast<std::uint64_t>(seed) % 20, with);
    fault.lasts.pings = 1;
    Played run(fault, seed);
    const auto entries = run.journal.injected();
    ASSERT_EQ(entries.size(), 1u) << kind;
    ASSERT_EQ(entries.front().offset, static_cast<std::int64_t>(first_difference(run.bytes(), expected)))
        << kind << " seed " << seed;
    ++injections;
  }
}

TEST(FaultJournals, NameTheLastByteOfAnEndedConnection) {
  for (const double fraction : {0.0, 0.25, 0.5, 0.999}) {
    Played run(at_ping("L03", 7, {{"fraction", std::to_string(fraction)}}));
    const auto entries = run.journal.injected();
    ASSERT_EQ(entries.size(), 1u);
    EXPECT_EQ(entries.front().offset, static_cast<std::int64_t>(run.bytes().size()));
    EXPECT_TRUE(run.time.clients[run.front].closed);
    EXPECT_FALSE(run.time.clients[run.front].reset);
  }
  Played reset(at_ping("L04", 7));
  EXPECT_TRUE(reset.time.clients[reset.front].reset);
}

// ---- effects

TEST(Faults, SilenceLeavesTheConnectionOpenAndCountsWhatIsDropped) {
  FaultRecord fault = at_ping("silent-open", 5);
  fault.lasts.seconds = 1;
  Played run(fault);
  const auto numbers = ping_numbers(run.bytes());
  EXPECT_FALSE(run.time.clients[run.front].closed);
  EXPECT_EQ(std::count(numbers.begin(), numbers.end(), 5u), 0);
  const DeviceFigures f = run.time.sonar("front").figures();
  EXPECT_EQ(f.dropped_by[static_cast<std::size_t>(DropReason::fault)], run.journal.injected().size());
  EXPECT_EQ(f.offered, f.sent + f.dropped + f.waiting);
  EXPECT_GT(numbers.back(), 15u) << "pings continue after one second";
}

TEST(Faults, EveryAndProbabilityAndCount) {
  FaultRecord every = record("F16");
  every.at.every = 4;
  every.lasts.count = 3;
  Played run(every);
  std::vector<std::uint32_t> dropped;
  for (const FaultEntry& e : run.journal.injected()) dropped.push_back(e.ping);
  EXPECT_THAT(dropped, ::testing::ElementsAre(4u, 8u, 12u));
  FaultRecord often = record("F16");
  often.at.probability = 0.5;
  Played half(often, 3, seconds(30));
  EXPECT_NEAR(static_cast<double>(half.journal.injected().size()), 150, 40);
}

TEST(Faults, AnOverheatingDeviceSlowsDownThenStopsThenPingsAgain) {
  FaultRecord trouble = at_ping("overheating", 10);
  trouble.lasts.seconds = 4;
  Played run(trouble, 1, milliseconds(900));
  const auto pings_in = [&](milliseconds time) {
    const std::size_t before = ping_numbers(run.bytes()).size();
    run.time.run(time);
    return ping_numbers(run.bytes()).size() - before;
  };
  pings_in(milliseconds(200));
  EXPECT_NEAR(static_cast<double>(pings_in(milliseconds(1600))), 8, 1) << "hot: 5 of 10 Hz";
  pings_in(milliseconds(300));
  EXPECT_EQ(pings_in(milliseconds(1500)), 0u) << "too hot";
  pings_in(milliseconds(700));
  EXPECT_NEAR(static_cast<double>(pings_in(milliseconds(1000))), 10, 1) << "cool again";
  EXPECT_EQ(run.time.sonar("front").faults().active_count(), 0u);
}

TEST(Faults, APowerCycleResetsTheStateThatADeviceLoses) {
  FaultRecord fault = at_ping("power-cycle", 8, {});
  fault.what = "L10";
  fault.with = {{"boot-s", "2"}, {"gap-s", "1"}};
  Played run(fault, 1, milliseconds(1000));
  EXPECT_TRUE(run.time.clients[run.front].reset);
  EXPECT_FALSE(run.time.listens("front"));
  EXPECT_THAT(run.time.sonar("front").beacons(run.time.now), IsEmpty());
  run.time.run(milliseconds(1900));
  EXPECT_FALSE(run.time.sonar("front").beacons(run.time.now).empty()) << "status comes back first";
  EXPECT_FALSE(run.time.listens("front"));
  run.time.run(milliseconds(1200));
  EXPECT_TRUE(run.time.listens("front"));
  const ConnectionId again = run.time.connect("front");
  run.time.send(again, fire());
  run.time.run(milliseconds(450));
  EXPECT_EQ(ping_numbers(run.time.clients[again].received).front(), 1u) << "numbers begin again";
}

TEST(Faults, RequestsAreIgnoredDelayedClampedOrEndTheConnection) {
  Played ignored(record("D01"));
  EXPECT_THAT(ignored.journal.injected(), ::testing::SizeIs(1));
  Played clamped(record("D03", {{"range-m", "4"}}));
  EXPECT_NEAR(clamped.time.sonar("front").settings().range_m, 4, 0.1);
  Played late(record("D02", {{"seconds", "1"}}), 1, milliseconds(900));
  EXPECT_FALSE(late.time.sonar("front").wants_pings());
  late.time.run(milliseconds(200));
  EXPECT_TRUE(late.time.sonar("front").wants_pings());
  Played ended(record("M09"));
  EXPECT_TRUE(ended.time.clients[ended.front].closed);
}

TEST(Faults, AreForTheChosenClientAlone) {
  VirtualTime time(yaml_of(oculus_sonar("front", "127.0.0.2", "    clients: {max: 4}\n")));
  const ConnectionId first = time.connect("front"), second = time.connect("front");
  FaultRecord fault = record("F16");
  fault.client = "2";
  fault.lasts.pings = 5;
  time.add_fault("front", fault);
  time.send(first, fire());
  time.run(seconds(1));
  EXPECT_EQ(ping_numbers(time.clients[first].received).front(), 1u);
  EXPECT_EQ(ping_numbers(time.clients[second].received).front(), 6u);
}

TEST(Faults, HeldPingsComeInOrderAndAreCounted) {
  FaultRecord fault = at_ping("burst", 3);
  fault.lasts.seconds = 1;
  Played run(fault);
  const auto numbers = ping_numbers(run.bytes());
  for (std::size_t i = 1; i < numbers.size(); ++i) EXPECT_EQ(numbers[i], numbers[i - 1] + 1);
  Played swapped(at_ping("F17", 3));
  EXPECT_THAT(ping_numbers(swapped.bytes()), ::testing::IsSupersetOf({2u, 4u, 3u, 5u}));
  const auto order = ping_numbers(swapped.bytes());
  EXPECT_EQ(order[2], 4u);
  EXPECT_EQ(order[3], 3u);
}

TEST(Faults, PingsThatAreHeldLongKeepTheirOtherFault) {
  VirtualTime time(yaml_of(two));
  const ConnectionId client = time.connect("front");
  time.add_fault("front", record("latency", {{"ms", "9000"}}));
  FaultRecord gap = record("gap");
  gap.at.every = 1;
  time.add_fault("front", gap);
  time.send(client, fire());
  time.run(seconds(20));
  EXPECT_THAT(ping_numbers(time.clients[client].received), ::testing::IsEmpty());
  const DeviceFigures f = time.sonar("front").figures();
  EXPECT_GT(f.dropped_by[static_cast<std::size_t>(DropReason::fault)], 100u);
}

TEST(Faults, HeldPingsOfAClientThatLeavesCountAsGone) {
  VirtualTime time(yaml_of(two));
  const ConnectionId client = time.connect("front");
  time.add_fault("front", record("latency", {{"ms", "9000"}}));
  time.send(client, fire());
  time.run(seconds(8));
  time.close(client);
  time.run(seconds(1));
  const DeviceFigures f = time.sonar("front").figures();
  EXPECT_GT(f.dropped_by[static_cast<std::size_t>(DropReason::gone)], 50u);
  EXPECT_EQ(f.dropped_by[static_cast<std::size_t>(DropReason::gone)], f.dropped);
}

TEST(Faults, AThousandOfEveryKindLeaveNothing) {
  VirtualTime time(yaml_of(oculus_sonar("front", "127.0.0.2", "    clients: {max: 4}\n")));
  for (const std::string& code : codes_of_oculus()) {
    for (int i = 0; i < (test::is_sanitized ? 200 : 1000); ++i) {
      time.add_fault("front", record(code));
      if (i % 100 == 0) {
        const ConnectionId client = time.connect("front");
        time.send(client, fire());
        time.run(milliseconds(250));
        time.end_faults("front");
        if (!time.clients[client].closed) time.close(client);
        time.clients.clear();
      }
      time.end_faults("front");
    }
    ASSERT_LE(time.sonar("front").faults().list().size(), 70u) << code;
    ASSERT_EQ(time.sonar("front").faults().active_count(), 0u) << code;
    ASSERT_TRUE(time.listens("front")) << code;
    ASSERT_TRUE(time.sonar("front").connections().empty()) << code;
    time.log.clear();
  }
  const DeviceFigures f = time.sonar("front").figures();
  EXPECT_EQ(f.offered, f.sent + f.dropped + f.waiting);
  const ConnectionId client = time.connect("front");
  time.send(client, fire());
  time.run(seconds(1));
  EXPECT_THAT(ping_numbers(time.clients[client].received), ::testing::SizeIs(::testing::Ge(9)));
}

TEST(Faults, EndByThemselvesAfterTenMinutes) {
  FaultRecord fault = record("F16");
  fault.at.every = 1000000;
  Played run(fault, 1, seconds(1));
  EXPECT_FALSE(run.time.sonar("front").faults().list().front().over);
  run.time.run(seconds(600));
  EXPECT_TRUE(run.time.sonar("front").faults().list().front().over);
}

}  // namespace
}  // namespace sonar
