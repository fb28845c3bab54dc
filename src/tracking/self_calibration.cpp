#include "tracking/self_calibration.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "common/formatted.h"

namespace mono_pose_tracker {
namespace {

// Enough for a focal length to show, where it does, and few enough to be tracked in some seconds.
constexpr int kEarlyKeyframes = 25;
// From 30 % off one is there in two or three.
constexpr int kMaxEarlyRuns = 5, kMaxRuns = 4;
// The early ones need to be near only.
constexpr double kNearChange = 0.01;
// Few views leave steps to and fro of one per cent about the right camera; what still goes farther is none.
constexpr double kUnsettledChange = 0.02;  // of the focal length; of the image's longer side at its edge
// What a feature is located to, and a third of the one per cent that a refined focal length is good for.
constexpr double kSettledShiftPx = 1, kSettledChange = 0.003;
// On parts of recordings the images ask for focal lengths up to 6 % off a right calibration: rolling shutter
// and distortion that is not modelled act on all features alike, so that the covariance misses them. A
// stabiliser's crop, zoom, binning or another camera's file are off by more.
constexpr double kWrongGuess = 0.05;  // of a focal length that was guessed: corrected from here on
constexpr double kDoubtfulChange = 0.1, kDoubtfulSigmas = 10;
// What a part of the recording says against it counts where it could tell.
constexpr double kTellingSigmas = 3, kLeastOfChange = 0.5;

CameraParameters with_focal(CameraParameters camera, double factor) {
  camera.fx *= factor;
  camera.fy *= factor;
  return camera;
}

// Half way from one to the other.
CameraParameters between(const CameraParameters& a, CameraParameters b) {
  for (double CameraParameters::*value :
       {&CameraParameters::fx, &CameraParameters::fy, &CameraParameters::cx, &CameraParameters::cy}) {
    b.*value = 0.5 * (a.*value + b.*value);
  }
  for (std::size_t i = 0; i < b.distortion.size(); ++i) {
    b.distortion[i] = 0.5 * (b.distortion[i] + (i < a.distortion.size() ? a.distortion[i] : 0));
  }
  return b;
}

// That it is off is seen before it is known well enough to be refined.
double change_asked(const CameraRefinement& r) { return r.focal_observable ? r.focal_change : r.focal_asked; }

// What the images ask for, and one standard deviation.
struct Asked {
  double change = 0, sigma = 0;
};

Asked focal_asked(const CameraRefinement& r) { return {change_asked(r), r.focal_sigma}; }

Asked distortion_asked(const CameraRefinement& r) { return {r.distortion_asked_px, r.distortion_sigma_px}; }

// A wrong camera asks for the same in every part of the recording; what moves by itself, such as a face that
// talks, for something else in each.
bool is_asked_by_all_parts(CameraRefinementOptions options, const CameraParameters& camera, const Map& map,
                           const std::function<Asked(const CameraRefinement&)>& asked_by, double change) {
  for (const double begin : {0.0, 0.25, 0.5}) {
    options.begin = begin;
    options.end = begin + 0.5;
    const Asked asked = asked_by(refine_camera(options, camera, map));
    const bool tells = kTellingSigmas * asked.sigma < std::abs(change);
    if (tells && asked.change / change < kLeastOfChange) return false;
  }
  return true;
}

// By how much the images contradict the focal length, relative; 0 where they do not, or not clearly.
double contradiction(const CameraRefinementOptions& options, const CameraParameters& camera, const Map& map,
                     const CameraRefinement& r, double least_change) {
  const double change = change_asked(r);
  const bool is_clear = std::abs(change) >= std::max(least_change, kDoubtfulSigmas * r.focal_sigma);
  return is_clear && is_asked_by_all_parts(options, camera, map, focal_asked, change) ? change : 0;
}

// How far the camera's distortion moves the corners of the image, beyond what it moves the points half way to
// them [px]; 0 of a pinhole.
double corner_distortion_px(const CameraModel& camera) {
  const CameraParameters& p = camera.parameters();
  const double radius = 0.5 * std::hypot(p.width / p.fx, p.height / p.fy);
  const double at_corner = p.distortion_model == "equidistant" ? std::tan(std::min(radius, 1.5)) : radius;
  const Eigen::Vector2d center(p.cx, p.cy);
  Eigen::Vector2d corner, half;
  if (!camera.project({at_corner, 0, 1}, &corner) || !camera.project({0.5 * at_corner, 0, 1}, &half))
    return 0;
  return (corner - center).norm() - 2 * (half - center).norm();
}

double least_distortion_px(const DistortionDoubtOptions& limits, const CameraParameters& camera) {
  return limits.min_share * 0.5 * std::hypot(camera.width, camera.height);
}

std::string doubt_of_distortion(const CameraRefinementOptions& options, const DistortionDoubtOptions& limits,
                                const CameraParameters& camera, const Map& map, const CameraRefinement& r) {
  const double change = r.distortion_asked_px;
  if (!(std::abs(change) >=
        std::max(least_distortion_px(limits, camera), limits.min_sigmas * r.distortion_sigma_px)))
    return "";
  if (!is_asked_by_all_parts(options, camera, map, distortion_asked, change)) return "";
  // Of what the calibration has, a third at most is left.
  constexpr double kLeftOfRectified = 1.0 / 3;
  const double given = corner_distortion_px(CameraModel(camera));
  const bool looks_rectified = std::abs(given + change) < kLeftOfRectified * std::abs(given);
  return formatted(
             "the calibration does not fit the images, and its distortion is the suspect: at the corners of "
             "the image it is off by %.0f px. ",
             std::abs(change)) +
         (looks_rectified ? "The images look rectified already: set rectified to true (--rectified true, "
                            "rectified:=true); otherwise calibrate the camera anew"
                          : "Calibrate the camera anew for this size of image, or try --refine-camera");
}

class Calibrator {
 public:
  Calibrator(const CameraParameters& start, CalibrationSource source, const CameraRefinementOptions& options,
             const TrackWithCamera& track)
      : start_(start),
        source_(source),
        camera_(start),
        tracked_with_(start),
        options_(options),
        track_(track) {}

