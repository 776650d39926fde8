#include <cmath>

#include "core/text/format.hpp"
#include "protocol/ping/ping1d.hpp"
#include "protocol/ping/ping_host.hpp"
#include "protocol/ping/products.hpp"

namespace sonar::ping::ping1d {
namespace {

using protocol::HostPing;

template <class T>
void add_value(Bytes& to, Id id, T value) {
  Bytes payload;
  wire::Writer write(payload);
  write("value", value);
  const Bytes frame = framed(id, 0, payload);
  to.insert(to.end(), frame.begin(), frame.end());
}

/// Makes the requests of this host: one message per setting, then a stream of profiles. Without range and gain the mode is
/// automatic, and the sonar chooses both.
Bytes request(const protocol::SettingsOverride& wanted) {
  Bytes all;
  const bool manual = wanted.range_m || wanted.gain_percent;
  add_value<std::uint8_t>(all, Id::ping1d_set_mode_auto, manual ? 0 : 1);
  if (manual) {
    const double length_mm = std::max(1000 * wanted.range_m.value_or(usual_range_m), 0.0);
    const Bytes range = framed_message(Id::ping1d_set_range, 0, ScanRange{0, static_cast<std::uint32_t>(std::lround(length_mm))});
    all.insert(all.end(), range.begin(), range.end());
    if (wanted.gain_percent)
      add_value(all, Id::ping1d_set_gain, static_cast<std::uint8_t>(std::lround(most_gain * *wanted.gain_percent / 100)));
  }
  const double period_ms = wanted.rate_hz ? period_ms_of(wanted) : 100;
  if (period_ms > 0) add_value(all, Id::ping1d_set_interval, static_cast<std::uint16_t>(std::lround(period_ms)));
  const bool enable = wanted.rate_hz != 0.0;
  add_value<std::uint8_t>(all, Id::ping1d_set_enable, enable ? 1 : 0);
  if (enable) add_value(all, Id::ping1d_continuous_start, Id::ping1d_profile);
  return all;
}

class Ping1DHost final : public PingHost {
 public:
  using PingHost::PingHost;

 private:
  std::optional<HostPing> ping_from(const Frame& frame, Time now) override {
    Profile data;
    const auto rest = frame.header.id == Id::ping1d_profile ? read_front(frame, data) : std::nullopt;
    if (!rest) return std::nullopt;
    const BytesView codes = rest->first(std::min<std::size_t>(rest->size(), data.count));
    const double start_m = 1e-3 * data.start_mm, row_m = 1e-3 * data.length_mm / std::max<double>(data.count, 1);
    const auto rows = static_cast<unsigned>(codes.size());
    HostPing found;
    found.facts = {data.ping,
                   1,
                   rows,
                   8,
                   row_m,
                   start_m + rows * row_m,
                   static_cast<double>(vendor().models().front()->modes.front().centre_hz),
                   0};
    found.facts.note = text::format("distance %.3f m, confidence %d %%", 1e-3 * data.distance_mm, data.confidence);
    compare_gain(static_cast<int>(data.gain), most_gain, found);
    found.picture = []() -> Result<PolarImage> {
      return failure(ErrorKind::usage, "one ping of one beam makes no picture: sonarctl listen prints the distances of a Ping1D");
    };
    if (codes.empty()) return found;
    Line line;
    for (const std::byte code : codes)
      line.push_back(20 * std::log10(std::max(static_cast<float>(std::to_integer<int>(code)), 0.1f) / 255));
    waterfall_.add(std::move(line), start_m, row_m, now, found);
    return found;
  }

  static constexpr float step_db = 48;  // from sample 1, which is nearly noise, to 255
  Waterfall waterfall_{step_db};
};

}  // namespace

Result<std::unique_ptr<protocol::Host>> make_host(const protocol::Wanted& wanted) {
  return host_of<Ping1DHost>("a Ping1D", vendor(), request, {"range", "rate", "gain", "mode"}, wanted);
}

}  // namespace sonar::ping::ping1d
