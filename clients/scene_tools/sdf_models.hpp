// The models of an SDF file as a tree, with includes resolved, and the poses of their frames. Only read_sdf uses it.
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "clients/scene_tools/imported_world.hpp"

namespace sonar::scene_tools {

struct SdfModel;

/// A frame to which poses may be relative: a link, a joint, a frame or a nested model.
struct SdfFrame {
  Element pose, element;
  std::string base;              // frame to which the pose is relative by default; empty = the model
  SdfModel* nested = nullptr;    // nested model; its `placing` has the pose
  std::optional<Pose> in_model;  // set when it has been computed
  bool being_asked = false;
};

struct SdfModel {
  std::string name, path;  // such as crane and ship/crane; both are empty for the world
  std::string source;      // name of the included model, which may be more descriptive than the name in this file
  Element element;         // <model> or <world>
  SdfModel* parent = nullptr;
  bool is_world = false, is_static = false, merged = false;
  SdfFrame placing;  // pose in the parent
  std::string placement_frame;
  std::map<std::string, SdfFrame, std::less<>> frames;
  std::vector<std::unique_ptr<SdfModel>> nested;
};

/// A pose as the file has it, and the frame to which it is relative.
struct SdfPose {
  Pose pose;
  std::string relative_to;
};
SdfPose read_sdf_pose(const Element& pose, Findings& findings);

/// Builds the tree below <world> or, without one, below <sdf>. The limits are 16 nested includes, 4096 models and 5 million
/// elements. The object keeps the files that contain the elements of the tree.
class SdfTree {
 public:
  SdfTree(const Library& library, const ReadOptions& options, Findings& findings)
      : library_(library), options_(options), findings_(findings) {}
  std::unique_ptr<SdfModel> build(const Element& world);
  std::vector<std::shared_ptr<const XmlFile>> included_files() const;

 private:
  void report_missing();
  void fill(SdfModel& model, int include_depth);
  void add_model(SdfModel& parent, const Element& element, const Element& include, int include_depth);
  void add_include(SdfModel& parent, const Element& include, int include_depth);
  void add_frame(SdfModel& model, const Element& element, std::string base);
  std::shared_ptr<const XmlFile> read(const std::filesystem::path& path, const Element& include);

  const Library& library_;
  const ReadOptions& options_;
  Findings& findings_;
  std::map<std::filesystem::path, std::shared_ptr<const XmlFile>> files_;
  struct Missing {
    std::string uri;
    Place at;
    std::size_t includes = 0;
  };
  std::vector<Missing> missing_;
  std::size_t models_ = 0, elements_ = 0;
};

/// Returns the pose of the frame `name` ("", "__model__", "arm", "crane::hook") in the model. An unknown name, or poses that
/// refer to each other in a circle, are errors at `asked_by`.
Pose frame_in_model(SdfModel& model, const std::string& name, const Place& asked_by, Findings& findings, int depth = 0);

/// Returns the pose of a nested model in its parent.
Pose model_in_parent(SdfModel& nested, const Place& asked_by, Findings& findings, int depth = 0);

}  // namespace sonar::scene_tools
