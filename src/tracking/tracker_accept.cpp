// Handling of a registered frame: gating, storing, making it a keyframe; corrections by the mapper.

#include <algorithm>
#include <cmath>
#include <unordered_set>

#include "occlusion.h"
#include "tracker_impl.h"

namespace mono_pose_tracker {

// Returns false after too many consecutive doubtful poses.
bool Tracker::Impl::accept(const Frame& frame, const TrackingMap& map, const RegistrationReport& registration,
                           FrameReport* report) {
  const std::optional<Rigid3> last = frames_lost_ == 0 ? last_pose(map) : std::nullopt;
  const bool doubtful = is_doubtful(frame, registration, last, report);
  if (doubtful && withdraw_doubtful(frame, map, report)) return false;
  motion_.reset();
  if (last) motion_ = registration.camera_from_map * last->inverse();
  end_loss();
  state_ = State::kTracking;
  if (!map.turning_object && static_cast<int>(map.keyframes.size()) > options_.young_map_keyframes)
    objects_abandoned_ = 0;

  const FramePose pose = set_pose(frame, map, registration, Among::kNear);
  reference_ = pose.reference;
  camera_from_reference_ = pose.camera_from_reference;
  if (pace_ == SearchPace::kLive) frames_[map.map_id].keep_newest(limits_.live_frames);
  if (motion_map_ == map.map_id) object_finder_.follow(frame, map, registration);
  if (object_follower_ && frame.unmasked) object_follower_->settle(pixels_of(frame, registration));
  const Overlap overlap = overlap_with(map, reference_, registration, camera_);
  report->median_parallax_deg = overlap.parallax_deg;
  if (doubtful || options_.localize_only) return true;  // the map does not use it
  if (keyframe_policy_.is_due(map, overlap, registration.inliers, worker_.unfinished_jobs())) {
    insert_keyframe(frame, map, pose, registration, report);
  }
  return true;
}

// Stored for recordings, which are written in the end: 16 bytes for each landmark, some 2 kB an image.
LandmarkPixels Tracker::Impl::pixels_of_landmarks(const ImageFeatures& image,
                                                  const std::vector<FrameObservation>& observations) const {
  if (pace_ == SearchPace::kLive) return nullptr;
  auto landmarks = std::make_shared<std::vector<LandmarkPixel>>();
  landmarks->reserve(observations.size());
  for (const auto& [feature, landmark] : observations)
    landmarks->push_back({landmark, image.set.features[feature].pixel, image.sigma_px[feature]});
  return landmarks;
}

// Relative to the best of the keyframes.
FramePose Tracker::Impl::pose_of(const Frame& frame, const TrackingMap& map,
                                 const RegistrationReport& registration, Among among) const {
  const KeyframeId reference = choose_reference(map, registration, among);
  return {frame.stamp_ns, reference,
          registration.camera_from_map * map.keyframes.at(reference).camera_from_map.inverse(),
          pixels_of_landmarks(*frame.image, registration.observations)};
}

FramePose Tracker::Impl::set_pose(const Frame& frame, const TrackingMap& map,
                                  const RegistrationReport& registration, Among among, bool is_final) {
  FramePose pose = pose_of(frame, map, registration, among);
  pose.is_final = is_final;
  frames_[map.map_id].set(frame.index, pose);
  if (keeps_seen()) seen_.add(frame.index, frame.image);
  return pose;
}

KeyframeCandidate Tracker::Impl::candidate_of(const Frame& frame, const TrackingMap& map,
                                              const FramePose& pose,
                                              const RegistrationReport& registration) const {
  KeyframeCandidate candidate{
      map.map_id, frame, pose.reference, pose.camera_from_reference, registration.observations, corrections_};
  if (frame.is_masked) exclude_occluders(map, camera_, registration.camera_from_map, &candidate);
  return candidate;
}

void Tracker::Impl::insert_keyframe(const Frame& frame, const TrackingMap& map, const FramePose& pose,
                                    const RegistrationReport& registration, FrameReport* report) {
  const StageTimer timer(report->stages, "keyframe");
  report->is_keyframe = worker_.insert(candidate_of(frame, map, pose, registration));
  if (!report->is_keyframe) return;
  // Inline, the keyframe is inserted and adjusted already: tracking continues from it. Live, later map
  // changes apply to the next image: this pose is of the map as it was.
  if (pace_ == SearchPace::kLive) return;
  const TrackingMapPtr now = worker_.latest();
  apply_corrections(*now);
  if (now->revision != map.revision && now->keyframes.rbegin()->second.frame_index == frame.index) {
    reference_ = now->keyframes.rbegin()->first;
    camera_from_reference_ = Rigid3();
    frames_[now->map_id].set(frame.index,
                             {frame.stamp_ns, reference_, camera_from_reference_, pose.landmarks});
    report->map_from_camera = now->keyframes.at(reference_).camera_from_map.inverse();
  }
}

// A single doubtful pose may be right, and so may the next. In a longer sequence each one predicted the next
// and none was confirmed: the camera is elsewhere, and all of them are withdrawn.
bool Tracker::Impl::withdraw_doubtful(const Frame& frame, const TrackingMap& map, FrameReport* report) {
  doubted_.push_back(frame.index);
  // Some images in between may have had no features.
  while (static_cast<int>(doubted_.size()) > innovation_gate_.in_a_row()) doubted_.pop_front();
  if (doubted_.size() <= limits_.doubtful_in_a_row) return false;
  for (const std::int64_t index : doubted_) {
    if (const FramePose* pose = frames_[map.map_id].find(index))
      report->withdrawn_ns.push_back(pose->stamp_ns);
    frames_[map.map_id].erase(index);
    if (pace_ != SearchPace::kLive) withdrawn_.insert(index);
  }
  innovation_gate_.interrupt();
  report->map_from_camera.reset();
  report->reason = Reason::kRelocalising;
  report->reason_text = "several doubtful poses in a row; reason of the last: " + report->reason_text;
  return true;
}

// A doubtful pose is reported with the reason for doubt.
bool Tracker::Impl::is_doubtful(const Frame& frame, const RegistrationReport& registration,
                                const std::optional<Rigid3>& last, FrameReport* report) {
  if (!last) innovation_gate_.interrupt();
  std::optional<Rigid3> predicted = last;
  if (predicted && motion_) predicted = *motion_ * *last;
  const std::optional<std::string> doubt =
      innovation_gate_.judge(frame.stamp_ns, registration, predicted, options_.resection.min_inliers);
  if (!doubt) return false;
  report->reason = Reason::kDoubtfulPose;
  report->reason_text = *doubt;
  return true;
}

// The keyframe with most landmarks in common with the frame.
KeyframeId Tracker::Impl::choose_reference(const TrackingMap& map, const RegistrationReport& registration,
                                           Among among) const {
  std::unordered_set<LandmarkId> seen;
  for (const FrameObservation& o : registration.observations) seen.insert(o.landmark);
  const auto current = map.keyframes.find(reference_);
  std::vector<KeyframeId> local;
  if (current != map.keyframes.end() && among == Among::kNear) {
    local.push_back(reference_);
    for (const KeyframeId id : current->second.covisible) {
      if (static_cast<int>(local.size()) < options_.resection.max_local_keyframes) local.push_back(id);
    }
  }
  const KeyframeId newest = map.keyframes.rbegin()->first;
  if (std::find(local.begin(), local.end(), newest) == local.end()) local.push_back(newest);
  const auto shared = [&](KeyframeId id) {
    const std::vector<LandmarkId>& landmarks = map.keyframes.at(id).landmark_of_feature;
    return std::count_if(landmarks.begin(), landmarks.end(),
                         [&](LandmarkId l) { return l != kNoLandmark && seen.count(l) > 0; });
  };
  KeyframeId best = local.front();
  auto most = shared(best);
  const auto consider = [&](KeyframeId id) {
    const auto n = shared(id);
    if (n > most || (n == most && id > best)) most = n, best = id;
  };
  for (const KeyframeId id : local) consider(id);
  if (most == 0 || among == Among::kAll) {
    for (const auto& entry : map.keyframes) consider(entry.first);
  }
  return best;
}

// Applies corrections of the map to everything stored by its ids or in its unit.
void Tracker::Impl::apply_corrections(const TrackingMap& map) {
  for (const auto& correction : map.corrections) {
    if (correction->sequence <= corrections_) continue;
    corrections_ = correction->sequence;
    ++times_corrected_[correction->into_map];
    frames_[correction->of_map].apply(*correction);
    if (tentative_ && tentative_->map_id == correction->of_map) tentative_.reset();
    if (correction->of_map == present_map_) {
      present_map_ = correction->into_map;
      reference_ += correction->added.keyframes;
      const double scale = correction->length_scale(reference_);
      camera_from_reference_.translation *= scale;
      if (motion_) motion_->translation *= scale;
      innovation_gate_.rescale(scale);
      length_scale_ *= scale;
      if (correction->other_geometry) motion_.reset();
      if (correction->other_geometry || correction->into_map != correction->of_map ||
          std::abs(scale - 1) > limits_.other_lengths) {
        object_finder_.forget_places();
      }
    }
    if (correction->into_map == correction->of_map) continue;
    if (motion_map_ == correction->of_map) motion_map_ = correction->into_map;
    frames_[correction->into_map].take(frames_[correction->of_map]);
    frames_.erase(correction->of_map);
    others_.erase(correction->into_map);
    others_.erase(correction->of_map);
    keyframe_policy_.reset();
  }
}

// Publishes and follows map changes between images.
void Tracker::Impl::follow_mapper() {
  worker_.publish_mapper();
  apply_corrections(*worker_.latest());
}

// Forgets maps that the mapper has dropped from a capped atlas.
void Tracker::Impl::forget_dropped_maps(const TrackingMap& map) {
  if (map.epoch != epoch_) return;  // of an earlier set of maps
  const std::set<std::uint32_t> kept(map.inactive_maps.begin(), map.inactive_maps.end());
  for (auto other = others_.begin(); other != others_.end();) {
    const std::uint32_t id = other->first;
    if (kept.count(id)) {
      ++other;
      continue;
    }
    if (tentative_ && tentative_->map_id == id) tentative_.reset();
    frames_.erase(id);
    times_corrected_.erase(id);
    other = others_.erase(other);
  }
}

}  // namespace mono_pose_tracker
