// All parts of the model together: two sonars alternate in one engine. The bytes of each ping depend neither on the thread that
// computes it nor on earlier pings. A part that is switched off has the same effect as missing data.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <memory>
#include <string>
#include <vector>

#include "core/base/parallel.hpp"
#include "core/pipeline/ping_engine.hpp"
#include "tests/core/pipeline/basin.hpp"

namespace sonar::test {
namespace {

std::string bytes_of(const Ping& ping) {
  std::string all;
  const auto add = [&all](const auto& values) {
    all.append(reinterpret_cast<const char*>(values.data()), values.size() * sizeof(values[0]));
  };
  add(ping.samples), add(ping.pressure_upa), add(ping.beam_signal_upa), add(ping.row_gain), add(ping.truth);
  return all;
}

class Engine {
 public:
  explicit Engine(std::shared_ptr<const Scene> scene, int threads = 1)
      : pool_(threads), engine_(make_cpu_engine(std::move(scene), pool_)) {}
  Ping ping(const PingRequest& request) { return engine_->run({&request, 1}).at(0); }

 private:
  Parallel pool_;
  std::unique_ptr<PingEngine> engine_;
};

TEST(Everything, IsTheSameBytesForAnyNumberOfThreadsAndWhateverCameBefore) {
  const std::shared_ptr<const Scene> scene = basin();
  Engine one(scene, 1), two(scene, 2), four(scene, 4);
  for (const auto& [what, narrow] : turns()) {
    // Narrow beams need many cells, so they are tested only with everything on; single changes use wide beams.
    const bool everything = what.starts_with("everything");
    const PingRequest request = everything ? narrow : with_wide_beams(narrow);
    const Ping ping = one.ping(request);
    const std::string bytes = bytes_of(ping);
    EXPECT_TRUE(bytes == bytes_of(two.ping(request))) << what << ": 2 threads";
    if (everything) {
      EXPECT_TRUE(bytes == bytes_of(four.ping(request))) << what << ": 4 threads";
    }
    if (!what.ends_with("switched")) {
      EXPECT_TRUE(bytes == bytes_of(Engine(scene).ping(request))) << what << ": nothing before it";
    }
    EXPECT_TRUE(std::all_of(ping.pressure_upa.begin(), ping.pressure_upa.end(), [](float p) { return std::isfinite(p); }))
        << what;
  }
}

// Control: each part changes these bytes.
TEST(Everything, LacksSomethingWithoutAnyOneOfItsParts) {
  Engine engine(basin());
  for (const PingRequest& whole : {with_wide_beams(high()), with_wide_beams(low())}) {
    const std::string with_all = bytes_of(engine.ping(whole));
    for (const NamedSwitch& part : named_switches) {
      if (part.is_on == &Switches::doppler && whole.model->modes[0].waveform.shape != Waveform::Shape::lfm) continue;
      if (part.is_on == &Switches::defocus && whole.model->modes[0].beam_spacing != BeamSpacing::uniform_in_sine) continue;
      if (part.is_on == &Switches::interleave && whole.model->modes[0].interleaved_pings == 1) continue;
      PingRequest without = whole;
      without.switches.*part.is_on = false;
      EXPECT_TRUE(with_all != bytes_of(engine.ping(without))) << part.name;
    }
  }
}

TEST(Everything, SwitchedOffIsAsIfItsDataWereNotThere) {
  const std::shared_ptr<const Scene> whole = basin();
  const auto same = [&](bool Switches::*part, const std::function<void(Scene&)>& without,
                        const std::function<void(PingRequest&)>& change) {
    auto bare = std::make_shared<Scene>(*whole);
    without(*bare);
    Engine with_data(whole), without_data(bare);
    for (PingRequest off : {with_wide_beams(high()), with_wide_beams(low())}) {
      off.switches.*part = false;
      PingRequest on = off;
      on.switches.*part = true;
      change(on);
      EXPECT_TRUE(bytes_of(with_data.ping(off)) == bytes_of(without_data.ping(on)));
    }
  };
  const auto as_it_is = [](auto&) {};
  const auto receiver = [](auto&& set) {
    return [set](PingRequest& r) {
      auto model = std::make_shared<SonarModel>(*r.model);
      set(model->modes[0].receiver);
      r.model = std::move(model);
    };
  };
  same(
      &Switches::texture,
      [](Scene& s) {
        for (Material& m : s.materials) m.texture = {};
      },
      as_it_is);
  same(
      &Switches::grain,
      [](Scene& s) {
        for (Material& m : s.materials) m.grain = {};
      },
      as_it_is);
  same(
      &Switches::volume, [](Scene& s) { s.water_column = {}; }, as_it_is);
  same(
      &Switches::interference, [](Scene& s) { s.other_sonars.clear(); }, as_it_is);
  same(&Switches::leak, as_it_is, receiver([](ReceiverModel& law) { law.leak_upa = 0; }));
  same(&Switches::bandwidth, as_it_is, receiver([](ReceiverModel& law) { law.noise_width = 1; }));
  same(&Switches::uneven, as_it_is, receiver([](ReceiverModel& law) { law.profile = {}; }));
  same(&Switches::defocus, as_it_is, receiver([](ReceiverModel& law) { law.defocus = 0; }));
  same(&Switches::shared_noise, as_it_is,
       receiver([](ReceiverModel& law) { law.shared_noise = {}, law.leak_is_shared = false; }));
  same(&Switches::truncation, as_it_is, receiver([](ReceiverModel& law) { law.truncates = false; }));
  same(&Switches::crosstalk, as_it_is, receiver([](ReceiverModel& law) { law.crosstalk_db = -200; }));
}

TEST(Everything, MotionAndDopplerChangeNothingAtRest) {
  Engine engine(basin());
  for (const PingRequest& moving : {high(), low()}) {
    PingRequest rest = moving;
    rest.sonar_moves = {};
    PingRequest off = moving;
    off.switches.motion = off.switches.doppler = false;
    EXPECT_TRUE(bytes_of(engine.ping(off)) == bytes_of(engine.ping(rest)));
  }
}

}  // namespace
}  // namespace sonar::test
