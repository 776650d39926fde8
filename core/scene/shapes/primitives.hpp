// Makes triangle meshes of solids and sheets. With segments_for() segments, chords stay within a millimetre of the true surface
// up to a radius of 53 m. The axis of revolution is z and the centre is the origin of the object frame. Normals point outward.
// Meshes are closed, except for sheets and cylinders without both caps. The material is 0.
#pragma once

#include <cstdint>

#include "core/scene/scene.hpp"

namespace sonar {

/// Number of segments of a circle with this radius [m] for which no chord is farther than a millimetre from it; 16..512.
int segments_for(double radius_m);

/// Largest number of patches along an edge of a plane or box. Longer edges have larger patches.
inline constexpr int most_patches = 400;
/// Makes a rectangle in the x-y plane, with normals up, in patches of at most `patch_m`.
Mesh make_plane(double length_x_m, double length_y_m, double patch_m = 1);
Mesh make_box(Vec3d size_m, double patch_m = 1);
Mesh make_sphere(double radius_m, int segments);
enum class Caps { both, bottom, none };
Mesh make_cylinder(double radius_m, double length_m, int segments, Caps caps = Caps::both);
/// Makes a cylinder with a half sphere at each end. `length_m` is the length of the straight part between them.
Mesh make_capsule(double radius_m, double length_m, int segments);
/// Makes a cone with its base at z = -length/2, or a frustum if the top radius is above zero.
Mesh make_cone(double base_radius_m, double top_radius_m, double length_m, int segments);
/// Makes a ring of `radius_m` (to the middle of the tube) in the x-y plane. `radius_m` must exceed `tube_radius_m`.
Mesh make_torus(double radius_m, double tube_radius_m, int segments);
/// Makes a boulder: an ellipsoid with these semi-axes. Its bumps are `bumpiness` (0..0.5) of its size and are drawn from `seed`.
Mesh make_rock(Vec3d semi_axes_m, double bumpiness, std::uint32_t seed, int segments);

}  // namespace sonar
