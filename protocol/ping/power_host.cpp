// The host of an Omniscan and of an S500, which have the same port. To an S500 it sends the request for pings at once. To an
// Omniscan it first sends a question, the request for a message that only an S500 has. If no answer comes, it repeats the
// question, and sends the request for pings once.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <optional>
#include <utility>

#include "core/text/format.hpp"
#include "protocol/limits.hpp"
#include "protocol/ping/omniscan_messages.hpp"
#include "protocol/ping/ping_host.hpp"
#include "protocol/ping/products.hpp"
#include "protocol/ping/s500_messages.hpp"

namespace sonar::ping {
namespace {

using protocol::HostActions;
using protocol::HostPing;
using text::format;

Bytes omniscan_request(const protocol::SettingsOverride& wanted) {
  OsPingParams p{.length_mm = static_cast<std::uint32_t>(std::lround(1000 * wanted.range_m.value_or(usual_range_m))),
                 .enable = static_cast<std::uint8_t>(wanted.rate_hz == 0.0 ? 0 : 1)};
  p.period_ms = static_cast<std::uint32_t>(std::lround(wanted.rate_hz ? period_ms_of(wanted) : 100));
  if (wanted.gain_percent) p.gain = static_cast<std::int16_t>(std::lround(7 * *wanted.gain_percent / 100));
  return framed_message(Id::os_ping_params, 0, p);
}

/// Makes the request of an S500. If range or gain is not requested, the sonar chooses it.
Bytes s500_request(const protocol::SettingsOverride& wanted) {
  SetPingParams p{.length_mm = 0, .gain = -1, .period_ms = 100, .report = wanted.rate_hz == 0.0 ? Id{} : Id::s500_profile6};
  if (wanted.range_m) p.length_mm = static_cast<std::uint32_t>(std::lround(std::max(1000 * *wanted.range_m, 1.0)));
  if (wanted.gain_percent) p.gain = static_cast<std::int16_t>(std::lround(13 * *wanted.gain_percent / 100));
  if (wanted.rate_hz.value_or(0) > 0) p.period_ms = static_cast<std::int16_t>(std::lround(period_ms_of(wanted)));
  return framed_message(Id::s500_set_ping_params, 0, p);
}

struct Product {
  std::string_view title;
  Id request_id, ping_id;
  Bytes (*request)(const protocol::SettingsOverride&);
  const protocol::Vendor& (*device)();
  int most_gain;
};
constexpr Product omniscan_product{"an Omniscan", Id::os_ping_params, Id::os_mono_profile, omniscan_request, omniscan::vendor, 7};
constexpr Product s500_product{"an S500", Id::s500_set_ping_params, Id::s500_profile6, s500_request, s500::vendor, 13};

constexpr Id only_s500_has = Id::ping1d_range;           // an Omniscan refuses the request for this message
constexpr std::chrono::milliseconds answer_within{500};  // our choice

/// Makes a ping of `rows` powers, without the note, such as the distance.
HostPing ping_of(std::uint32_t number, std::uint32_t start_mm, double row_m, std::size_t rows, double hz,
                 std::string_view title) {
  const double start_m = 1e-3 * start_mm;
  HostPing found;
  found.facts = {number, 1, static_cast<unsigned>(rows), 16, row_m, start_m + static_cast<double>(rows) * row_m, hz, 0};
  found.picture = [title]() -> Result<PolarImage> {
    return failure(ErrorKind::usage,
                   "one ping of one beam makes no picture: sonarctl listen prints the profiles of " + std::string(title));
  };
  return found;
}

class PowerHost final : public PingHost {
 public:
  PowerHost(const Product& wanted, const Product& other, const protocol::Wanted& settings)
      : PingHost(wanted.title, settings.as_it_is ? std::nullopt : std::optional(wanted.request(settings.settings)),
                 settings.as_it_is ? protocol::SettingsOverride{} : settings.settings),
        product_(&wanted),
        other_(&other),
        settings_(settings.settings) {}
  HostActions on_open(std::span<const std::uint16_t>, Time now) override {
    if (!asks()) return {};
    if (product_ == &omniscan_product) return question(now);
    HostActions actions;
    request_pings(actions);
    return actions;
  }
  HostActions on_tick(Time now) override {
    if (!ask_at_ || now < *ask_at_) return {};
    HostActions actions = question(now);
    if (!has_requested_) request_pings(actions);
    return actions;
  }
  std::optional<Time> next_tick() const override { return ask_at_; }
  bool is_open() const override { return has_requested_ || !ask_at_; }
  /// Names both products, which share the port, until the sonar shows which of them it is.
  std::string about() const override {
    return shown_.empty() ? std::string(product_->title) + " or " + std::string(other_->title) : std::string(shown_);
  }

