#include "mono_pose_tracker/tracking/tracker.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <unordered_set>

#include "mono_pose_tracker/common/median.h"
#include "mono_pose_tracker/features/marker.h"
#include "mono_pose_tracker/features/sift.h"
#include "mono_pose_tracker/geometry/triangulation.h"
#include "mono_pose_tracker/segmentation/mask_cleaning.h"
#include "mono_pose_tracker/segmentation/motion_mask.h"
#include "mono_pose_tracker/segmentation/segmenter.h"
#include "mono_pose_tracker/tracking/bootstrapper.h"
#include "mono_pose_tracker/tracking/mapping_worker.h"
#include "mono_pose_tracker/tracking/options_table.h"
#include "mono_pose_tracker/tracking/resector.h"
#include "occlusion.h"

namespace mono_pose_tracker {

namespace {

constexpr double kDegree = M_PI / 180;

// Where a posed frame stands: it moves with its reference keyframe.
struct FrameRecord {
  std::int64_t stamp_ns = 0;
  KeyframeId reference = -1;
  Rigid3 camera_from_reference;
};

// How a frame relates to a keyframe.
struct Overlap {
  double parallax_deg = 0;  // median, of the landmarks that the frame sees
  double in_view = 1;       // share of the keyframe's landmarks that the frame could see
};

}  // namespace

class Tracker::Impl {
 public:
  Impl(const TrackerOptions& options, const CameraModel& camera, Mapping mapping,
       std::function<void()> before_mapping)
      : options_(options),
        camera_(camera),
        extractor_(make_sift_extractor(options.sift)),
        segmenter_(options.segmentation),
        motion_mask_(options.segmentation),
        resector_(options, camera),
        worker_(options, camera, mapping == Mapping::kThreaded, std::move(before_mapping)) {}

  FrameReport process(std::int64_t stamp_ns, const cv::Mat& image, const cv::Mat& mask);
  void reset();
  void set_options(const TrackerOptions& options);
  std::uint32_t epoch() const { return epoch_; }
  std::optional<Map> copy_map();
  void load_map(Map map);
  MapOrigin origin() const;
  std::shared_ptr<const MapSnapshot> snapshot() const;
  std::vector<PosedFrame> trajectory() const;
  bool finish();
  FrameReport resect_again(std::int64_t frame_index, std::int64_t stamp_ns, const cv::Mat& image,
                           const cv::Mat& mask);

  MappingWorker& worker() { return worker_; }
  const MappingWorker& worker() const { return worker_; }
  bool is_unconfirmed() const { return unconfirmed_; }

 private:
  cv::Mat clearance(const cv::Mat& mask) const;
  Segmentation segment(const cv::Mat& image, const cv::Mat& given);
  Segmentation segment_again(const cv::Mat& image, const cv::Mat& given);
  bool looks_for_motion(const cv::Mat& given) const;
  static std::vector<cv::Point2f> object_pixels(const Frame& frame, const ResectionReport& resection);
  void start_motion(const BootstrapReport& bootstrap, const Frame& frame, const ResectionReport& resection);
  void follow_motion(const Frame& frame, const TrackingMap& map, const ResectionReport& resection);
  bool has_camera_size(const cv::Mat& image, FrameReport* report) const;
  void leave_out_occluders(const TrackingMap& map, const Rigid3& camera_from_map,
                           KeyframeCandidate* candidate) const;
  std::optional<Frame> make_frame(std::int64_t index, std::int64_t stamp_ns, const cv::Mat& image,
                                  const Segmentation& segmentation, FrameReport* report);
  void bootstrap(const Frame& frame, FrameReport* report);
  void track(const Frame& frame, FrameReport* report);
  void lose(FrameReport* report);
  void accept(const Frame& frame, const TrackingMap& map, const ResectionReport& resection,
              FrameReport* report);
  Overlap overlap_with(const TrackingMap& map, KeyframeId id, const ResectionReport& resection) const;
  ResectionReport resect_near(const Frame& frame, const TrackingMap& map) const;
  KeyframeId choose_reference(const TrackingMap& map, const ResectionReport& resection) const;
  bool is_keyframe_due(const TrackingMap& map, const Overlap& overlap, int inliers);
  void start_map();
  void describe(const ResectionReport& resection, FrameReport* report) const;
  void finish_report(FrameReport* report);

  TrackerOptions options_;
  const CameraModel camera_;
  std::unique_ptr<FeatureExtractor> extractor_;
  Segmenter segmenter_;
  MotionMask motion_mask_;
  Resector resector_;
  MappingWorker worker_;

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
  std::optional<Rigid3> motion_;     // camera now from camera one frame ago
  KeyframeId newest_keyframe_ = -1;  // when the last frame came
  int most_inliers_ = 0;             // of the frames since that keyframe
  int frames_lost_ = 0;
  Rigid3 motion_pose_;  // camera_from_map from which the object's movement is counted
  std::size_t relocalization_cursor_ = 0;

