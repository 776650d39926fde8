#include "daemon/commands/options/commands.hpp"

#include <cstdio>

#include "core/text/format.hpp"
#include "daemon/commands/run/prepare_run.hpp"
#include "daemon/config/products.hpp"
#include "daemon/emulator/world/plausibility.hpp"

namespace sonar {

Result<void> run_check(const CheckCommand& command) {
  RunCommand run;
  run.config = command.config;
  bool json = false;
  const auto prepared = prepare_run(run, json, [](const Config&) { return LoadProgress::to_console; });
  if (!prepared) return tl::make_unexpected(prepared.error());
  const Config& config = prepared->found.config;
  const Scene& scene = *prepared->scene;
  if (!prepared->token_warning.empty()) std::fprintf(stderr, "sonard: %s\n", prepared->token_warning.c_str());
  std::printf("%s: ok, %s; scene %s: ok, %zu triangles\n", command.config.c_str(),
              text::counted(config.sonars.size(), "sonar").c_str(), config.scene.name().c_str(), scene.triangle_count());
  for (const SonarConfig& sonar : config.sonars) {
    std::printf("sonar %s, %s\n", sonar.name.c_str(), sonar.profile.model->name.c_str());
    for (const protocol::DriverAddress& a :
         protocol::driver_addresses(*sonar.profile.vendor, address_for_drivers(sonar), sonar.status_to))
      std::printf("  %s\n", protocol::line_of(a.protocol, text_of(a.at), a.carries, a.sonar_speaks_first).c_str());
  }
  for (const std::string& note : scene.notes) std::printf("note: %s\n", note.c_str());
  for (const std::string& note : notes_of_config(config)) std::printf("%s\n", note.c_str());
  for (const VehicleConfig& v : config.vehicles)
    if (v.plan) std::printf("vehicle %s follows %s\n", v.name.c_str(), v.plan.about.c_str());
  for (const ObjectConfig& o : config.objects)
    if (o.plan) std::printf("object %s follows %s\n", o.name.c_str(), o.plan.about.c_str());
  for (const Note& note : notes_on(config, scene, surroundings_of(config, scene)))
    std::printf("note: %s\n", text_of(note).c_str());
  return {};
}

}  // namespace sonar
