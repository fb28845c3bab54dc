#include "static_overlay.h"

#include <algorithm>
#include <iterator>

#include "common/statistics.h"
#include "geometry/triangulation.h"
#include "mono_pose_tracker/camera/camera_model.h"
#include "mono_pose_tracker/features/matching.h"

namespace mono_pose_tracker {

namespace {

constexpr StaticOverlayOptions kOverlay{};

// The preceding keyframes at growing distances: fixed features are in all of them, tracked ones are not.
std::vector<const Keyframe*> earlier_keyframes(const Map& map, KeyframeId newest) {
  std::vector<const Keyframe*> chosen;
  std::size_t back = 0, next = 1;
  for (auto k = std::make_reverse_iterator(map.keyframes().find(newest));
       k != map.keyframes().rend() && chosen.size() < kOverlay.max_compared; ++k) {
    if (++back < next) continue;
    chosen.push_back(&k->second);
    next = back + 1 + back / 3;
  }
  return chosen;
}

int same_place(const MapperOptions& options, const Keyframe& newest, int feature, const Keyframe& earlier) {
  const Feature& own = newest.image->set.features[feature];
  NearestTwo nearest;
  earlier.image->grid.visit_near(
      own.pixel.cast<double>(), kOverlay.same_place_px * image_scale(newest.image->camera), [&](int f) {
        nearest.offer(
            f, descriptor_distance2(newest.image->set.descriptor(feature), earlier.image->set.descriptor(f)));
      });
  return nearest.best <= stored_distance2(options.mapping.max_descriptor_distance) ? nearest.index : -1;
}

// A feature of a keyframe.
struct Sighting {
  const Keyframe* keyframe;
  int feature;
};

// Whether no point explains the features: the best one, or a far one where the rays do not intersect, has
// large errors in most keyframes.
bool is_no_point(const std::vector<Sighting>& seen) {
  std::vector<Rigid3> cameras;
  std::vector<Eigen::Vector3d> bearings;
  for (const Sighting& s : seen) {
    cameras.push_back(s.keyframe->camera_from_map);
    bearings.push_back(s.keyframe->image->set.bearings[s.feature]);
  }
  Eigen::Vector3d x_in_map;
  const bool is_near = triangulate_multi_view(cameras, bearings, &x_in_map);
  const Eigen::Vector3d direction = common_direction(cameras, bearings);
  std::vector<double> errors;
  for (std::size_t i = 0; i < seen.size(); ++i) {
    const Eigen::Vector3d x = is_near ? cameras[i] * x_in_map : cameras[i].rotation * direction;
    errors.push_back(reprojection_error(*seen[i].keyframe->image, seen[i].feature, x).norm());
  }
  return median(std::move(errors)) > kOverlay.no_point_px * image_scale(seen[0].keyframe->image->camera);
}

}  // namespace

FlaggedFeatures find_static_overlay(const MapperOptions& options, const Map& map, KeyframeId newest_id,
                                    const FlaggedFeatures& known) {
  const Keyframe& newest = *map.keyframe(newest_id);
  const std::vector<const Keyframe*> earlier = earlier_keyframes(map, newest_id);
  FlaggedFeatures fixed;
  int found = 0;
  for (int f = 0; f < newest.image->size(); ++f) {
    std::vector<Sighting> seen = {{&newest, f}};
    for (const Keyframe* keyframe : earlier) {
      const int there = same_place(options, newest, f, *keyframe);
      if (there >= 0) seen.push_back({keyframe, there});
    }
    const std::size_t again = seen.size() - 1;
    const bool is_one = std::any_of(seen.begin() + 1, seen.end(), [&](const Sighting& s) {
      return is_flagged(known, s.keyframe->id, s.feature);
    });
    if (!is_one && (again < kOverlay.min_earlier || again < kOverlay.min_earlier_share * earlier.size() ||
                    !is_no_point(seen))) {
      continue;
    }
    ++found;
    for (const Sighting& s : seen) {
      std::vector<char>& flags = fixed[s.keyframe->id];
      flags.resize(s.keyframe->image->size(), 0);
      flags[s.feature] = 1;
    }
  }
  return found >= kOverlay.min_features ? fixed : FlaggedFeatures();
}

}  // namespace mono_pose_tracker
