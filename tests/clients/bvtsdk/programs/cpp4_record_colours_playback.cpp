// A program for 4.x with C++ classes in globals. It records pings, maps colours with thresholds, gamma and auto mode, and plays
// the recording. usage: cpp4_record_colours_playback ADDRESS COLORMAPS RECORDING
#include <cstring>
#include <vector>

#include "tests/clients/bvtsdk/programs/expect.h"

static BVTSDK::Sonar sonar, recording, player;  // destroyed in an unspecified order
static BVTSDK::Head head = NULL, recording_head = NULL, played_head = NULL;
static BVTSDK::ColorMapper mapper;

static void expect_code(int code, void (*call)()) {
  try {
    call();
  } catch (const BVTSDK::SdkException& e) {
    EXPECT(e.ReturnCode() == code && !e.ErrorName().empty() && !e.ErrorMessage().empty());
    return;
  }
  EXPECT(!"an exception");
}

static std::vector<unsigned short> pixels_of(const BVTSDK::MagImage& image) {
  std::vector<unsigned short> out(static_cast<std::size_t>(image.GetHeight()) * static_cast<std::size_t>(image.GetWidth()));
  image.CopyBits(out.data(), static_cast<unsigned int>(out.size()));
  return out;
}

static void check_mapper(const BVTSDK::MagImage& image, const std::string& colour_maps) {
  expect_code(BVT_PV_LOAD_COLORMAP, [] { mapper.Load("/dev/null"); });
  mapper.Load(colour_maps + "/bone.cmap");
  mapper.SetThresholds(30000, 100);
  EXPECT(mapper.GetTopThreshold() == 30000 && mapper.GetBottomThreshold() == 100);
  mapper.SetGamma(0.5f);
  EXPECT_NEAR(mapper.GetGamma(), 0.5, 1e-6);
  const BVTSDK::ColorImage colours = mapper.MapImage(image);
  EXPECT(colours.GetBits() != nullptr && colours.GetHeight() == image.GetHeight());
  EXPECT(colours.GetOriginRow() == image.GetOriginRow() && colours.GetOriginCol() == image.GetOriginCol());
  EXPECT_NEAR(colours.GetRangeResolution(), image.GetRangeResolution(), 1e-9);
  mapper.SetAutoMode(true);
  EXPECT(mapper.GetAutoMode());
  expect_code(BVT_BAD_PARAMETER, [] { mapper.SetThresholds(20000, 0); });
  mapper.MapImage(image);
  EXPECT(mapper.GetTopThreshold() > mapper.GetBottomThreshold());
}

static void record(BVTSDK::ImageGenerator& generator, int pings, std::vector<double>& stamps, std::vector<unsigned short>& last) {
  for (int i = 0; i < pings; ++i) {
    const BVTSDK::Ping ping = head.GetPing(-1);
    stamps.push_back(ping.GetTimestamp());
    EXPECT(ping.GetTimeZoneOffset() == 0 && ping.HasNavData());
    recording_head.PutPing(ping);
    last = pixels_of(generator.GetImageRTheta(ping));
  }
  EXPECT(recording.IsFile() && recording.GetTimeIndexedPingCount() == pings && recording_head.GetPingCount() == pings);
  EXPECT(recording.GetFileSize() > 100);
}

int main(int, char** arguments) {
  try {
    sonar.Open("NET", arguments[1]);
    EXPECT(sonar.GetTemperature() > -5 && sonar.GetTemperature() < 60);
    head = sonar.GetHead(0);
    head.SetRange(1, 9);
    head.SetSoundSpeed(1490);
    recording.CreateFile(arguments[3], sonar, "");
    recording_head = recording.GetHead(0);
    expect_code(BVT_READONLY_FILE, [] { head.PutPing(head.GetPing(-1)); });

    BVTSDK::ImageGenerator generator;
    generator.SetHead(head);
    const int pings = 3;
    std::vector<double> stamps;
    std::vector<unsigned short> last;
    record(generator, pings, stamps, last);
    check_mapper(generator.GetImageXY(head.GetPing(-1)), arguments[2]);
    recording = BVTSDK::Sonar();  // closes the file; its head is still held
    expect_code(BVT_FILE_NOTOPEN, [] { recording_head.PutPing(head.GetPing(-1)); });

    player.Open("FILE", arguments[3]);
    EXPECT(player.IsFile() && !player.IsConnected() && player.GetSonarModelName() == sonar.GetSonarModelName());
    played_head = player.GetHead(0);
    EXPECT(played_head.GetPingCount() == pings);
    std::vector<unsigned short> again;
    for (int i = 0; i < pings; ++i) {
      const BVTSDK::Ping ping = played_head.GetPing(-1);
      EXPECT(ping.GetTimestamp() == stamps[static_cast<std::size_t>(i)]);
      again = pixels_of(generator.GetImageRTheta(ping));
    }
    EXPECT(again == last);
    expect_code(BVT_PING_NUM_TOO_LARGE, [] { played_head.GetPing(-1); });
    EXPECT(played_head.GetPing(1).GetTimestamp() == stamps[1]);

    generator.SetSoundSpeedOverride(745);  // half of the ping's: every range is halved
    const BVTSDK::RangeProfile profile = generator.GetRangeProfile(played_head.GetPing(0));
    EXPECT(profile.GetValidCount() > 0);
    for (int i = 0; i < profile.GetCount(); ++i)
      if (profile.GetValidValue(i)) {
        EXPECT(profile.GetRangeValue(i) < 4.6);
        EXPECT_NEAR(hypot(profile.Get_X_Value(i), profile.Get_Y_Value(i)), profile.GetRangeValue(i), 0.01);
      }
    return 0;
  } catch (const BVTSDK::SdkException& e) {
    fprintf(stderr, "%d %s: %s\n", e.ReturnCode(), e.ErrorName().c_str(), e.ErrorMessage().c_str());
    return 1;
  }
}
