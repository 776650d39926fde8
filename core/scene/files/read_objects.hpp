// The objects of a scene file: shapes with poses, instances, moving bodies, point targets. Internal to the scene loader.
#pragma once

#include "core/scene/files/shapes.hpp"

namespace sonar {

inline constexpr std::size_t max_objects = 20000;
inline constexpr std::size_t max_bodies = 256;

/// Reads `pose: {xyz_m: [..], rpy_deg: [..]}`. Missing keys mean zero.
Pose read_pose(const text::Node& node);
/// Reads the list of objects into the scene. Objects and bodies keep the order of the file.
void read_objects(const text::Node& list, ShapeReader& shapes);
/// Reads `other_sonars: [{name, xyz_m, level_db, rate_hz, pulse_ms}]`.
void read_other_sonars(const text::Node& list, Scene& scene);
/// Reads `sea_surface: {size_m, centre_m, lambert_db, roughness_m, bubble_layer_m, bubble_loss_db_per_m}`: a sheet at z = 0.
void read_sea_surface(const text::Node& node, ShapeReader& shapes);
/// Reads `water_column: {volume_db}` or `{clarity: clear | turbid}`: scatterers in the water.
void read_water_column(const text::Node& node, Scene& scene);

}  // namespace sonar
