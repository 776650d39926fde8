// Command line of `sonarctl scene check|info|import`; clients/scene_tools implements them.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>

#include "clients/scene_tools/import_scene.hpp"
#include "clients/sonarctl/command_line.hpp"
#include "core/text/arguments.hpp"
#include "core/text/format.hpp"

namespace sonar::clients {
namespace {

using scene_tools::ImportOptions;

void print_remarks(const scene_tools::Remarks& remarks) {
  for (const std::string& warning : remarks.warnings) std::printf("warning: %s\n", warning.c_str());
  for (const std::string& note : remarks.notes) std::printf("note: %s\n", note.c_str());
}

Result<void> check(const std::string& file, bool strict) {
  const auto scene = scene_tools::describe_scene(file);
  if (!scene) return tl::unexpected(scene.error());
  std::printf("%s: ok: %s\n", file.c_str(), summary_of(*scene).c_str());
  const scene_tools::Remarks remarks = remarks_on(*scene);
  print_remarks(remarks);
  if (!strict || remarks.warnings.empty()) return {};
  return failure(ErrorKind::bad_data, file + ": " + text::counted(remarks.warnings.size(), "warning") + ", and --strict");
}

Result<void> info(const std::string& file, bool json) {
  const auto scene = scene_tools::describe_scene(file);
  if (!scene) return tl::unexpected(scene.error());
  std::fputs((json ? json_of(*scene) : table_of(*scene)).c_str(), stdout);
  return {};
}

Result<void> import_one(const ImportOptions& options) {
  const auto done = import_scene(options);
  if (!done) return tl::unexpected(done.error());
  std::printf("%s: %s of %s", options.out.c_str(), text::counted(done->shapes, "shape").c_str(),
              text::counted(done->models, "model").c_str());
  if (done->converted_meshes > 0) std::printf(", %zu converted meshes written beside it", done->converted_meshes);
  std::printf("\n");
  for (const std::string& what : done->left_out) std::printf("left out: %s\n", what.c_str());
  return options.check ? check(options.out.string(), false) : Result<void>{};
}

struct SceneArguments {
  enum class What { check, info, import } what = What::check;
  std::string file, out;
  bool strict = false, json = false, visual = false, no_check = false;
  std::vector<std::string> folders;
  std::vector<double> offset{0, 0, 0};
  ImportOptions import;
};

void add_check(CLI::App& scene, SceneArguments& a) {
  CLI::App& command = *scene.add_subcommand("check", "load a scene file as the daemon does, and report probable mistakes");
  command.add_option("FILE", a.file, "a scene, or demo.yaml")->required();
  command.add_flag("--strict", a.strict, "warnings are errors (exit code 65)");
  command.callback([&a] { a.what = SceneArguments::What::check; });
}

void add_info(CLI::App& scene, SceneArguments& a) {
  CLI::App& command = *scene.add_subcommand("info", "print tables of its objects, materials, sizes and places");
  command.add_option("FILE", a.file, "a scene, or demo.yaml")->required();
  command.add_flag("--json", a.json, "for programs");
  command.callback([&a] { a.what = SceneArguments::What::info; });
}

void add_import(CLI::App& scene, SceneArguments& a) {
  CLI::App& command = *scene.add_subcommand("import", "make a scene file of a Gazebo world or model (SDF), or of a URDF");
  command.footer(
      "examples:\n"
      "  sonarctl scene import harbour.world --out harbour.yaml --model-path ~/models\n"
      "  sonarctl scene import rov.urdf --out rov.yaml --moving rov --material aluminium\n"
      "  sonarctl scene import tank.sdf --out tank.yaml --collision --material walls=concrete --offset 0,0,-5\n"
      "models are searched in --model-path, GZ_SIM_RESOURCE_PATH, GAZEBO_MODEL_PATH, IGN_GAZEBO_RESOURCE_PATH, "
      "ROS_PACKAGE_PATH,\n"
      "AMENT_PREFIX_PATH, beside the file and, for addresses of Fuel, in Gazebo's caches (~/.gz/fuel, ~/.ignition/fuel)\n"
      "parts that a scene cannot hold are listed, and named in the comments of the written file");
  ImportOptions& o = a.import;
  command.add_option("FILE", a.file, "an .sdf, .world or .urdf")->required();
  command.add_option("--out", a.out, "the scene file to write")->required();
  command.add_option("--model-path", a.folders, "folder with models or packages (repeatable)")->allow_extra_args(false);
  CLI::Option* collision = command.add_flag("--collision", o.read.collisions, "import collision shapes");
  command.add_flag("--visual", a.visual, "import visual shapes (the default)")->excludes(collision);
  command.add_option("--material", o.materials, "NAME for everything, or MODEL=NAME (repeatable)")->allow_extra_args(false);
  command.add_option("--moving", o.moving, "MODEL accepts poses (repeatable)")->allow_extra_args(false);
  command.add_option("--offset", a.offset, "X,Y,Z added to every position, m; z = 0 is the water's surface")
      ->delimiter(',')
      ->expected(3)
      ->check(text::number());
  command.add_flag("--skip-missing", o.read.skip_missing, "omit models and meshes that are not found");
  command.add_flag("--no-check", a.no_check, "do not test meshes, and do not load the written scene");
  command.add_flag("--overwrite", o.overwrite, "replace the scene file");
  command.callback([&a] { a.what = SceneArguments::What::import; });
}

}  // namespace

Run add_scene(CLI::App& app) {
  CLI::App& scene = *app.add_subcommand("scene", "check and describe scene files; import them from Gazebo and URDF");
  scene.require_subcommand(1);
  scene.footer(
      "examples:\n"
      "  sonarctl scene check harbour.yaml\n"
      "  sonarctl scene info demo.yaml\n"
      "  sonarctl scene import harbour.world --out harbour.yaml");
  const auto arguments = std::make_shared<SceneArguments>();
  add_check(scene, *arguments);
  add_info(scene, *arguments);
  add_import(scene, *arguments);
  return [arguments]() -> Result<void> {
    SceneArguments& a = *arguments;
    if (a.what == SceneArguments::What::check) return check(a.file, a.strict);
    if (a.what == SceneArguments::What::info) return info(a.file, a.json);
    a.import.file = a.file;
    a.import.out = a.out;
    a.import.model_folders.assign(a.folders.begin(), a.folders.end());
    a.import.offset_m = {a.offset[0], a.offset[1], a.offset[2]};
    a.import.check = !a.no_check;
    return import_one(a.import);
  };
}

}  // namespace sonar::clients
