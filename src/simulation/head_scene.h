#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>

#include "simulation/scene.h"

namespace mono_pose_tracker {

/// How a head looks at one moment. As it stands here: at rest, its neck turning with it.
struct HeadLook {
  bool neck = true;         // false: the neck is not the head's, but bends (TorsoScene)
  float mouth_open = 0;     // m between the lips
  float lids = 0;           // 0 open to 1 closed
  float gaze = 0;           // m that the irises are off the middle, to the head's x
  bool loose_hair = false;  // fine strands, which sway with hair_time
  float hair_time = 0;      // s
  float shine = 0;          // strength of the light's reflection: 0.2 skin, 1 polished bronze
};

/// What of a face moves by itself.
struct FaceMotionOptions {
  bool speaks = false;  // about five syllables a second, with pauses
  bool blinks = false;  // every 1 to 2.5 s for a sixth of a second; the gaze jumps now and then
  bool loose_hair = false;
};

/// How the face is `time` seconds on. The same for one seed.
HeadLook face_look(const FaceMotionOptions& options, std::uint64_t seed, double time);

/// A life-sized head in its own frame: origin between the ears at the level of the eyes, metres, x to the
/// image's right, y down, z backwards (the face looks along -z), so that a camera straight before it has
/// parallel axes. Returns a lower bound of the distance to its surface, negative inside, zero exactly on it
/// (Hart 1996; Quilez). Without its neck the head ends below jaw and skull.
double head_distance(const Eigen::Vector3d& x_in_head, bool with_neck = true);

/// Everything of the head lies in the ball of this radius (m) about this point.
inline Eigen::Vector3d head_bound_centre() { return {0, 0.09, 0.02}; }
constexpr double kHeadBoundRadius = 0.28;

/// Colours of the skin, hair, eyes, lips.
Eigen::Vector3f head_albedo(unsigned seed, const HeadLook& look, const Eigen::Vector3f& x_in_head,
                            float footprint);

/// Light arriving on skin and cloth; `free`: unoccluded share, 0 to 1 and more, a finger's breadth above the
/// surface.
Color skin_light(const Eigen::Vector3f& normal, double free, const Lighting& lighting);

/// A normal disturbed by some degrees, in patches of 2 to 8 mm, as by pores or hammered metal.
Eigen::Vector3f uneven_normal(std::uint32_t seed, const Eigen::Vector3d& x, const Eigen::Vector3d& normal);

/// Reflection of the lamp and the window in a surface of strength 1. It stays nearly constant in space while
/// the object turns.
Color reflected_light(const Eigen::Vector3f& normal, const Eigen::Vector3d& to_camera,
                      const Lighting& lighting);

/// A head (head_distance), its own frame being the map: the camera moves against it.
class HeadScene : public Scene {
 public:
  explicit HeadScene(std::uint32_t seed, const HeadLook& look = {}) : seed_(seed), look_(look) {}

  bool intersect(const Ray& ray, double start, Hit* hit) const override;
  double free_distance(const Ray& axis, double slope) const override;
  Color albedo(const Hit& hit, const Eigen::Vector3d& x_in_map, float footprint) const override;
  Color irradiance(const Hit& hit, const Eigen::Vector3d& x_in_map, const Lighting& lighting) const override;
  Color gloss(const Hit& hit, const Eigen::Vector3d& x_in_map, const Eigen::Vector3d& to_camera,
              const Lighting& lighting) const override;

 private:
  std::uint32_t seed_;
  HeadLook look_;
};

}  // namespace mono_pose_tracker
