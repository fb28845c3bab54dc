#include "mono_pose_tracker/tracking/tracker.h"

#include <algorithm>
#include <map>
#include <optional>
#include <unordered_set>

#include "bootstrap_job.h"
#include "frame_maker.h"
#include "keyframe_policy.h"
#include "map_snapshot.h"
#include "mono_pose_tracker/mapping/mapping_worker.h"
#include "mono_pose_tracker/tracking/options_table.h"
#include "mono_pose_tracker/tracking/resector.h"
#include "object_finder.h"
#include "occlusion.h"

namespace mono_pose_tracker {

namespace {

// Where a posed frame stands: it moves with its reference keyframe.
struct FrameRecord {
  std::int64_t stamp_ns = 0;
  KeyframeId reference = -1;
  Rigid3 camera_from_reference;
};

}  // namespace

class Tracker::Impl {
 public:
  Impl(const TrackerOptions& options, const CameraModel& camera, Mapping mapping,
       std::function<void()> before_mapping)
      : options_(options),
        camera_(camera),
        object_finder_(options.segmentation, camera),
        frame_maker_(options.sift, options.scale, camera),
        resector_(options, camera),
        keyframe_policy_(options.mapping, options.young_map_keyframes),
        bootstrap_job_(options, camera),
        worker_(options.mapper(camera.focal()), camera, mapping == Mapping::kThreaded,
                std::move(before_mapping)) {}

  FrameReport process(std::int64_t stamp_ns, const cv::Mat& image, const cv::Mat& mask);
  void reset();
  void set_options(const TrackerOptions& options);
  std::uint32_t epoch() const { return epoch_; }
  std::optional<Map> copy_map();
  void load_map(Map map);
  MapOrigin origin() const;
  std::vector<PosedFrame> trajectory() const;
  bool finish();
  FrameReport resect_again(std::int64_t frame_index, std::int64_t stamp_ns, const cv::Mat& image,
                           const cv::Mat& mask);

  MappingWorker& worker() { return worker_; }
  const MappingWorker& worker() const { return worker_; }
  bool is_unconfirmed() const { return unconfirmed_; }

 private:
  std::optional<Frame> make_frame(std::int64_t index, std::int64_t stamp_ns, const cv::Mat& image,
                                  const Segmentation& segmentation, FrameReport* report);
  void bootstrap(const Frame& frame, FrameReport* report);
  void track(const Frame& frame, FrameReport* report);
  void lose(FrameReport* report);
  void accept(const Frame& frame, const TrackingMap& map, const ResectionReport& resection,
              FrameReport* report);
  ResectionReport resect_near(const Frame& frame, const TrackingMap& map) const;
  KeyframeId choose_reference(const TrackingMap& map, const ResectionReport& resection) const;
  void start_map();
  void describe(const ResectionReport& resection, FrameReport* report) const;
  void finish_report(FrameReport* report);

  TrackerOptions options_;
  const CameraModel camera_;
  ObjectFinder object_finder_;
  FrameMaker frame_maker_;
  Resector resector_;
  KeyframePolicy keyframe_policy_;
  BootstrapJob bootstrap_job_;
  MappingWorker worker_;  // last: its thread uses what stands before it

  State state_ = State::kBootstrapping;
  std::uint32_t epoch_ = 0;
  std::int64_t next_index_ = 0;
  bool unconfirmed_ = false;
  bool loaded_ = false;                  // the map comes from a file
  BootstrapReport bootstrap_;            // the last known
  std::uint64_t reported_revision_ = 0;  // of the map whose mapping times were reported last

  // The last posed frame and its movement since the one before.
  KeyframeId reference_ = -1;
  Rigid3 camera_from_reference_;
  std::optional<Rigid3> motion_;  // camera now from camera one frame ago
  int frames_lost_ = 0;
  std::size_t relocalization_cursor_ = 0;

