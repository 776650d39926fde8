// The objects of a scene file: shapes with poses, instances, moving bodies, point targets. Internal to the scene loader.
#pragma once

#include "core/scene/shapes.hpp"

namespace sonar {

inline constexpr std::size_t max_objects = 20000;
inline constexpr std::size_t max_bodies = 256;

/// `pose: {xyz_m: [..], rpy_deg: [..]}`; what is absent is zero.
Pose read_pose(const text::Node& node);
/// Reads the list into the scene. Order of the file = order of the objects and of the bodies.
void read_objects(const text::Node& list, ShapeReader& shapes);
/// `sea_surface: {size_m, lambert_db}`: a sheet at z = 0 with a Lambert strength; it does not mirror.
void read_sea_surface(const text::Node& node, ShapeReader& shapes);

}  // namespace sonar
