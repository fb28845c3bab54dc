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

/// The landmark is observed at feature `feature` of a keyframe.
struct Observation {
  KeyframeId keyframe = -1;
  int feature = -1;
};

struct Landmark {
  LandmarkId id = kNoLandmark;
  Eigen::Vector3d x_in_map = Eigen::Vector3d::Zero();  // map units, see scale_source()
  std::vector<Observation> observations;               // by keyframe, at most one for each
  KeyframeId created_by = -1;                          // the newest keyframe at creation
};

struct Keyframe {
  KeyframeId id = -1;
  std::int64_t frame_index = 0;
  std::int64_t stamp_ns = 0;
  Rigid3 camera_from_map;  // lengths in map units, as of all that follows
  ImageFeaturesPtr image;
  std::vector<LandmarkId> landmark_of_feature;  // kNoLandmark: none

  Eigen::Vector3d center_in_map() const { return camera_from_map.inverse().translation; }
};

/// Pose of a removed keyframe relative to another one, which may be removed as well.
struct KeyframeLink {
  std::int64_t frame_index = 0;
  KeyframeId parent = -1;
  Rigid3 removed_from_parent;
};

/// The reference keyframe of a keyframe: itself, or the end of the links of removed keyframes.
inline KeyframeId living_ancestor(const std::map<KeyframeId, KeyframeLink>& removed, KeyframeId id) {
  for (auto link = removed.find(id); link != removed.end(); link = removed.find(id)) id = link->second.parent;
  return id;
}

/// Pose of a keyframe found through the links of removed keyframes; false when a link is missing.
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

/// Offsets that were added to the ids of a merged map.
struct MergedIds {
  KeyframeId keyframes = 0;
  LandmarkId landmarks = 0;
};

/// Keyframes, landmarks and their observations. Data and invariants, no algorithm: an observation is stored
/// with its keyframe and with its landmark, a feature observes at most one landmark, and a keyframe observes
/// a landmark at most once. Changed only through its edits.
/// Not shared between threads.
class Map {
 public:
  /// A map made of its parts, which keep their ids; landmarks of features are taken from the observations.
  /// Throws std::invalid_argument naming the first inconsistent part.
  static Map restore(std::vector<Keyframe> keyframes, std::vector<Landmark> landmarks,
                     std::map<KeyframeId, KeyframeLink> removed, ScaleSource scale_source);

  KeyframeId add_keyframe(std::int64_t frame_index, std::int64_t stamp_ns, const Rigid3& camera_from_map,
                          ImageFeaturesPtr image);
  LandmarkId add_landmark(const Eigen::Vector3d& x_in_map);

  /// False, and nothing changed, when either does not exist, the feature has a landmark, or the keyframe
  /// observes the landmark already. feature: an index into the keyframe's image->set, in [0, image->size()),
  /// which is not checked.
  bool add_observation(LandmarkId landmark, KeyframeId keyframe, int feature);
  void remove_observation(LandmarkId landmark, KeyframeId keyframe);

  void remove_landmark(LandmarkId landmark);
  /// The observations of `from` move to `into` where they don't conflict; `from` is removed.
  void merge_landmarks(LandmarkId from, LandmarkId into);
  /// Removes the keyframe and its observations; stores its pose relative to `parent`.
  void remove_keyframe(KeyframeId keyframe, KeyframeId parent);

  const std::map<KeyframeId, Keyframe>& keyframes() const { return keyframes_; }
  const std::unordered_map<LandmarkId, Landmark>& landmarks() const { return landmarks_; }
  std::vector<LandmarkId> landmark_ids() const;  // sorted
  /// Landmarks created while this keyframe, one of the last sixteen, was the newest; sorted.
  std::vector<LandmarkId> landmarks_created_by(KeyframeId keyframe) const;

  const Keyframe* keyframe(KeyframeId id) const;
  const Landmark* landmark(LandmarkId id) const;

  /// Sets the position; does nothing when the landmark does not exist.
  void set_pose(KeyframeId keyframe, const Rigid3& camera_from_map);
  void set_position(LandmarkId landmark, const Eigen::Vector3d& x_in_map);

  /// Keyframes that share landmarks with this one and the number of these, most first (equal numbers: newest
  /// first).
  std::vector<std::pair<KeyframeId, int>> covisible(KeyframeId keyframe) const;

  /// Landmarks that both keyframes observe.
  int shared(KeyframeId a, KeyframeId b) const;

  /// Pose of a keyframe, also of a removed one. False for an unknown id.
  bool camera_from_map(KeyframeId keyframe, Rigid3* camera_from_map) const;
  const std::map<KeyframeId, KeyframeLink>& removed_keyframes() const { return removed_; }
  /// Forgets the poses of the oldest removed keyframes until `most` are left.
  void forget_removed_keyframes(std::size_t most);

  /// Multiplies all lengths by scale.
  void rescale(double scale);
  /// Transforms the map into another frame and unit.
  void transform(const Sim3& new_from_map);
  /// Transforms each keyframe by its own similarity, together with the landmarks that it observed first and
  /// the removed keyframes stored relative to it. Keyframes without a similarity stay.
  void apply(const std::map<KeyframeId, Sim3>& new_from_map);
  /// Whether there are enough ids to merge the other map.
  bool has_ids_for(const Map& other) const;
  /// Merges another map, whose ids and frame indices grow by the returned offsets. No frame may be in both.
  /// Duplicate landmarks stay until they are merged. Throws std::length_error where has_ids_for is false.
  MergedIds merge(Map other, const Sim3& map_from_other);
  ScaleSource scale_source() const { return scale_source_; }
  void set_scale_source(ScaleSource source) { scale_source_ = source; }

  /// Adds `offset` to the keyframes' frame indices, to keep them apart from those of another recording.
  void shift_frame_indices(std::int64_t offset);

  /// The views of the present map. Valid until the next change.
  const MapViews& views();

  /// The map at one time, to return to. It shares what has not changed with views(): it costs a pointer for
  /// each keyframe and for each 128 landmarks.
  struct Snapshot {
    KeyframeViews keyframes;
    LandmarkPositions landmarks;
    std::map<KeyframeId, KeyframeLink> removed;
    ScaleSource scale_source = ScaleSource::kMapUnits;
    KeyframeId next_keyframe = 0;
    LandmarkId next_landmark = 0;
    std::map<KeyframeId, LandmarkId> first_landmark;
  };
  Snapshot snapshot();
  /// created_by is known of the landmarks of the last sixteen keyframes.
  static Map of(const Snapshot& snapshot);

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
