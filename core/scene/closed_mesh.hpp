// Determines whether a mesh is the closed surface of a body, whose far faces are then invisible.
#pragma once

#include "core/base/geometry.hpp"
#include "core/scene/scene.hpp"

namespace sonar {

struct Skin {
  int outward = 0;  // +1: closed, normals point outwards; -1: inwards; 0: open, or the outer side is unknown
  Vec3d low, high;  // corners of the box around it, object axes [m]
  double area_m2 = 0;
};

/// A mesh is closed if every edge belongs to two triangles with opposite directions along it (vertices at the same place count as
/// one), and if the volumes of all parts have the same sign. Time: about 0.3 us per triangle.
Skin skin_of(const Mesh& mesh);

/// Whether a place (object axes) lies within a closed mesh, by its winding number. Time: about 30 ns per triangle.
bool encloses(const Mesh& mesh, Vec3d place);

}  // namespace sonar