  SelfCalibration run() {
    const bool is_found = approach();
    SelfCalibration result;
    if (!is_cancelled()) result = finish(is_found);
    result.source = is_refined_ ? CalibrationSource::kRefined : source_;
    result.camera = camera_;
    result.runs = runs_;
    if (is_interrupted_) leave_unsettled(&result);
    return result;
  }

 private:
  // The map that there is holds to the camera that it was tracked with, which may be a trial that no map has
  // asked for.
  void leave_unsettled(SelfCalibration* result) const {
    const CalibrationSource of_trial = tracked_with_ == start_ ? source_ : CalibrationSource::kGuessed;
    result->source = was_refined_ ? CalibrationSource::kRefined : of_trial;
    result->camera = tracked_with_;
    result->is_near = false;
    result->warnings = {
        "the refinement of the camera was interrupted: its focal length is not settled; let it come to its "
        "end"};
  }

  const Map* track(int max_keyframes) {
    ++runs_;
    tracked_with_ = camera_;
    was_refined_ = is_refined_;
    return track_(camera_, max_keyframes);
  }

  // Another run would read no image, and the map that there is would be lost to it. What comes later than all
  // questions interrupts nothing here.
  bool is_cancelled() {
    is_interrupted_ = is_interrupted_ || (options_.cancel && options_.cancel());
    return is_interrupted_;
  }

  bool take(const CameraRefinement& refinement) {
    if (!refinement.focal_observable) return false;
    camera_ = refinement.camera;
    is_refined_ = true;
    return true;
  }

  // Near to the camera, by the beginning of the recording. False where no focal length gives a map.
  bool approach() {
    Approach best = approach_from(1);
    // With a focal length that is too long the map may be of another geometry, with depths and turns the
    // other way round, which asks for a longer one still: what runs away is begun anew from the other side.
    for (const double factor : {0.7, 1.4}) {
      if (!best.has_map || best.is_settled || is_cancelled()) break;
      const Approach other = approach_from(factor);
      if (other.is_refined && std::abs(other.last_change) < std::abs(best.last_change)) best = other;
    }
    for (const double factor : {0.8, 1.25, 0.64, 1.56}) {
      if (!best.has_map && !is_cancelled()) best = approach_from(factor);
    }
    camera_ = best.has_map ? best.camera : start_;
    is_refined_ = best.is_refined;
    return best.has_map;
  }

  // Where the early runs lead to.
  struct Approach {
    bool has_map = false, is_settled = false, is_refined = false;
    double last_change = 0;  // relative, of the focal length: what the last map asks for
    CameraParameters camera;
  };

  Approach approach_from(double factor) {
    camera_ = with_focal(start_, factor);
    is_refined_ = false;
    Approach result;
    for (int i = 0; i < kMaxEarlyRuns; ++i) {
      const Map* map = track(kEarlyKeyframes);
      if (!map) break;
      const CameraRefinement r = refine_camera(options_, camera_, *map);
      const double before = std::exchange(result.last_change, change_asked(r));
      result.has_map = true;
      // What cannot be told from the first map on is left to all of the recording.
      result.is_settled = std::abs(result.last_change) < kNearChange || !(r.focal_observable || is_refined_);
      const bool runs_away =
          before * result.last_change > 0 && std::abs(result.last_change) >= std::abs(before);
      if (is_cancelled() || !take(r) || result.is_settled || runs_away) break;
    }
    result.camera = camera_;
    result.is_refined = is_refined_;
    return result;
  }

