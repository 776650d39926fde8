#include "clients/scene_tools/sdf_models.hpp"

#include <algorithm>

#include "clients/scene_tools/read_parts.hpp"
#include "clients/scene_tools/resource_paths.hpp"
#include "core/base/letters.hpp"
#include "core/text/nearest.hpp"

namespace sonar::scene_tools {
namespace {

constexpr int most_includes_deep = 16, most_frames_deep = 256;
constexpr std::size_t most_models = 4096, most_elements = 5'000'000;

bool is_true(std::string_view text) { return text == "true" || text == "1"; }

/// Returns the kind of a well-known model that has no echo, which is omitted even if it is found; empty for all others.
std::string known_kind_without_echo(std::string_view name) {
  if (name == "sun") return "light";
  if (name == "sky" || name == "skybox") return "sky";
  if (name == "north east down frame") return "coordinate frame";
  if (name == "waves" || name == "coast water" || name == "ocean waves" || name == "ocean surface") return "drawn water surface";
  return {};
}

/// Returns the kind of a model that was not found and probably has no echo; empty for all others.
std::string probable_kind_without_echo(std::string_view name) {
  if (name == "axes" || name.ends_with(" frame")) return "coordinate frame";
  return name == "ocean" ? "drawn water surface" : "";
}

std::string text_or(std::string_view text, const char* otherwise) { return std::string(text.empty() ? otherwise : text); }

}  // namespace

SdfPose read_sdf_pose(const Element& element, Findings& findings) {
  SdfPose out;
  out.relative_to = element.attribute("relative_to");
  if (out.relative_to.empty()) out.relative_to = element.attribute("frame");  // before SDF 1.7
  if (element.text().empty()) return out;
  const bool quaternion = element.attribute("rotation_format") == "quat_xyzw";
  const auto v = read_numbers(element.text(), quaternion ? 7 : 6, element.place(), "pose", findings);
  out.pose.position_m = {v[0], v[1], v[2]};
  if (!quaternion) {
    const double unit = is_true(element.attribute("degrees")) ? rad_from_deg(1) : 1;
    out.pose.orientation = quat_from_rpy({unit * v[3], unit * v[4], unit * v[5]});
    return out;
  }
  const Quatd q{v[6], v[3], v[4], v[5]};
  if (norm_squared(q) > 1e-12)
    out.pose.orientation = normalized(q);
  else
    findings.fail(element.place(), "pose: the quaternion is zero");
  return out;
}

std::unique_ptr<SdfModel> SdfTree::build(const Element& world) {
  auto root = std::make_unique<SdfModel>();
  root->element = world;
  root->is_world = true;
  elements_ = world.file()->elements;
  fill(*root, 0);
  report_missing();
  return root;
}

/// Reports each missing model once, with the command that fetches it.
void SdfTree::report_missing() {
  if (missing_.empty()) return;
  std::string list;
  for (const Missing& m : missing_) {
    const std::string uri = plain(m.uri, 200);
    const std::string fetch = fetch_command(m.uri);
    const std::string times = m.includes > 1 ? " (" + std::to_string(m.includes) + " includes)" : "";
    if (options_.skip_missing) findings_.leave_out_missing(m.at, "include of " + uri, fetch, m.includes);
    list += (list.empty() ? " " : "; ") + (fetch.empty() ? uri : fetch) + times;
  }
  if (options_.skip_missing) return;
  findings_.fail(missing_.front().at,
                 "include: models were not found; fetch them, give the folder that holds them with --model-path, or continue "
                 "without them with --skip-missing:" +
                     list);
}

std::vector<std::shared_ptr<const XmlFile>> SdfTree::included_files() const {
  std::vector<std::shared_ptr<const XmlFile>> files;
  for (const auto& [path, file] : files_) files.push_back(file);
  return files;
}

void SdfTree::fill(SdfModel& model, int include_depth) {
  for (const Element& element : model.element.children()) {
    if (findings_.failed()) return;
    const std::string_view kind = element.name();
    if (kind == "link")
      add_frame(model, element, "");
    else if (kind == "joint")
      add_frame(model, element, std::string(element.child("child").text()));
    else if (kind == "frame")
      add_frame(model, element, std::string(element.attribute("attached_to")));
    else if (kind == "model")
      add_model(model, element, {}, include_depth);
    else if (kind == "include")
      add_include(model, element, include_depth);
  }
}

void SdfTree::add_frame(SdfModel& model, const Element& element, std::string base) {
  const std::string name(element.attribute("name"));
  const bool is_link = element.name() == "link";
  if (is_link && name.empty()) return findings_.fail(element.place(), "a link without a name");
  SdfFrame frame;
  frame.element = element;
  frame.pose = element.child("pose");
  frame.base = std::move(base);
  const auto [place, is_new] = model.frames.try_emplace(name, frame);
  if (is_new || !is_link) return;
  if (place->second.element.name() == "link")
    return findings_.fail(element.place(), called(element) + ": the name is used twice");
  place->second = std::move(frame);  // replaces the frame of a joint with the same name
}

void SdfTree::add_model(SdfModel& parent, const Element& element, const Element& include, int include_depth) {
  if (++models_ > most_models) return findings_.fail(element.place(), "more than 4096 models, counting every include");
  auto model = std::make_unique<SdfModel>();
  const auto either = [&](const char* key) { return include.child(key) ? include.child(key) : element.child(key); };
  const std::string_view renamed = include.child("name").text();
  model->name = renamed.empty() ? text_or(element.attribute("name"), "model") : std::string(renamed);
  model->path = (parent.path.empty() ? "" : parent.path + "/") + model->name;
  if (model->path.size() > 4096) return findings_.fail(element.place(), "names of nested models come to more than 4096 letters");
  model->element = element;
  model->parent = &parent;
  model->is_static = is_true(either("static").text()) || parent.is_static;
  model->merged = is_true(include.attribute("merge"));
  model->source = include ? model_name(include.child("uri").text()) : parent.source;
  const std::string_view placed = include.child("placement_frame").text();
  model->placement_frame = placed.empty() ? element.attribute("placement_frame") : placed;

  model->placing.element = include ? include : element;
  model->placing.pose = include.child("pose") ? include.child("pose") : element.child("pose");
  SdfFrame frame;
  frame.element = element;
  frame.nested = model.get();
  parent.frames.try_emplace(model->name, std::move(frame));
  SdfModel& here = *model;
  parent.nested.push_back(std::move(model));
  fill(here, include_depth);
}

std::shared_ptr<const XmlFile> SdfTree::read(const std::filesystem::path& path, const Element& include) {
  if (const auto known = files_.find(path); known != files_.end()) return known->second;
  const std::string folder = path.parent_path().filename().string();
  const std::string name = (folder.empty() ? std::string() : folder + "/") + path.filename().string();
  const Result<std::string> text = library_.read(path);
  auto file = text ? parse_xml(*text, path, name) : tl::make_unexpected(text.error());
  if (!file) {
    findings_.fail(include.place(), std::string("include: ") + file.error().text);
    return nullptr;
  }
  return files_[path] = *file;
}

void SdfTree::add_include(SdfModel& parent, const Element& include, int include_depth) {
  const std::string uri(include.child("uri").text());
  const std::string shown = plain(uri, 200);
  if (uri.empty()) return findings_.fail(include.place(), "include: has no <uri>");
  if (include_depth >= most_includes_deep)
    return findings_.fail(include.place(), std::string("include: ") + shown +
                                               " is more than 16 includes deep; check that it does not include itself");
  const std::string name = model_name(uri);
  const auto leave_out_kind = [&](const std::string& kind) {
    findings_.leave_out_of_no_echo(kind, kind == "light" ? "" : uri.substr(uri.find_last_of('/') + 1));
  };
  if (const std::string kind = known_kind_without_echo(name); !kind.empty()) return leave_out_kind(kind);
  const std::filesystem::path path = library_.find(uri, include.file()->path);
  if (path.empty()) {
    if (const std::string kind = probable_kind_without_echo(name); !kind.empty()) return leave_out_kind(kind);
    const auto known = std::find_if(missing_.begin(), missing_.end(), [&](const Missing& m) { return same_letters(m.uri, uri); });
    if (known != missing_.end())
      ++known->includes;
    else
      missing_.push_back({uri, include.place(), 1});
    return;
  }
  const auto file = read(path, include);
  if (!file) return;
  elements_ += file->elements;
  if (elements_ > most_elements) return findings_.fail(include.place(), "include: more than 5 million elements altogether");
  const Element root = file->root();
  if (root.name() != "sdf")
    return findings_.fail(root.place(), std::string("an included file must begin with <sdf>, not <") + plain(root.name()) + ">" +
                                            (root.name() == "robot" ? "; import a URDF by itself" : ""));
  if (const Element model = root.child("model")) return add_model(parent, model, include, include_depth + 1);
  if (root.child("light")) return findings_.leave_out_of_no_echo("light");
  findings_.leave_out(include.place(), std::string("include of ") + shown + ": holds no model");
}

namespace {

/// Computes the pose of a frame once. If the same frame is requested meanwhile, poses refer to each other in a circle.
template <class Place_it>
Pose once(SdfFrame& frame, const Place& asked_by, Findings& findings, int depth, const Place_it& place_it) {
  if (frame.in_model) return *frame.in_model;
  if (frame.being_asked || depth > most_frames_deep) {
    findings.fail(asked_by,
                  called(frame.element) + " cannot be placed: poses refer to each other in a circle, or more than 256 deep");
    return {};
  }
  frame.being_asked = true;
  const Pose pose = place_it();
  frame.being_asked = false;
  frame.in_model = pose;
  return pose;
}

Pose frame_by_its_pose(SdfModel& model, SdfFrame& frame, const Place& asked_by, Findings& findings, int depth) {
  return once(frame, asked_by, findings, depth, [&] {
    const SdfPose given = read_sdf_pose(frame.pose, findings);
    const Place at = frame.pose ? frame.pose.place() : frame.element.place();
    const std::string& base = given.relative_to.empty() ? frame.base : given.relative_to;
    return compose(frame_in_model(model, base, at, findings, depth + 1), given.pose);
  });
}

std::string nearest_frame(const SdfModel& model, const std::string& name) {
  std::vector<std::string> known;
  for (const auto& [other, unused] : model.frames)
    if (known.size() < 200) known.push_back(plain(other));
  const std::vector<std::string_view> views(known.begin(), known.end());
  return text::suggestion(name, views, "there are");
}

/// Returns the model that has a frame of that name: this one, or one that was merged into it, perhaps through others. Returns
/// null if none has it.
SdfModel* holder_of(SdfModel& model, const std::string& name) {
  if (model.frames.contains(name)) return &model;
  const auto found = std::find_if(model.nested.begin(), model.nested.end(),
                                  [&](const auto& nested) { return nested->merged && holder_of(*nested, name) != nullptr; });
  return found == model.nested.end() ? nullptr : found->get();
}

}  // namespace

Pose model_in_parent(SdfModel& nested, const Place& asked_by, Findings& findings, int depth) {
  SdfFrame& frame = nested.placing;
  return once(frame, asked_by, findings, depth, [&] {
    const SdfPose given = read_sdf_pose(frame.pose, findings);
    const Place at = frame.pose ? frame.pose.place() : frame.element.place();
    // A pose that an included file gives to itself cannot refer to frames of the including file.
    const bool foreign = frame.pose.file() != frame.element.file();
    const Pose base = frame_in_model(*nested.parent, foreign ? std::string() : given.relative_to, at, findings, depth + 1);
    const Pose placed = compose(base, given.pose);
    if (nested.placement_frame.empty()) return placed;
    return compose(placed, inverse(frame_in_model(nested, nested.placement_frame, at, findings, depth + 1)));
  });
}

Pose frame_in_model(SdfModel& model, const std::string& name, const Place& asked_by, Findings& findings, int depth) {
  if (name.empty() || name == "__model__" || (model.is_world && name == "world") || findings.failed()) return {};
  std::size_t colons = std::string::npos;
  SdfModel* holder = holder_of(model, name);  // old files have links called crane::hook
  if (holder == nullptr) {
    colons = name.find("::");
    holder = holder_of(model, name.substr(0, colons));
  }
  if (holder != nullptr && holder != &model)
    return compose(model_in_parent(*holder, asked_by, findings, depth + 1),
                   frame_in_model(*holder, name, asked_by, findings, depth + 1));
  SdfFrame* frame = holder == nullptr ? nullptr : &model.frames.find(name.substr(0, colons))->second;
  if (frame == nullptr || (colons != std::string::npos && frame->nested == nullptr)) {
    findings.fail(asked_by, std::string("no frame \"") + plain(name, 200) + "\" in " +
                                (model.is_world ? "the world" : std::string("model \"") + plain(model.name) + "\"") +
                                nearest_frame(model, plain(name)));
    return {};
  }
  const Pose pose = frame->nested ? model_in_parent(*frame->nested, asked_by, findings, depth + 1)
                                  : frame_by_its_pose(model, *frame, asked_by, findings, depth + 1);
  if (colons == std::string::npos) return pose;
  return compose(pose, frame_in_model(*frame->nested, name.substr(colons + 2), asked_by, findings, depth + 1));
}

}  // namespace sonar::scene_tools
