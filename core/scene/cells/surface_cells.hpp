// Scatterers that are fixed to surfaces: a lattice of cells in object coordinates. Cells are built on demand from the triangles
// of meshes and kept between pings (docs/architecture.md, "Surface cells"; Choi 2025 eq. 2 for the statistics of one
// scatterer). `scatter` uses the tiles in view of a ping. The speckle of cells does not depend on rays or pings.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <mutex>
#include <span>
#include <vector>

#include "core/base/geometry.hpp"
#include "core/base/parallel.hpp"
#include "core/base/units.hpp"
#include "core/scene/cells/cell_tile.hpp"
#include "core/scene/closed_mesh.hpp"
#include "core/scene/scene.hpp"

namespace sonar {

/// A tile in view, and its position relative to the sonar.
struct TileInView {
  const CellTile* tile = nullptr;
  const CellLevel* level = nullptr;
  Vec3d from_sonar_object_m;  // tile centre minus sonar, object axes
  Vec3d from_sonar_m;         // the same in the sonar's axes
  int object = 0;
  bool in_side_lobes = false;  // true: a tile for side lobes; its weights have constant magnitude
};

/// Cells of a view. They are valid until the next call of in_view() or in_views().
struct CellsInView {
  std::vector<TileInView> tiles;
  std::vector<Rotation> sonar_from_object;  // rotations to the sonar's axes, per object
  std::size_t built = 0;                    // number of tiles built for this view, including shared ones
};

class SurfacePatch;
class TextureField;
struct CellNode;

/// The random fields of materials that the cells use.
struct CellFields {
  bool texture = true, grain = true;
};

class SurfaceCells {
 public:
  SurfaceCells(std::shared_ptr<const Scene> scene, Seed seed, std::size_t cache_bytes, CellFields fields = {});
  /// Replaces the scene. The cells of an object are kept if the new object at its index has the same mesh and materials, even
  /// if scenes alternate.
  void change(std::shared_ptr<const Scene> scene);
  ~SurfaceCells();
  SurfaceCells(const SurfaceCells&) = delete;
  SurfaceCells& operator=(const SurfaceCells&) = delete;

  Seed seed() const { return seed_; }
  /// True if the cells are valid for this seed and these fields. Fields that no material has are ignored.
  bool serves(Seed seed, CellFields fields) const {
    return seed == seed_ && (fields.texture == fields_.texture || !there_.texture) &&
           (fields.grain == fields_.grain || !there_.grain);
  }
  /// Returns the tiles that may lie in the view, in an order that does not depend on the pool. Missing tiles are built first.
  /// The result is valid until the next call. `view` must outlive it.
  const std::vector<TileInView>& in_view(const CellView& view, Parallel& pool);
  /// Like in_view(), for several views in parallel, with the same results. `found` must have one element for each view.
  void in_views(std::span<const CellView> views, Parallel& pool, std::span<CellsInView> found);
  /// Rotation from object axes to sonar axes in the last view of in_view(), for each object.
  const Rotation& sonar_from_object(int object) const { return looked_.rotations[static_cast<std::size_t>(object)]; }
  std::span<const Rotation> sonar_from_objects() const { return looked_.rotations; }
  /// The skins of the meshes of all objects; empty for objects that are not visible.
  std::span<const Skin> skins() const { return skins_; }
  /// Number of the last view.
  std::uint64_t views() const { return now_; }
  /// Keeps the tiles of view number `view` and of later ones, so that other views can be requested meanwhile. 0 = no tiles are
  /// kept.
  void keep_since(std::uint64_t view) { kept_since_ = view; }
  /// Size of the tiles and of the tree that contains them [bytes].
  std::size_t cached_bytes() const { return cached_bytes_; }
  std::size_t built_last_time() const { return built_; }

 private:
  struct Root {
    SurfacePatch* patch;
    CellNode* node;
  };
  struct Missing {  // a tile that is not built yet
    CellNode* node;
    bool of_side;  // the tile for side lobes
    auto operator<=>(const Missing&) const = default;
  };
  struct Found {  // results for some of the roots
    std::vector<TileInView> in_view;
    std::vector<Missing> missing;
    std::size_t new_bytes = 0;
  };
  struct Look {  // values of a view that are compared with cubes
    const CellView* view = nullptr;
    std::uint64_t number = 0;
    struct Wedge {  // |angle about the array axis| below a half angle
      double cosine = 0, sine = 1;
      /// Distance of a point from the wedge; inside the wedge, minus the distance to its edge.
      double outside(Vec3d p) const { return std::abs(p.z) * cosine - p.x * sine; }
    };
    Wedge fan, main, before_side;
    std::vector<Pose> sonar_in_object;  // per object
    std::vector<Rotation> rotations;
  };
  struct Known;  // cells of earlier scenes
  void lay_out();
  bool take_known(std::size_t object);
  void plant(std::size_t object);
  void forget_known();
  void raise_roots(const CellView& view);
  void prepare(const CellView& view, std::uint64_t number, Look& look) const;
  /// Searches the roots in [from, to).
  void look_through(const Look& look, std::size_t from, std::size_t to, Found& found);
  void visit(SurfacePatch& patch, CellNode& node, const Look& look, Found& found);
  void list(CellNode& node, bool of_side, const TileInView& seen, Found& found);
  void build(std::vector<Missing>& missing, Parallel& pool);
  void keep_within_budget();

  std::shared_ptr<const Scene> scene_;
  Seed seed_{};
  std::vector<Skin> skins_;                                             // per object
  CellFields fields_, there_{false, false};                             // requested fields; fields that at least one material has
  std::vector<std::unique_ptr<const TextureField>> textures_, grains_;  // per material, null = none
  std::size_t cache_bytes_ = 0, cached_bytes_ = 0, built_ = 0;
  std::uint64_t now_ = 0, kept_since_ = 0;  // number of the last view; first view whose tiles are kept, 0 = none
  std::vector<std::unique_ptr<SurfacePatch>> patches_;
  std::unique_ptr<Known> known_;
  std::vector<Root> roots_;  // roots of all patches in order, then those of raise_roots(), level by level
  int raised_;               // coarsest level at which all patches have roots
  std::vector<TileInView> in_view_;
  Look looked_;                          // used by in_view()
  std::vector<Look> looks_;              // used by in_views()
  std::vector<Found> found_;             // for each range of roots, or for each view
  std::array<std::mutex, 64> dividing_;  // locked while a cube is divided, because several views may need it
};

}  // namespace sonar