  // To where it stays, by all of the recording.
  SelfCalibration finish(bool is_found) {
    SelfCalibration result;
    double last_change = 0;
    for (int i = 0; i < kMaxRuns; ++i) {
      const Map* map = track(0);
      if (!map) {
        if (is_found && !is_cancelled())
          result.warnings = {"the camera could not be refined: the whole recording gives no map"};
        return result;
      }
      result.last = refine_camera(options_, camera_, *map);
      if (is_cancelled()) return result;
      if (!result.last.focal_observable && is_refined_) {
        // The beginning seemed to tell, all of it does not. (One run more, if this was the last.)
        camera_ = start_;
        is_refined_ = false;
        i = std::min(i, kMaxRuns - 2);
        continue;
      }
      if (!result.last.focal_observable && i + 1 < kMaxRuns && guess_anew(result.last, *map)) continue;
      if (!result.last.focal_observable) {
        result.warnings.push_back(not_observable(result.last));
        return result;
      }
      is_refined_ = true;
      if (is_settled(result.last) || i + 1 == kMaxRuns) break;
      // What a camera that is a little too long made of the map asks for one that is a little too short, and
      // that for the first again, where few views tell.
      const bool turns_back = result.last.focal_change * last_change < 0;
      camera_ = turns_back ? between(camera_, result.last.camera) : result.last.camera;
      last_change = result.last.focal_change;
    }
    result.is_near = std::abs(result.last.focal_change) < kUnsettledChange &&
                     result.last.max_shift_px < kUnsettledChange * std::max(camera_.width, camera_.height);
    if (!is_settled(result.last)) result.warnings.push_back(not_settled(result.last, result.is_near));
    return result;
  }

  // What the images ask for may be too uncertain to be called refined, and is still the better guess where
  // they contradict the one that was made.
  bool guess_anew(const CameraRefinement& r, const Map& map) {
    if (source_ != CalibrationSource::kGuessed) return false;
    const double change = contradiction(options_, camera_, map, r, kWrongGuess);
    if (change == 0 || is_cancelled()) return false;
    camera_ = with_focal(camera_, 1 + change);
    return true;
  }

  static bool is_settled(const CameraRefinement& r) {
    return std::abs(r.focal_change) < kSettledChange && r.max_shift_px < kSettledShiftPx;
  }

  static std::string not_settled(const CameraRefinement& r, bool is_near) {
    return formatted(
        "%s: one more run would change the focal length by %+.1f %%, and move the image's edge by %.1f px",
        is_near ? "the camera settled nearly" : "the camera did not settle", 100 * r.focal_change,
        r.max_shift_px);
  }

  std::string not_observable(const CameraRefinement& r) const {
    const std::string left =
        camera_.fx == start_.fx
            ? "it stays as it was given"
            : formatted(
                  "the guess of %.0f px contradicts the images, and %.0f px, which they fit better, is "
                  "one too",
                  start_.fx, camera_.fx);
    const std::string known =
        std::isfinite(r.focal_sigma)
            ? formatted(
                  " (one standard deviation is %.2f %%, less than %.2f %% is wanted, of a camera that "
                  "can be)",
                  100 * r.focal_sigma, 100 * kMaxFocalSigma)
            : "";
    return "the focal length is not observable in this motion" + known + ": " + left +
           "; views from more sides, and turned, would tell";
  }

  const CameraParameters start_;
  const CalibrationSource source_;
  CameraParameters camera_, tracked_with_;
  const CameraRefinementOptions& options_;
  const TrackWithCamera& track_;
  bool is_refined_ = false;      // by an adjustment of what was tracked before
  bool was_refined_ = false;     // as the last run began
  bool is_interrupted_ = false;  // by whoever cancels
  int runs_ = 0;
};

}  // namespace

SelfCalibration calibrate_by_tracking(const CameraParameters& start, CalibrationSource source,
                                      const CameraRefinementOptions& options, const TrackWithCamera& track) {
  return Calibrator(start, source, options, track).run();
}

std::string doubt_of_calibration(const CameraRefinementOptions& options, const CameraParameters& camera,
                                 const Map& map, const DistortionDoubtOptions& distortion) {
  // Of all parameters together the images may ask for more than of the focal length alone.
  CameraRefinementOptions first = options;
  first.least_focal_change = 0.5 * kDoubtfulChange;
  first.least_distortion_px = least_distortion_px(distortion, camera);
  const CameraRefinement r = refine_camera(first, camera, map);
  const std::string doubt = doubt_of_distortion(options, distortion, camera, map, r);
  if (!doubt.empty()) return doubt;
  const double change = contradiction(options, camera, map, r, kDoubtfulChange);
  if (change == 0) return "";
  return formatted(
      "the calibration is doubtful: the images fit a focal length of %.0f px better than the %.0f px "
      "that were given (%+.0f %%); calibrate anew for this size of image, or try --refine-camera; where it "
      "is right the map is wrong, as when more than one thing moves: give masks (--masks)",
      camera.fx * (1 + change), camera.fx, 100 * change);
}

}  // namespace mono_pose_tracker
