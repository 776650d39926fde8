// Functions that the readers of SDF and URDF share: they read geometry and add shapes to the world.
#pragma once

#include <optional>

#include "clients/scene_tools/imported_world.hpp"

namespace sonar::scene_tools {

/// Where the values of missing lengths come from. URDF has no defaults.
enum class Defaults { of_sdf, none };

/// Reads the shape inside <geometry>, whose sizes are in child elements (SDF) or attributes (URDF). Returns nothing for other
/// elements, and for shapes that a scene cannot hold, which are then listed. `offset` receives the pose of the shape in its
/// frame. Without `defaults`, a missing length is an error.
std::optional<Shape> read_geometry(const Element& geometry, Findings& findings, Pose& offset, Defaults defaults);

/// Adds a shape; more than max_shapes are an error.
void add_shape(ImportedWorld& world, PlacedShape shape, Findings& findings);

/// Returns the name of an element for the list of omissions, such as: sensor "camera".
std::string called(const Element& element);

Result<ImportedWorld> read_sdf(std::shared_ptr<const XmlFile> file, const Library& library, const ReadOptions& options,
                               Findings& findings);
Result<ImportedWorld> read_urdf(const XmlFile& file, const ReadOptions& options, Findings& findings);

}  // namespace sonar::scene_tools