  std::map<std::int64_t, FrameRecord> records_;  // by frame index
};

std::optional<Frame> Tracker::Impl::make_frame(std::int64_t index, std::int64_t stamp_ns,
                                               const cv::Mat& image, const Segmentation& segmentation,
                                               FrameReport* report) {
  // Only the views that begin a map set its scale by a marker.
  return frame_maker_.make(index, stamp_ns, image, segmentation, object_finder_.clearance(segmentation.mask),
                           state_ == State::kBootstrapping, report);
}

FrameReport Tracker::Impl::process(std::int64_t stamp_ns, const cv::Mat& image, const cv::Mat& mask) {
  FrameReport report;
  report.stamp_ns = stamp_ns;
  const std::int64_t index = next_index_++;
  std::optional<Frame> frame;
  if (frame_maker_.has_camera_size(image, &report)) {
    Segmentation segmentation;
    {
      const StageTimer timer(report.stages, "segment");
      segmentation = object_finder_.find(image, mask, state_ == State::kBootstrapping);
    }
    frame = make_frame(index, stamp_ns, image, segmentation, &report);
  }
  if (frame) {
    if (state_ == State::kBootstrapping) {
      const StageTimer timer(report.stages, "bootstrap");
      bootstrap(*frame, &report);
    } else {
      track(*frame, &report);
    }
  }
  finish_report(&report);
  return report;
}

void Tracker::Impl::finish_report(FrameReport* report) {
  report->state = state_;
  report->epoch = epoch_;
  report->worker_backlog = worker_.backlog();
  if (const TrackingMapPtr map = worker_.latest()) {
    report->keyframes = static_cast<int>(map->keyframes.size());
    report->landmarks = static_cast<int>(map->landmarks.size());
    report->scale = map->scale_source;
    report->map_id = epoch_ + 1;  // each map has an epoch of its own
    if (std::exchange(reported_revision_, map->revision) != map->revision) {
      report->stages.insert(report->stages.end(), map->stages.begin(), map->stages.end());
    }
  }
}

// Goes on from the map that the worker has begun.
void Tracker::Impl::start_map() {
  const TrackingMapPtr map = worker_.latest();
  for (const auto& [id, keyframe] : map->keyframes) {
    records_[keyframe.frame_index] = {keyframe.stamp_ns, id, Rigid3()};
  }
  reference_ = map->keyframes.rbegin()->first;
  camera_from_reference_ = Rigid3();
  motion_.reset();
  frames_lost_ = 0;
  state_ = State::kTracking;
}

void Tracker::Impl::bootstrap(const Frame& frame, FrameReport* report) {
  // On a thread, this is what became of an earlier frame, and the frames since then are passed over.
  std::optional<BootstrapReport> known = bootstrap_job_.take(epoch_);
  if (!known || !known->map) {
    bootstrap_job_.offer(frame, epoch_, &worker_);
    if (!known) known = bootstrap_job_.take(epoch_);
  }
  if (known) bootstrap_ = std::move(*known);
  report->reason = bootstrap_.reason;
  report->reason_text = bootstrap_.text;
  report->matches = bootstrap_.matches;
  report->inliers = bootstrap_.inliers;
  report->median_parallax_deg = bootstrap_.median_parallax_deg;
  report->motions = bootstrap_.motions;
  if (!bootstrap_.map) return;
  const BootstrapReport bootstrap = std::exchange(bootstrap_, BootstrapReport());
  start_map();
  // Against the map just made: the pose gets its covariance and the whole map's points.
  const TrackingMapPtr map = worker_.latest();
  const ResectionReport resection =
      resector_.resect(frame, *map, reference_, map->keyframes.at(reference_).camera_from_map);
  if (!resection.success) {
    reset();
    report->reason = resection.reason;
    report->reason_text = "the new map does not hold: " + resection.text;
    return;
  }
  if (!bootstrap.still_background.empty()) object_finder_.start(bootstrap, frame, resection);
  const std::string text = report->reason_text;
  describe(resection, report);
  report->reason_text = text;
  report->is_keyframe = map->keyframes.at(reference_).frame_index == frame.index;
  if (report->is_keyframe) return;
  camera_from_reference_ =
      resection.camera_from_map * map->keyframes.at(reference_).camera_from_map.inverse();
  records_[frame.index] = {frame.stamp_ns, reference_, camera_from_reference_};
}

void Tracker::Impl::describe(const ResectionReport& resection, FrameReport* report) const {
  report->reason = resection.reason;
  report->reason_text = resection.text;
  report->matches = resection.matches;
  report->inliers = resection.inliers;
  report->reprojection_rms_px = resection.rms_px;
  report->motions.clear();
  for (const int f : resection.matched) report->seen[f].fate = SeenFeature::Fate::kOutlier;
  for (const FrameObservation& o : resection.observations) {
    report->seen[o.feature].fate = SeenFeature::Fate::kInlier;
    report->seen[o.feature].landmark = o.landmark;
  }
  if (!resection.success) return;
  report->map_from_camera = resection.camera_from_map.inverse();
  report->covariance = resection.covariance;
}

void Tracker::Impl::track(const Frame& frame, FrameReport* report) {
  const TrackingMapPtr map = worker_.latest();
  ResectionReport resection;
  {
    const StageTimer timer(report->stages, "resect");
    Rigid3 reference_from_map;
    if (frames_lost_ == 0 && map->camera_from_map(reference_, &reference_from_map)) {
      const Rigid3 last = camera_from_reference_ * reference_from_map;
      resection = resector_.resect(
          frame, *map, map->keyframes.count(reference_) ? reference_ : map->keyframes.rbegin()->first,
          motion_ ? *motion_ * last : last);
    }
    if (!resection.success) {
      ResectionReport elsewhere = resector_.relocalize(
          frame, *map, options_.resection.relocalization_keyframes, &relocalization_cursor_);
      if (elsewhere.success || resection.text.empty()) resection = std::move(elsewhere);
    }
  }
  describe(resection, report);
  if (resection.success) {
    accept(frame, *map, resection, report);
  } else {
    lose(report);
  }
}

void Tracker::Impl::lose(FrameReport* report) {
  state_ = State::kLost;
  motion_.reset();
  const TrackingMapPtr map = worker_.latest();
  ++frames_lost_;
  if (frames_lost_ > 1) {
    // No longer the image that lost it: what counts is that none of the keyframes it was compared with fits.
    report->reason = Reason::kRelocalising;
    report->reason_text = "lost for " + std::to_string(frames_lost_) + " images: " + report->reason_text;
  }
  if (frames_lost_ >= options_.young_map_patience && !loaded_ &&
      static_cast<int>(map->keyframes.size()) <= options_.young_map_keyframes) {
    reset();
    report->reason_text += "; the young map is dropped, a new one begun";
  }
}

void Tracker::Impl::accept(const Frame& frame, const TrackingMap& map, const ResectionReport& resection,
                           FrameReport* report) {
  Rigid3 reference_from_map;
  const bool continuous = frames_lost_ == 0 && map.camera_from_map(reference_, &reference_from_map);
  if (continuous) {
    motion_ = resection.camera_from_map * (camera_from_reference_ * reference_from_map).inverse();
  } else {
    motion_.reset();
  }
  frames_lost_ = 0;
  relocalization_cursor_ = 0;
  state_ = State::kTracking;

  reference_ = choose_reference(map, resection);
  camera_from_reference_ = resection.camera_from_map * map.keyframes.at(reference_).camera_from_map.inverse();
  records_[frame.index] = {frame.stamp_ns, reference_, camera_from_reference_};
  object_finder_.follow(frame, map, resection);
  const Overlap overlap = overlap_with(map, reference_, resection, camera_);
  report->median_parallax_deg = overlap.parallax_deg;
  if (!keyframe_policy_.is_due(map, overlap, resection.inliers, worker_.backlog())) return;
  const StageTimer timer(report->stages, "keyframe");
  KeyframeCandidate candidate{frame, reference_, camera_from_reference_, resection.observations};
  if (frame.is_masked) leave_out_occluders(map, camera_, resection.camera_from_map, &candidate);
  report->is_keyframe = worker_.insert(candidate);
  if (!report->is_keyframe) return;
  // Inline, the keyframe is there already and has been adjusted: go on from it.
  const TrackingMapPtr now = worker_.latest();
  if (now->revision != map.revision && now->keyframes.rbegin()->second.frame_index == frame.index) {
    reference_ = now->keyframes.rbegin()->first;
    camera_from_reference_ = Rigid3();
    records_[frame.index] = {frame.stamp_ns, reference_, camera_from_reference_};
    report->map_from_camera = now->keyframes.at(reference_).camera_from_map.inverse();
  }
}

// The keyframe that shares most landmarks with the frame.
KeyframeId Tracker::Impl::choose_reference(const TrackingMap& map, const ResectionReport& resection) const {
  std::unordered_set<LandmarkId> seen;
  for (const FrameObservation& o : resection.observations) seen.insert(o.landmark);
  const auto current = map.keyframes.find(reference_);
  std::vector<KeyframeId> local;
  if (current != map.keyframes.end() && frames_lost_ == 0) {
    local.push_back(reference_);
    for (const KeyframeId id : current->second.covisible) {
      if (static_cast<int>(local.size()) < options_.resection.max_local_keyframes) local.push_back(id);
    }
  }
  const KeyframeId newest = map.keyframes.rbegin()->first;
  if (std::find(local.begin(), local.end(), newest) == local.end()) local.push_back(newest);
  const auto shared = [&](KeyframeId id) {
    const std::vector<LandmarkId>& landmarks = map.keyframes.at(id).landmark_of_feature;
    return std::count_if(landmarks.begin(), landmarks.end(), [&](LandmarkId l) { return seen.count(l) > 0; });
  };
  KeyframeId best = local.front();
  auto most = shared(best);
  const auto consider = [&](KeyframeId id) {
    const auto n = shared(id);
    if (n > most || (n == most && id > best)) most = n, best = id;
  };
  for (const KeyframeId id : local) consider(id);
  if (most == 0) {  // relocalised elsewhere
    for (const auto& entry : map.keyframes) consider(entry.first);
  }
  return best;
}

void Tracker::Impl::reset() {
  ++epoch_;
  worker_.reset(epoch_);
  bootstrap_ = BootstrapReport();
  object_finder_.reset();
  records_.clear();
  state_ = State::kBootstrapping;
  reference_ = -1;
  camera_from_reference_ = Rigid3();
  motion_.reset();
  keyframe_policy_.reset();
  relocalization_cursor_ = 0;
  frames_lost_ = 0;
  unconfirmed_ = false;
  loaded_ = false;
}

std::optional<Map> Tracker::Impl::copy_map() {
  worker_.wait();
  if (!worker_.latest()) return std::nullopt;
  return worker_.mapper().map();
}

void Tracker::Impl::load_map(Map map) {
  // What is tracked from now on is counted from next_index_: the map's own frames come before all of it.
  std::int64_t end = 0;
  for (const auto& entry : map.keyframes()) end = std::max(end, entry.second.frame_index + 1);
  for (const auto& entry : map.removed_keyframes()) end = std::max(end, entry.second.frame_index + 1);
  map.shift_frame_indices(-end);
  reset();
  worker_.restore(map, epoch_);
  loaded_ = true;
  state_ = State::kLost;
  frames_lost_ = 1;
  reference_ = map.keyframes().rbegin()->first;
}

MapOrigin Tracker::Impl::origin() const {
  return {camera_.parameters(), options_.sift.root_sift ? "root_sift" : "sift"};
}

void Tracker::Impl::set_options(const TrackerOptions& options) {
  copy_changeable(options, &options_);
  object_finder_.set_options(options_.segmentation);
  frame_maker_.set_options(options_.sift);
  resector_ = Resector(options_, camera_);
  keyframe_policy_.set_options(options_.mapping, options_.young_map_keyframes);
  bootstrap_job_.set_options(options_);
  worker_.set_options(options_.mapper(camera_.focal()));
}

std::vector<PosedFrame> Tracker::Impl::trajectory() const {
  std::vector<PosedFrame> frames;
  const TrackingMapPtr map = worker_.latest();
  if (!map) return frames;
  std::map<std::int64_t, KeyframeId> keyframe_of_frame;
  for (const auto& [id, link] : map->removed_keyframes) keyframe_of_frame[link.frame_index] = id;
  for (const auto& [id, keyframe] : map->keyframes) keyframe_of_frame[keyframe.frame_index] = id;
  for (const auto& [index, record] : records_) {
    const auto own = keyframe_of_frame.find(index);
    Rigid3 keyframe_from_map;
    if (own != keyframe_of_frame.end() && map->camera_from_map(own->second, &keyframe_from_map)) {
      frames.push_back({index, record.stamp_ns, keyframe_from_map.inverse()});
    } else if (map->camera_from_map(record.reference, &keyframe_from_map)) {
      frames.push_back(
          {index, record.stamp_ns, (record.camera_from_reference * keyframe_from_map).inverse()});
    }
  }
  return frames;
}

bool Tracker::Impl::finish() {
  worker_.wait();
  if (state_ == State::kBootstrapping) {
    const std::optional<BootstrapReport> known = bootstrap_job_.take(epoch_);
    if (!known || !known->map) {
      if (next_index_ != 2) return false;
      const BootstrapReport two_views = bootstrap_job_.bootstrapper().unconfirmed();
      if (!two_views.map) return false;
      worker_.initialize(*two_views.map, epoch_);
      unconfirmed_ = true;
    }
    start_map();
  }
  worker_.mapper().finish();
  worker_.publish_mapper();
  return true;
}

// The best of the keyframes nearest in time; where none of them will do, of all.
ResectionReport Tracker::Impl::resect_near(const Frame& frame, const TrackingMap& map) const {
  std::vector<std::pair<std::int64_t, KeyframeId>> by_time;
  for (const auto& [id, keyframe] : map.keyframes) {
    by_time.emplace_back(std::abs(keyframe.frame_index - frame.index), id);
  }
  std::sort(by_time.begin(), by_time.end());
  ResectionReport best;
  for (std::size_t i = 0; i < by_time.size(); ++i) {
    if (best.success && static_cast<int>(i) >= options_.resection.relocalization_keyframes) break;
    ResectionReport report = resector_.resect(frame, map, by_time[i].second, std::nullopt);
    if (is_better(report, best)) best = std::move(report);
  }
  return best;
}

FrameReport Tracker::Impl::resect_again(std::int64_t frame_index, std::int64_t stamp_ns, const cv::Mat& image,
                                        const cv::Mat& mask) {
  FrameReport report;
  report.stamp_ns = stamp_ns;
  std::optional<Frame> frame;
  if (frame_maker_.has_camera_size(image, &report)) {
    frame = make_frame(frame_index, stamp_ns, image, object_finder_.find_again(image, mask), &report);
  }
  const TrackingMapPtr map = worker_.latest();
  if (frame && map) {
    const ResectionReport resection = resect_near(*frame, *map);
    describe(resection, &report);
    if (resection.success) {
      const KeyframeId reference = choose_reference(*map, resection);
      records_[frame_index] = {
          stamp_ns, reference,
          resection.camera_from_map * map->keyframes.at(reference).camera_from_map.inverse()};
    }
  }
  finish_report(&report);
  return report;
}

Tracker::Tracker(const TrackerOptions& options, const CameraModel& camera, Mapping mapping,
                 std::function<void()> before_mapping) {
  options.validate();
  impl_ = std::make_unique<Impl>(options, camera, mapping, std::move(before_mapping));
}

Tracker::~Tracker() = default;

FrameReport Tracker::process(std::int64_t stamp_ns, const cv::Mat& image, const cv::Mat& mask) {
  return impl_->process(stamp_ns, image, mask);
}

void Tracker::wait() { impl_->worker().wait(); }

void Tracker::reset() { impl_->reset(); }

void Tracker::set_options(const TrackerOptions& options) {
  options.validate();
  impl_->set_options(options);
}

std::uint32_t Tracker::epoch() const { return impl_->epoch(); }

std::optional<Map> Tracker::copy_map() { return impl_->copy_map(); }

void Tracker::load_map(Map map) { impl_->load_map(std::move(map)); }

MapOrigin Tracker::origin() const { return impl_->origin(); }

std::uint64_t Tracker::revision() const {
  const TrackingMapPtr map = impl_->worker().latest();
  return map ? map->revision : 0;
}

std::shared_ptr<const MapSnapshot> Tracker::snapshot() const { return snapshot_of(impl_->worker().latest()); }

std::vector<PosedFrame> Tracker::trajectory() const { return impl_->trajectory(); }

bool Tracker::finish() { return impl_->finish(); }

FrameReport Tracker::resect_again(std::int64_t frame_index, std::int64_t stamp_ns, const cv::Mat& image,
                                  const cv::Mat& mask) {
  return impl_->resect_again(frame_index, stamp_ns, image, mask);
}

const Map& Tracker::map() const { return impl_->worker().mapper().map(); }

bool Tracker::is_unconfirmed() const { return impl_->is_unconfirmed(); }

}  // namespace mono_pose_tracker