 private:
  HostActions question(Time now) {
    ask_at_ = now + answer_within;
    return {protocol::HostSend{0, request_for(only_s500_has)}};
  }
  void request_pings(HostActions& actions) {
    has_requested_ = true;
    const std::string why =
        protocol::rate_complaint(settings_, product_->title, product_->device().models().front()->max_rate_hz);
    if (why.empty())
      actions.emplace_back(protocol::HostSend{0, product_->request(settings_)});
    else
      actions.emplace_back(Error{ErrorKind::usage, why});
  }
  void switch_to_other(HostActions& actions) {
    ask_at_.reset();
    std::swap(product_, other_);
    has_switched_ = true;
    shown_ = product_->title;
    request_pings(actions);
  }
  /// Called when the sonar is found to be an Omniscan. Requests pings, unless the host has done so.
  void keep_product(HostActions& actions) {
    if (std::exchange(ask_at_, std::nullopt) && !has_requested_) request_pings(actions);
  }
  /// The answer to the question may come after the request for pings was sent. Pings may come before it, if another host has
  /// requested them.
  void on_frame(const Frame& frame, HostActions& actions) override {
    const Id id = frame.header.id;
    if (ask_at_ && (id == only_s500_has || id == s500_product.ping_id)) return switch_to_other(actions);
    if (id == omniscan_product.ping_id) keep_product(actions);
  }
  /// Called when the request was refused, perhaps because the sonar is the other product. The request of that product is sent
  /// once; a second refusal is an error. A recording has refusals of another host's requests, which are ignored.
  std::optional<std::string> on_nack(Id refused, std::string why, HostActions& actions) override {
    if (refused == only_s500_has) return keep_product(actions), std::nullopt;
    if (refused != product_->request_id && refused != other_->request_id) return why;
    if (!asks() || refused != product_->request_id) return std::nullopt;
    if (has_switched_) return refusal_.empty() ? why : refusal_ + "; as " + std::string(product_->title) + ": " + why;
    refusal_ = std::move(why);
    switch_to_other(actions);
    return std::nullopt;
  }
  std::optional<HostPing> ping_from(const Frame& frame, Time now) override {
    if (frame.header.id == Id::os_mono_profile) return read(frame, OsMonoProfile{}, now);
    return frame.header.id == Id::s500_profile6 ? read(frame, Profile6{}, now) : std::nullopt;
  }
  template <class Data>
  std::optional<HostPing> read(const Frame& frame, Data data, Time now) {
    const auto rest = read_front(frame, data);
    if (!rest) return std::nullopt;
    Line powers = powers_in(*rest, data.results, data.lowest_db, data.highest_db);
    const double row_m = 1e-3 * data.length_mm / std::max<double>(data.results, 1);
    shown_ = title_of(data);
    HostPing found = ping_of(data.ping, data.start_mm, row_m, powers.size(), hz_of(data), title_of(data));
    compare_gain(data.gain, most_gain_of(data), found);
    if (powers.empty()) return found;
    found.facts.note = note_of(data, powers, row_m);
    waterfall_.add(std::move(powers), 1e-3 * data.start_mm, row_m, now, found);
    return found;
  }

  static int most_gain_of(const OsMonoProfile&) { return omniscan_product.most_gain; }
  static int most_gain_of(const Profile6&) { return s500_product.most_gain; }
  static double hz_of(const OsMonoProfile& data) { return data.hz; }
  static double hz_of(const Profile6& data) { return (data.start_hz + data.end_hz) / 2.0; }
  static std::string_view title_of(const OsMonoProfile&) { return omniscan_product.title; }
  static std::string_view title_of(const Profile6&) { return s500_product.title; }
  static std::string note_of(const OsMonoProfile& data, const Line& powers, double row_m) {
    const auto top = std::max_element(powers.begin(), powers.end());
    return format("strongest %.1f dB at %.2f m", static_cast<double>(*top),
                  1e-3 * data.start_mm + (static_cast<double>(top - powers.begin()) + 0.5) * row_m);
  }
  static std::string note_of(const Profile6& data, const Line&, double) {
    return format("distance %.3f m, confidence %d %%", static_cast<double>(data.depth_m), data.confidence);
  }

  const Product* product_;  // the product whose request for pings was sent last, or will be sent first
  const Product* other_;
  std::string refusal_;     // why the request of the first product was refused
  std::string_view shown_;  // the product that a ping, an answer or a refusal has shown; empty: not known
  protocol::SettingsOverride settings_;
  std::optional<Time> ask_at_;  // time at which the question is repeated; nullopt: never
  bool has_requested_ = false, has_switched_ = false;
  protocol::Waterfall waterfall_;
};

/// Makes the host, which compares the rate with the limit of the product that answers.
Result<std::unique_ptr<protocol::Host>> host_of(const Product& product, const Product& other, const protocol::Wanted& wanted) {
  if (auto fits = check_wanted(product.title, std::nullopt, {"range", "rate", "gain", "mode"}, wanted); !fits)
    return tl::unexpected(fits.error());
  return std::make_unique<PowerHost>(product, other, wanted);
}

}  // namespace

Result<std::unique_ptr<protocol::Host>> omniscan::make_host(const protocol::Wanted& wanted) {
  return host_of(omniscan_product, s500_product, wanted);
}
Result<std::unique_ptr<protocol::Host>> s500::make_host(const protocol::Wanted& wanted) {
  return host_of(s500_product, omniscan_product, wanted);
}

}  // namespace sonar::ping
