#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <map>
#include <unordered_map>
#include <utility>
#include <vector>

#include "mono_pose_tracker/common/rigid3.h"
#include "mono_pose_tracker/common/status.h"
#include "mono_pose_tracker/geometry/sim3.h"
#include "mono_pose_tracker/map/image_features.h"
#include "mono_pose_tracker/map/map_views.h"

namespace mono_pose_tracker {

/// Feature `feature` of a keyframe sees the landmark.
struct Observation {
  KeyframeId keyframe = -1;
  int feature = -1;
};

struct Landmark {
  LandmarkId id = kNoLandmark;
  Eigen::Vector3d x_in_map = Eigen::Vector3d::Zero();  // map units: what they rest on says scale_source()
  std::vector<Observation> observations;               // by keyframe, at most one for each
  KeyframeId created_by = -1;                          // the keyframe that was newest then
};

struct Keyframe {
  KeyframeId id = -1;
  std::int64_t frame_index = 0;
  std::int64_t stamp_ns = 0;
  Rigid3 camera_from_map;  // lengths in map units, as of all that follows
  ImageFeaturesPtr image;
  std::vector<LandmarkId> landmark_of_feature;  // kNoLandmark where there is none

  Eigen::Vector3d center_in_map() const { return camera_from_map.inverse().translation; }
};

/// Where a keyframe that was removed stood, relative to one that may still be there.
struct KeyframeLink {
  std::int64_t frame_index = 0;
  KeyframeId parent = -1;
  Rigid3 removed_from_parent;
};

/// The keyframe that one rides on: itself, or where the links of removed ones end.
inline KeyframeId living_ancestor(const std::map<KeyframeId, KeyframeLink>& removed, KeyframeId id) {
  for (auto link = removed.find(id); link != removed.end(); link = removed.find(id)) id = link->second.parent;
  return id;
}

/// Pose of a keyframe found through the links of removed ones; false when the walk ends nowhere.
template <typename Keyframes>
bool resolve_keyframe(const Keyframes& keyframes, const std::map<KeyframeId, KeyframeLink>& removed,
                      KeyframeId id, Rigid3* camera_from_map) {
  Rigid3 camera_from_ancestor;
  while (true) {
    const auto found = keyframes.find(id);
    if (found != keyframes.end()) {
      *camera_from_map = camera_from_ancestor * found->second.camera_from_map;
      return true;
    }
    const auto link = removed.find(id);
    if (link == removed.end()) return false;
    camera_from_ancestor = camera_from_ancestor * link->second.removed_from_parent;
    id = link->second.parent;
  }
}

/// What was added to the ids of a map that another took in.
struct MergedIds {
  KeyframeId keyframes = 0;
  LandmarkId landmarks = 0;
};

/// Keyframes, landmarks and who sees what. Data and its invariants, no algorithm: an observation is known to
/// both its keyframe and its landmark, a feature sees one landmark at most, and a landmark is seen once by a
/// keyframe at most. Changed through its edits only.
/// Not shared between threads.
class Map {
 public:
  /// A map made of its parts, which keep their ids; what each feature sees is taken from the observations.
  /// Throws std::invalid_argument naming the first part that contradicts another.
  static Map restore(std::vector<Keyframe> keyframes, std::vector<Landmark> landmarks,
                     std::map<KeyframeId, KeyframeLink> removed, ScaleSource scale_source);

  KeyframeId add_keyframe(std::int64_t frame_index, std::int64_t stamp_ns, const Rigid3& camera_from_map,
                          ImageFeaturesPtr image);
  LandmarkId add_landmark(const Eigen::Vector3d& x_in_map);

  /// False, and nothing changed, when either is gone, the feature is taken, or the keyframe sees the landmark
  /// already. feature: an index into the keyframe's image->set, in [0, image->size()), which is not checked.
  bool add_observation(LandmarkId landmark, KeyframeId keyframe, int feature);
  void remove_observation(LandmarkId landmark, KeyframeId keyframe);

  void remove_landmark(LandmarkId landmark);
  /// The observations of `from` go to `into` where they don't conflict; `from` is removed.
  void merge_landmarks(LandmarkId from, LandmarkId into);
  /// The keyframe's observations are removed, its place is remembered relative to `parent`.
  void remove_keyframe(KeyframeId keyframe, KeyframeId parent);

  const std::map<KeyframeId, Keyframe>& keyframes() const { return keyframes_; }
  const std::unordered_map<LandmarkId, Landmark>& landmarks() const { return landmarks_; }
  std::vector<LandmarkId> landmark_ids() const;  // sorted
  /// Those that came while this keyframe, one of the last sixteen, was the newest; sorted.
  std::vector<LandmarkId> landmarks_created_by(KeyframeId keyframe) const;

  const Keyframe* keyframe(KeyframeId id) const;
  const Landmark* landmark(LandmarkId id) const;

  /// Adjusted; nothing happens when it is gone.
  void set_pose(KeyframeId keyframe, const Rigid3& camera_from_map);
  void set_position(LandmarkId landmark, const Eigen::Vector3d& x_in_map);

  /// Keyframes that share landmarks with this one and how many, most first (ties: newest first).
  std::vector<std::pair<KeyframeId, int>> covisible(KeyframeId keyframe) const;

  /// Landmarks that both see.
  int shared(KeyframeId a, KeyframeId b) const;

  /// Pose of a keyframe, also of one that was removed. False for one that never was.
  bool camera_from_map(KeyframeId keyframe, Rigid3* camera_from_map) const;
  const std::map<KeyframeId, KeyframeLink>& removed_keyframes() const { return removed_; }
  /// Forgets where the oldest of the removed keyframes stood, until `most` are left.
  void forget_removed_keyframes(std::size_t most);

  /// All lengths times scale.
  void rescale(double scale);
  /// The map in another frame and unit.
  void transform(const Sim3& new_from_map);
  /// Each keyframe by a similarity of its own, and with it the landmarks that it is the first to see and the
  /// removed keyframes that hang on it. Keyframes without one stay.
  void apply(const std::map<KeyframeId, Sim3>& new_from_map);
  /// Takes in another map, whose ids and frame indices grow by what is returned. No two keyframes may be of
  /// the same frame then; landmarks that are one and the same stay two until they are merged.
  MergedIds merge(Map other, const Sim3& map_from_other);
  ScaleSource scale_source() const { return scale_source_; }
  void set_scale_source(ScaleSource source) { scale_source_ = source; }

  /// The keyframes' frame indices moved by `offset`, so that they don't meet those of another recording.
  void shift_frame_indices(std::int64_t offset);

  /// What others read of it as it is now. Until the next change.
  const MapViews& views();

  /// Throws std::logic_error naming the first invariant that does not hold. For tests.
  void check() const;

 private:
  Keyframe* find_keyframe(KeyframeId id);
  Landmark* find_landmark(LandmarkId id);
  void check_covisibility() const;
  void forget_first_landmarks();
  void count_shared(const Landmark& landmark, KeyframeId keyframe, int change);

  KeyframeId next_keyframe_ = 0;
  LandmarkId next_landmark_ = 0;
  std::map<KeyframeId, Keyframe> keyframes_;
  std::unordered_map<LandmarkId, Landmark> landmarks_;
  std::map<KeyframeId, KeyframeLink> removed_;
  std::unordered_map<KeyframeId, std::map<KeyframeId, int>> shared_;  // landmarks that both see; no zeros
  std::map<KeyframeId, LandmarkId> first_landmark_;  // that came with it or after it, of the last keyframes
  ScaleSource scale_source_ = ScaleSource::kMapUnits;
  MapViews views_;
};

}  // namespace mono_pose_tracker
