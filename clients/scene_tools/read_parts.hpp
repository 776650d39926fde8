// The parts that SDF and URDF share: geometry, and adding it to the world. Internal to the readers.
#pragma once

#include <optional>

#include "clients/scene_tools/imported_world.hpp"

namespace sonar::scene_tools {

/// The one shape inside <geometry>; sizes are in child elements (SDF) or attributes (URDF). Empty when a scene cannot hold it,
/// which is then listed, or for another element. `offset` receives the pose of the shape in its own frame.
std::optional<Shape> read_geometry(const Element& geometry, Findings& findings, Pose& offset);

/// Adds a shape; an error beyond max_shapes.
void add_shape(ImportedWorld& world, PlacedShape shape, Findings& findings);

/// "sensor "camera"": name of an element in the list of omissions.
std::string called(const Element& element);

Result<ImportedWorld> read_sdf(std::shared_ptr<const XmlFile> file, const Library& library, const ReadOptions& options,
                               Findings& findings);
Result<ImportedWorld> read_urdf(const XmlFile& file, const ReadOptions& options, Findings& findings);

}  // namespace sonar::scene_tools