  std::map<std::int64_t, FrameRecord> records_;  // by frame index
};

bool Tracker::Impl::has_camera_size(const cv::Mat& image, FrameReport* report) const {
  if (image.cols == camera_.width() && image.rows == camera_.height()) return true;
  char text[128];
  std::snprintf(text, sizeof text, "image is %dx%d, the camera %dx%d", image.cols, image.rows,
                camera_.width(), camera_.height());
  report->reason = Reason::kImageSizeMismatch;
  report->reason_text = text;
  return false;
}

std::optional<Frame> Tracker::Impl::make_frame(std::int64_t index, std::int64_t stamp_ns,
                                               const cv::Mat& image, const Segmentation& segmentation,
                                               FrameReport* report) {
  report->mask = segmentation.mask;
  report->segmentation = segmentation.method;
  if (segmentation.reason != Reason::kOk) {
    report->reason = segmentation.reason;
    report->reason_text = segmentation.text;
    return std::nullopt;
  }
  cv::Mat gray = image;
  if (image.channels() == 3) cv::cvtColor(image, gray, cv::COLOR_BGR2GRAY);
  Frame frame;
  frame.index = index;
  frame.stamp_ns = stamp_ns;
  FeatureSet features;
  {
    const StageTimer timer(report->stages, "features");
    extractor_->extract(gray, clearance(segmentation.mask), &features);
  }
  // Only the views that begin a map set its scale.
  if (options_.scale.marker_size > 0 && state_ == State::kBootstrapping) {
    const StageTimer timer(report->stages, "marker");
    const ScaleOptions& scale = options_.scale;
    for (const Eigen::Vector2d& corner : find_marker(gray, scale.marker_dictionary, scale.marker_id)) {
      frame.marker.push_back(camera_.bearing(corner));
    }
  }
  const StageTimer timer(report->stages, "undistort");
  frame.image = make_image_features(std::move(features), image, camera_);
  frame.is_masked = !segmentation.mask.empty();
  report->features = frame.image->size();
  for (const Feature& feature : frame.image->set.features) report->seen.push_back({feature.pixel, {}, -1});
  return frame;
}

// Given no mask, an object may be found by its motion.
bool Tracker::Impl::looks_for_motion(const cv::Mat& given) const {
  const std::string& method = options_.segmentation.method;
  return method == "motion" || (method == "auto" && given.empty());
}

Segmentation Tracker::Impl::segment(const cv::Mat& image, const cv::Mat& given) {
  Segmentation segmentation = segmenter_.segment(image, given);
  if (!looks_for_motion(given)) return segmentation;
  // Once there is a map without two motions, none will be looked for.
  if (state_ != State::kBootstrapping && !motion_mask_.is_started()) return segmentation;
  motion_mask_.watch(image);
  if (motion_mask_.is_started()) {
    segmentation.mask = given.empty() ? motion_mask_.mask() : motion_mask_.mask() & segmentation.mask;
    segmentation.method = "motion";
  }
  return segmentation;
}

Segmentation Tracker::Impl::segment_again(const cv::Mat& image, const cv::Mat& given) {
  Segmentation segmentation = segmenter_.segment_again(image, given);
  if (!looks_for_motion(given) || !motion_mask_.is_started()) return segmentation;
  const cv::Mat mask = motion_mask_.mask_of(image);
  segmentation.mask = given.empty() ? mask : mask & segmentation.mask;
  segmentation.method = "motion";
  return segmentation;
}

std::vector<cv::Point2f> Tracker::Impl::object_pixels(const Frame& frame, const ResectionReport& resection) {
  std::vector<cv::Point2f> pixels;
  for (const FrameObservation& o : resection.observations) {
    const Eigen::Vector2f& pixel = frame.image->set.features[o.feature].pixel;
    pixels.emplace_back(pixel.x(), pixel.y());
  }
  return pixels;
}

void Tracker::Impl::start_motion(const BootstrapReport& bootstrap, const Frame& frame,
                                 const ResectionReport& resection) {
  motion_mask_.start(object_pixels(frame, resection), bootstrap.still_background,
                     static_cast<int>(frame.index - bootstrap.reference_index), bootstrap.moved_px);
  motion_pose_ = resection.camera_from_map;
}

// Tells the mask where the object was found, and how far it has gone. Noise of the poses is no movement: it
// counts from two pixels on.
void Tracker::Impl::follow_motion(const Frame& frame, const TrackingMap& map,
                                  const ResectionReport& resection) {
  constexpr double kLeastMove = 2;  // px
  if (!motion_mask_.is_started()) return;
  std::vector<double> moved;
  for (const FrameObservation& o : resection.observations) {
    const auto landmark = map.landmarks.find(o.landmark);
    Eigen::Vector2d before;
    if (landmark == map.landmarks.end() || !camera_.project(motion_pose_ * landmark->second, &before))
      continue;
    moved.push_back((frame.image->set.features[o.feature].pixel.cast<double>() - before).norm());
  }
  const double median_moved = median(std::move(moved));
  if (median_moved >= kLeastMove) motion_pose_ = resection.camera_from_map;
  motion_mask_.observe(object_pixels(frame, resection), median_moved >= kLeastMove ? median_moved : 0);
}

// Where features may be; empty: anywhere.
cv::Mat Tracker::Impl::clearance(const cv::Mat& mask) const {
  if (mask.empty()) return mask;
  // What a mask is off by grows with the image: masks are made at a fixed size, or drawn by hand.
  const double size = std::max(1.0, camera_.width() / 640.0);
  return clearance_of(mask, size * options_.segmentation.margin_px, options_.segmentation.margin_scales,
                      kMaskScaleSteps);
}

FrameReport Tracker::Impl::process(std::int64_t stamp_ns, const cv::Mat& image, const cv::Mat& mask) {
  FrameReport report;
  report.stamp_ns = stamp_ns;
  const std::int64_t index = next_index_++;
  std::optional<Frame> frame;
  if (has_camera_size(image, &report)) {
    Segmentation segmentation;
    {
      const StageTimer timer(report.stages, "segment");
      segmentation = segment(image, mask);
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
  std::optional<BootstrapReport> known = worker_.take_bootstrap();
  if (!known || !known->map) {
    worker_.bootstrap(frame);
    if (!known) known = worker_.take_bootstrap();
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
  if (!bootstrap.still_background.empty()) start_motion(bootstrap, frame, resection);
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
  follow_motion(frame, map, resection);
  const Overlap overlap = overlap_with(map, reference_, resection);
  report->median_parallax_deg = overlap.parallax_deg;
  if (!is_keyframe_due(map, overlap, resection.inliers)) return;
  const StageTimer timer(report->stages, "keyframe");
  KeyframeCandidate candidate{frame, reference_, camera_from_reference_, resection.observations};
  if (frame.is_masked) leave_out_occluders(map, resection.camera_from_map, &candidate);
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

// A mask may hold more than the object: a hand before it, say, of which nothing must come into the map.
void Tracker::Impl::leave_out_occluders(const TrackingMap& map, const Rigid3& camera_from_map,
                                        KeyframeCandidate* candidate) const {
  std::unordered_set<LandmarkId> seen;
  for (const FrameObservation& o : candidate->observations) seen.insert(o.landmark);
  std::vector<ExpectedLandmark> expected;
  for (const LandmarkId id : map.keyframes.at(reference_).landmark_of_feature) {
    const auto landmark = map.landmarks.find(id);
    Eigen::Vector2d pixel;
    if (landmark == map.landmarks.end() || seen.count(id) > 0 ||
        !camera_.project(camera_from_map * landmark->second, &pixel) || !camera_.in_image(pixel)) {
      continue;
    }
    expected.push_back({pixel, false});
  }
  const ImageFeatures& image = *candidate->frame.image;
  for (const FrameObservation& o : candidate->observations) {
    expected.push_back({image.set.features[o.feature].pixel.cast<double>(), true});
  }
  std::vector<char> flags = features_to_map(image, expected, camera_.width());
  for (const FrameObservation& o : candidate->observations) flags[o.feature] = 1;
  std::vector<int> new_index(flags.size());
  int kept = 0;
  for (std::size_t i = 0; i < flags.size(); ++i) new_index[i] = flags[i] ? kept++ : -1;
  candidate->frame.image = select_features(image, flags, camera_.width(), camera_.height());
  for (FrameObservation& o : candidate->observations) o.feature = new_index[o.feature];
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

Overlap Tracker::Impl::overlap_with(const TrackingMap& map, KeyframeId id,
                                    const ResectionReport& resection) const {
  Overlap overlap;
  const KeyframeView& keyframe = map.keyframes.at(id);
  const Eigen::Vector3d there = keyframe.camera_from_map.inverse().translation;
  const Eigen::Vector3d here = resection.camera_from_map.inverse().translation;
  std::vector<double> angles;
  for (const FrameObservation& o : resection.observations) {
    const auto landmark = map.landmarks.find(o.landmark);
    if (landmark == map.landmarks.end()) continue;
    angles.push_back(parallax_angle(landmark->second, there, here));
  }
  overlap.parallax_deg = median(std::move(angles)) / kDegree;
  int in_view = 0, landmarks = 0;
  for (const LandmarkId l : keyframe.landmark_of_feature) {
    const auto landmark = map.landmarks.find(l);
    if (landmark == map.landmarks.end()) continue;
    ++landmarks;
    Eigen::Vector2d pixel;
    in_view +=
        camera_.project(resection.camera_from_map * landmark->second, &pixel) && camera_.in_image(pixel);
  }
  if (landmarks > 0) overlap.in_view = static_cast<double>(in_view) / landmarks;
  return overlap;
}

bool Tracker::Impl::is_keyframe_due(const TrackingMap& map, const Overlap& overlap, int inliers) {
  const KeyframeId newest = map.keyframes.rbegin()->first;
  if (newest != newest_keyframe_) most_inliers_ = 0;
  newest_keyframe_ = newest;
  most_inliers_ = std::max(most_inliers_, inliers);
  // One may wait. With more, until they are in the map the next would tell it little - unless the view is
  // about to leave what the map knows.
  const bool urgent = overlap.in_view < 0.5 * options_.mapping.keyframe_overlap ||
                      inliers < 0.5 * options_.mapping.keyframe_found * most_inliers_;
  if (worker_.backlog() > 1 && !urgent) return false;
  // A young map's points were made from little parallax: it wants more views early.
  const bool young = static_cast<int>(map.keyframes.size()) <= options_.young_map_keyframes;
  const double parallax = options_.mapping.keyframe_parallax_deg / (young ? 3 : 1);
  if (overlap.parallax_deg > parallax || overlap.in_view < options_.mapping.keyframe_overlap) return true;
  // Landmarks are found no more though they are in view: another side, another scale or light. Below a tenth
  // of the parallax a new view of them would add nothing.
  return inliers < options_.mapping.keyframe_found * most_inliers_ && overlap.parallax_deg > 0.1 * parallax;
}

void Tracker::Impl::reset() {
  ++epoch_;
  worker_.reset(epoch_);
  bootstrap_ = BootstrapReport();
  motion_mask_.reset();
  records_.clear();
  state_ = State::kBootstrapping;
  reference_ = -1;
  camera_from_reference_ = Rigid3();
  motion_.reset();
  newest_keyframe_ = -1;
  most_inliers_ = 0;
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
  extractor_ = make_sift_extractor(options_.sift);
  resector_ = Resector(options_, camera_);
  worker_.set_options(options_);
}

std::shared_ptr<const MapSnapshot> Tracker::Impl::snapshot() const {
  auto snapshot = std::make_shared<MapSnapshot>();
  const TrackingMapPtr map = worker_.latest();
  if (!map) return snapshot;
  snapshot->epoch = map->epoch;
  snapshot->revision = map->revision;
  std::unordered_set<LandmarkId> known;
  for (const auto& [id, keyframe] : map->keyframes) {
    snapshot->keyframes.push_back({keyframe.stamp_ns, keyframe.camera_from_map.inverse()});
    for (std::size_t f = 0; f < keyframe.landmark_of_feature.size(); ++f) {
      const auto landmark = map->landmarks.find(keyframe.landmark_of_feature[f]);
      if (landmark == map->landmarks.end() || !known.insert(landmark->first).second) continue;
      const cv::Vec3b& rgb = keyframe.image->color_rgb[f];
      snapshot->points.push_back({landmark->second.cast<float>(), rgb[0], rgb[1], rgb[2]});
    }
  }
  return snapshot;
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
    const std::optional<BootstrapReport> known = worker_.take_bootstrap();
    if (!known || !known->map) {
      if (next_index_ != 2) return false;
      const BootstrapReport two_views = worker_.bootstrapper().unconfirmed();
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
  if (has_camera_size(image, &report)) {
    frame = make_frame(frame_index, stamp_ns, image, segment_again(image, mask), &report);
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

std::shared_ptr<const MapSnapshot> Tracker::snapshot() const { return impl_->snapshot(); }

std::vector<PosedFrame> Tracker::trajectory() const { return impl_->trajectory(); }

bool Tracker::finish() { return impl_->finish(); }

FrameReport Tracker::resect_again(std::int64_t frame_index, std::int64_t stamp_ns, const cv::Mat& image,
                                  const cv::Mat& mask) {
  return impl_->resect_again(frame_index, stamp_ns, image, mask);
}

const Map& Tracker::map() const { return impl_->worker().mapper().map(); }

bool Tracker::is_unconfirmed() const { return impl_->is_unconfirmed(); }

}  // namespace mono_pose_tracker
