#include "clients/bvtsdk/core/description.hpp"

namespace sonar::bvt {

void copy_settings(HeadDescription& to, const HeadDescription& from) {
  to.start_m = from.start_m;
  to.stop_m = from.stop_m;
  to.sound_speed_mps = from.sound_speed_mps;
  to.gain_db = from.gain_db;
  to.tvg_db_per_m = from.tvg_db_per_m;
  to.fluid = from.fluid;
}

const HeadDescription* SonarDescription::head(int number) const {
  for (const HeadDescription& h : heads)
    if (h.id == number) return &h;
  const bool alias = heads.size() == 1 && !strict_heads() && (number == 0 || number == 1);
  return alias ? &heads.front() : nullptr;
}

std::optional<SonarDescription> decode_description(BytesView payload) {
  Reader reader(payload);
  SonarDescription sonar;
  sonar.version = reader.read<std::uint16_t>();
  sonar.model = reader.text();
  sonar.name = reader.text();
  sonar.serial = reader.text();
  sonar.firmware = reader.text();
  sonar.temperature_c = reader.read<float>();
  sonar.capabilities = reader.read<std::uint32_t>();
  const int heads = reader.read<std::uint8_t>();
  for (int i = 0; i < heads && reader.ok(); ++i) {
    HeadDescription h;
    h.id = reader.read<std::int32_t>();
    h.name = reader.text();
    for (float* value : {&h.min_range_m, &h.max_range_m, &h.start_m, &h.stop_m}) *value = reader.read<float>();
    h.centre_hz = reader.read<std::int32_t>();
    h.fov_min_deg = reader.read<float>();
    h.fov_max_deg = reader.read<float>();
    h.beams = reader.read<std::uint16_t>();
    h.sound_speed_mps = reader.read<std::int32_t>();
    h.gain_db = reader.read<float>();
    h.tvg_db_per_m = reader.read<float>();
    h.fluid = reader.read<std::int32_t>();
    sonar.heads.push_back(std::move(h));
  }
  if (!reader.ok()) return std::nullopt;
  return sonar;
}

Bytes encode_description(const SonarDescription& sonar) {
  Bytes out;
  put(out, sonar.version);
  for (const std::string* text : {&sonar.model, &sonar.name, &sonar.serial, &sonar.firmware}) put_text(out, *text);
  put(out, sonar.temperature_c);
  put(out, sonar.capabilities);
  const std::size_t heads = sonar.heads.size() < 255 ? sonar.heads.size() : 255;
  put(out, static_cast<std::uint8_t>(heads));
  for (std::size_t i = 0; i < heads; ++i) {
    const HeadDescription& h = sonar.heads[i];
    put(out, h.id);
    put_text(out, h.name);
    for (const float value : {h.min_range_m, h.max_range_m, h.start_m, h.stop_m}) put(out, value);
    put(out, h.centre_hz);
    put(out, h.fov_min_deg);
    put(out, h.fov_max_deg);
    put(out, h.beams);
    put(out, h.sound_speed_mps);
    put(out, h.gain_db);
    put(out, h.tvg_db_per_m);
    put(out, h.fluid);
  }
  return out;
}

}  // namespace sonar::bvt
