#include "core/scene/cells/surface_cells.hpp"

#include <algorithm>
#include <cassert>
#include <map>
#include <tuple>

#include "core/scene/cells/cell_lattice.hpp"
#include "core/scene/cells/surface_patch.hpp"
#include "core/scene/cells/texture.hpp"

namespace sonar {
namespace {

constexpr double fewest_cells = 3000;  // smallest number of cells for an object, with CellView::exact_small

/// The ranges of tiles for side lobes: they do not fade, because at each position only one cube provides these cells.
constexpr CellLevel at_all_ranges{.full_to_m = 1e9f, .fade_out_to_m = 1e9f};

bool is_empty(const TileInView& t) { return t.tile->count == 0; }

int coarsest_wanted(const CellView& view) {
  return view.levels.front().level - (view.side_from_rad < view.max_elevation_rad ? view.side_coarser : 0);
}

}  // namespace

/// Parts of earlier scenes that later scenes with the same parts can use.
struct SurfaceCells::Known {
  struct SkinOf {
    std::shared_ptr<const Mesh> mesh;
    Skin skin;
  };
  std::map<const Mesh*, SkinOf> skins;
  struct Patch {
    std::unique_ptr<SurfacePatch> patch;
    std::size_t bytes = 0;  // size of mesh and roots in bytes, not included in cached_bytes_
  };
  std::vector<Patch> patches;  // in order of use, the last used patch at the end
  std::size_t bytes = 0;
};

SurfaceCells::SurfaceCells(std::shared_ptr<const Scene> scene, Seed seed, std::size_t cache_bytes, CellFields fields)
    : scene_(std::move(scene)), seed_(seed), fields_(fields), cache_bytes_(cache_bytes), known_(std::make_unique<Known>()) {
  lay_out();
}

void SurfaceCells::change(std::shared_ptr<const Scene> scene) {
  scene_ = std::move(scene);
  for (auto& patch : patches_) {
    const std::size_t bytes = patch->fixed_bytes();
    known_->bytes += bytes;
    known_->patches.push_back({std::move(patch), bytes});
  }
  patches_.clear(), roots_.clear(), skins_.clear(), textures_.clear(), grains_.clear();
  in_view_.clear(), found_.clear();
  there_ = {false, false};
  lay_out();
  forget_known();
}

void SurfaceCells::lay_out() {
  raised_ = SurfacePatch::finest_root;
  for (const Material& m : scene_->materials) {
    const auto add = [&](const Texture& of, bool wanted, Domain domain, auto& to, bool& there) {
      const bool has = of.shape > 0;
      there = there || has;
      to.push_back(has && wanted ? std::make_unique<TextureField>(of, m.texture_seed, seed_, domain) : nullptr);
    };
    add(m.texture, fields_.texture, Domain::texture, textures_, there_.texture);
    add(m.grain, fields_.grain, Domain::grain, grains_, there_.grain);
  }
  std::erase_if(known_->skins, [](const auto& entry) { return entry.second.mesh.use_count() == 1; });
  for (std::size_t o = 0; o < scene_->objects.size(); ++o) {
    const Object& object = scene_->objects[o];
    if (!object.visible) {
      skins_.emplace_back();
      continue;
    }
    const auto [skin, is_new] = known_->skins.try_emplace(object.mesh.get());  // objects often share a mesh
    if (is_new) skin->second = {object.mesh, skin_of(*object.mesh)};
    skins_.push_back(skin->second.skin);
    if (!take_known(o)) plant(o);
  }
  for (auto& patch : patches_)
    for (auto& root : patch->roots)
      if (!root->alone) roots_.push_back({patch.get(), root.get()});
}

/// Reuses the patches that an object had in earlier scenes: their cubes and, if the material is the same, their tiles. Returns
/// false if there are none.
bool SurfaceCells::take_known(std::size_t o) {
  const Object& object = scene_->objects[o];
  const std::size_t before = patches_.size();
  for (Known::Patch& known : known_->patches) {
    if (known.patch->object != static_cast<int>(o) || known.patch->mesh != object.mesh) continue;
    SurfacePatch& patch = *known.patch;
    if (!patch.has_tiles_of(scene_->materials[static_cast<std::size_t>(patch.material)])) {
      cached_bytes_ -= patch.forget_tiles();
      patch.set_material(scene_->materials[static_cast<std::size_t>(patch.material)]);
    }
    known_->bytes -= known.bytes;
    patches_.push_back(std::move(known.patch));
  }
  std::erase_if(known_->patches, [](const Known::Patch& known) { return !known.patch; });
  return patches_.size() > before;
}

void SurfaceCells::plant(std::size_t o) {
  const Object& object = scene_->objects[o];
  std::map<std::tuple<int, int, bool>, std::vector<std::uint32_t>> sorted;  // key: material, axis, side
  for (std::uint32_t t = 0; t < object.mesh->triangles.size(); ++t) {
    const Vec3d n = lattice::normal_of(*object.mesh, t);
    const int axis = lattice::dominant_axis(n);
    const double along = axis == 0 ? n.x : axis == 1 ? n.y : n.z;
    if (along == 0) continue;  // the triangle has no area
    sorted[{object.mesh->material[t], axis, along < 0}].push_back(t);
  }
  for (const auto& [key, triangles] : sorted) {
    auto patch = std::make_unique<SurfacePatch>();
    patch->object = static_cast<int>(o);
    std::tie(patch->material, patch->axis, patch->negative_side) = key;
    patch->set_material(scene_->materials[static_cast<std::size_t>(patch->material)]);
    patch->coarsest = static_cast<int>(std::ceil(-0.5 * std::log2(skins_[o].area_m2 / fewest_cells)));
    patch->mesh = object.mesh;
    patch->plant(triangles);
    patches_.push_back(std::move(patch));
  }
}

/// Drops parts of earlier scenes, beginning with the oldest, as long as they take too much memory.
void SurfaceCells::forget_known() {
  std::size_t n = 0;
  const auto is_of_the_last = [&] {  // the patches of an object are added and dropped together
    const SurfacePatch &last = *known_->patches[n - 1].patch, &next = *known_->patches[n].patch;
    return next.object == last.object && next.mesh == last.mesh;
  };
  for (; n < known_->patches.size(); ++n) {
    const bool is_too_much = known_->bytes > cache_bytes_ / 4 || cached_bytes_ > cache_bytes_;
    if (!is_too_much && (n == 0 || !is_of_the_last())) break;
    Known::Patch& known = known_->patches[n];
    known_->bytes -= known.bytes;
    cached_bytes_ -= known.patch->forget_tiles();
    for (auto& root : known.patch->roots) cached_bytes_ -= SurfacePatch::forget_below(*root, UINT64_MAX);
  }
  known_->patches.erase(known_->patches.begin(), known_->patches.begin() + static_cast<std::ptrdiff_t>(n));
}

SurfaceCells::~SurfaceCells() = default;

void SurfaceCells::list(CellNode& node, bool of_side, const TileInView& seen, Found& found) {
  const bool built = of_side ? node.side_built : node.built;
  const Missing missing{&node, of_side};
  // Lists a missing tile only once, even if two levels need it.
  if (!built && (found.missing.empty() || found.missing.back() != missing)) found.missing.push_back(missing);
  if (!built || seen.tile->count > 0) found.in_view.push_back(seen);
}

void SurfaceCells::visit(SurfacePatch& patch, CellNode& node, const Look& look, Found& found) {
  const CellView& view = *look.view;
  const auto object = static_cast<std::size_t>(patch.object);
  const Pose& sonar_in_object = look.sonar_in_object[object];
  const Rotation& turn = look.rotations[object];
  const Cube cube = cube_of(node.address);
  const Vec3d centre = lattice::from_permuted(cube.u, cube.v, cube.w, patch.axis);
  const double radius = cube.radius();
  const Vec3d q = centre - sonar_in_object.position_m;
  const auto& m = turn.m;
  const Vec3d p{m[0][0] * q.x + m[0][1] * q.y + m[0][2] * q.z, m[1][0] * q.x + m[1][1] * q.y + m[1][2] * q.z,
                m[2][0] * q.x + m[2][1] * q.y + m[2][2] * q.z};
  const double range = length(p);
  if (range - radius > view.max_range_m) return;
  DistanceSpan seen{range - radius, range + radius};
  if (view.seen_between) {
    const std::optional<DistanceSpan> span = view.seen_between(p, radius);
    if (!span) return;
    seen = *span;
  } else {
    if (look.fan.outside(p) > radius) return;
    if (std::abs(p.y) - radius > view.max_sine * (range + radius)) return;
  }
  if (seen.farthest_m < static_cast<double>(view.min_range_m)) return;

  node.last_visited.store(look.number, std::memory_order_relaxed);
  const auto level_of = [&](const CellLevel& l) { return view.exact_small ? std::max(l.level, patch.coarsest) : l.level; };
  const bool has_sides = !view.seen_between && view.side_from_rad < view.max_elevation_rad;
  const bool in_main = !has_sides || look.main.outside(p) <= radius;
  const bool in_side = has_sides && look.before_side.outside(p) >= -radius;
  bool finer = in_main && node.address.level < level_of(view.levels.front());
  for (const CellLevel& level : view.levels) {
    const bool overlaps = seen.nearest_m < level.fade_out_to_m && seen.farthest_m >= level.fade_in_from_m;
    if (!in_main || !overlaps) continue;
    if (level_of(level) == node.address.level) list(node, false, {&node.tile, &level, q, p, patch.object, false}, found);
    finer = finer || level_of(level) > node.address.level;
  }
  if (in_side) {
    finer = finer || patch.side_level(node.address, sonar_in_object.position_m, view) > node.address.level;
    if (patch.has_side_cells(node.address, sonar_in_object.position_m, view))
      list(node, true, {&node.side_tile, &at_all_ranges, q, p, patch.object, true}, found);
  }
  if (!finer || node.alone) return;
  if (!node.divided.load(std::memory_order_acquire)) {
    const std::lock_guard lock(dividing_[reinterpret_cast<std::uintptr_t>(&node) / sizeof(CellNode) % dividing_.size()]);
    if (!node.divided.load(std::memory_order_relaxed)) found.new_bytes += patch.divide(node);
  }
  // Prefetches all children before the first one is visited, because they are scattered in memory.
  for (const auto& child : node.children) {
    if (!child) continue;
    const auto* at = reinterpret_cast<const char*>(child.get());
    __builtin_prefetch(at);
    __builtin_prefetch(at + 64);
  }
  for (auto& child : node.children)
    if (child) visit(patch, *child, look, found);
}

/// Adds coarser roots level by level, because cells for long pulses may be coarser than the first roots. Since whole levels are
/// added, the order of the roots does not depend on earlier views.
void SurfaceCells::raise_roots(const CellView& view) {
  for (; raised_ > coarsest_wanted(view); --raised_)
    for (auto& patch : patches_) {
      patch->raise(raised_ - 1);  // a patch of an earlier scene may already have these roots
      for (auto& root : patch->roots)
        if (root->alone && root->address.level == raised_ - 1) roots_.push_back({patch.get(), root.get()});
    }
}

void SurfaceCells::prepare(const CellView& view, std::uint64_t number, Look& look) const {
  assert(!view.levels.empty());
  const std::size_t objects = scene_->objects.size();
  look.view = &view;
  look.number = number;
  const auto wedge = [](float angle) {
    return Look::Wedge{std::cos(static_cast<double>(angle)), std::sin(static_cast<double>(angle))};
  };
  look.fan = wedge(view.max_elevation_rad);
  look.main = wedge(view.main_elevation_rad);
  look.before_side = wedge(view.side_from_rad);
  look.rotations.resize(objects);
  look.sonar_in_object.resize(objects);
  for (std::size_t o = 0; o < objects; ++o) {
    look.sonar_in_object[o] = compose(inverse(scene_->in_world(scene_->objects[o], view.bodies_in_world)), view.sonar_in_world);
    look.rotations[o] = rotation_from(conjugate(look.sonar_in_object[o].orientation));
  }
}

void SurfaceCells::look_through(const Look& look, std::size_t from, std::size_t to, Found& found) {
  found.in_view.clear();
  found.missing.clear();
  found.new_bytes = 0;
  const int coarsest = coarsest_wanted(*look.view);
  for (std::size_t r = from; r < to; ++r) {
    CellNode& root = *roots_[r].node;
    if (!root.alone || root.address.level >= coarsest) visit(*roots_[r].patch, root, look, found);
  }
}

void SurfaceCells::build(std::vector<Missing>& missing, Parallel& pool) {
  pool.for_each(missing.size(), [&](std::size_t n, int) {
    CellNode& node = *missing[n].node;
    const bool of_side = missing[n].of_side;
    const TileAddress& a = node.address;
    const auto material = static_cast<std::size_t>(a.material);
    (of_side ? node.side_tile : node.tile) =
        build_tile(a, *scene_->objects[static_cast<std::size_t>(a.object)].mesh, node.triangles,
                   scene_->materials[material].texture_seed, seed_, textures_[material].get(), grains_[material].get(),
                   of_side ? CellWeights::of_one_magnitude : CellWeights::gaussian);
    (of_side ? node.side_built : node.built) = true;
  });
  for (const auto& [node, of_side] : missing) cached_bytes_ += (of_side ? node->side_tile : node->tile).bytes();
}

const std::vector<TileInView>& SurfaceCells::in_view(const CellView& view, Parallel& pool) {
  // Searches ranges of roots in parallel. The results of each range stay separate, so that their order does not depend on the
  // threads.
  constexpr std::size_t stretch = 16;
  raise_roots(view);
  prepare(view, ++now_, looked_);
  found_.resize((roots_.size() + stretch - 1) / stretch);
  pool.for_each(found_.size(), [&](std::size_t s, int) {
    look_through(looked_, s * stretch, std::min(roots_.size(), (s + 1) * stretch), found_[s]);
  });
  in_view_.clear();
  std::vector<Missing> missing;
  for (const Found& found : found_) {
    cached_bytes_ += found.new_bytes;
    in_view_.insert(in_view_.end(), found.in_view.begin(), found.in_view.end());
    missing.insert(missing.end(), found.missing.begin(), found.missing.end());
  }
  build(missing, pool);
  built_ = missing.size();
  keep_within_budget();

  if (!missing.empty()) std::erase_if(in_view_, is_empty);
  return in_view_;
}

void SurfaceCells::in_views(std::span<const CellView> views, Parallel& pool, std::span<CellsInView> found) {
  assert(found.size() == views.size());
  for (const CellView& view : views) raise_roots(view);
  const std::uint64_t first = now_ + 1;
  now_ += views.size();
  looks_.resize(views.size());
  found_.resize(views.size());
  pool.for_each(views.size(), [&](std::size_t v, int) {
    found_[v].in_view.swap(found[v].tiles);  // reuses the memory of the last call
    prepare(views[v], first + v, looks_[v]);
    look_through(looks_[v], 0, roots_.size(), found_[v]);
    found[v].tiles.swap(found_[v].in_view);
    found[v].sonar_from_object = looks_[v].rotations;
  });
  std::vector<Missing> missing;
  for (std::size_t v = 0; v < views.size(); ++v) {
    cached_bytes_ += found_[v].new_bytes;
    missing.insert(missing.end(), found_[v].missing.begin(), found_[v].missing.end());
    found[v].built = found_[v].missing.size();
  }
  std::sort(missing.begin(), missing.end());
  missing.erase(std::unique(missing.begin(), missing.end()), missing.end());
  build(missing, pool);
  // Tiles of these views stay in the cache.
  const std::uint64_t kept = kept_since_;
  kept_since_ = kept > 0 ? std::min(kept, first) : first;
  keep_within_budget();
  kept_since_ = kept;
  pool.for_each(missing.empty() ? 0 : views.size(), [&](std::size_t v, int) { std::erase_if(found[v].tiles, is_empty); });
}

/// Drops the least recently used tiles if the cache is too large. If a dropped tile is built again, it is identical.
void SurfaceCells::keep_within_budget() {
  if (cached_bytes_ > cache_bytes_) forget_known();
  for (std::uint64_t age = 256; cached_bytes_ > cache_bytes_ && age > 0; age /= 4) {
    if (age >= now_ || (kept_since_ > 0 && now_ - age >= kept_since_)) continue;
    for (auto& patch : patches_)
      for (auto& root : patch->roots) {
        cached_bytes_ -= SurfacePatch::forget_below(*root, now_ - age + 1);
        if (root->last_visited <= now_ - age) cached_bytes_ -= root->forget_tiles();
      }
  }
}

}  // namespace sonar
