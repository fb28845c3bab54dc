#include "pipeline/self_calibration.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "common/statistics.h"
#include "common/text.h"

namespace mono_pose_tracker {
namespace {

constexpr SelfCalibrationOptions kCalibration{};

CameraParameters with_focal(CameraParameters camera, double factor) {
  camera.fx *= factor;
  camera.fy *= factor;
  return camera;
}

// The camera half way between two.
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

// The suggested relative change of the focal length. An error shows before it is known well enough for a
// refinement.
double change_asked(const CameraRefinement& r) { return r.focal_observable ? r.focal_change : r.focal_asked; }

// Estimated change of a parameter, with its standard deviation by the covariance.
struct EstimatedChange {
  double change = 0, sigma = 0;
};

using EstimateOf = std::function<EstimatedChange(const CameraRefinement&)>;

EstimatedChange focal_estimate(const CameraRefinement& r) { return {r.focal_asked, r.focal_asked_sigma}; }

EstimatedChange distortion_estimate(const CameraRefinement& r) {
  return {r.distortion_asked_px, r.distortion_sigma_px};
}

CameraRefinementOptions rough(CameraRefinementOptions options, const CalibrationDoubtOptions& limits) {
  options.max_landmarks = std::min(options.max_landmarks, limits.landmarks);
  options.function_tolerance = limits.rough_tolerance;
  return options;
}

// Whether the images show a change beyond the tolerated one: each part of the recording is estimated by
// itself and excluded in turn.
bool is_shown(const CameraRefinementOptions& options, const CalibrationDoubtOptions& limits,
              const CameraParameters& camera, const Map& map, const EstimateOf& estimate_of, double change,
              double tolerated) {
  const int keyframes = std::min(static_cast<int>(map.keyframes().size()), options.max_keyframes);
  const int count = std::min(limits.max_parts, keyframes / limits.part_keyframes);
  CameraRefinementOptions of_part = rough(options, limits);
  of_part.least_focal_change = of_part.least_distortion_px = std::numeric_limits<double>::infinity();
  const auto estimate_at = [&](int i) {
    of_part.begin = static_cast<double>(i) / count;
    of_part.end = (i + 1.0) / count;
    return estimate_of(refine_camera(of_part, camera, map));
  };
  double information = 0;
  for (int i = 0; i < count; ++i) information += std::pow(estimate_at(i).sigma, -2);
  // The standard deviation is at least that of the parts: often the rest need not be estimated.
  const double sigma = 1 / std::sqrt(information);
  if (!exceeds(change, std::vector<double>(count, change), sigma, tolerated, limits)) return false;
  of_part.is_part_excluded = true;
  std::vector<double> without_part;
  for (int i = 0; i < count; ++i) {
    const EstimatedChange rest = estimate_at(i);
    if (!std::isfinite(rest.sigma)) return false;
    without_part.push_back(rest.change);
  }
  return exceeds(change, without_part, sigma, tolerated, limits);
}

// Relative contradiction between images and focal length; 0 where there is none, or none that is significant.
double contradiction(const CameraRefinementOptions& options, const CalibrationDoubtOptions& limits,
                     const CameraParameters& camera, const Map& map, const CameraRefinement& r,
                     double least_change) {
  const double change = change_asked(r);
  const bool is_clear =
      std::abs(change) >= least_change && change * r.focal_asked > 0 &&
      is_shown(options, limits, camera, map, focal_estimate, r.focal_asked, limits.tolerated_change);
  return is_clear ? change : 0;
}

// Displacement of the image corners by distortion, beyond that of the points half way to them [px]; 0 for a
// pinhole camera.
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

double half_diagonal_px(const CameraParameters& camera) {
  return 0.5 * std::hypot(camera.width, camera.height);
}

CameraParameters without_distortion(CameraParameters camera) {
  camera.distortion_model = "plumb_bob";
  camera.distortion.clear();
  return camera;
}

std::string doubt_of_distortion(const CameraRefinementOptions& options, const CalibrationDoubtOptions& limits,
                                const CameraParameters& camera, const Map& map, double change) {
  const double reach = half_diagonal_px(camera), least = limits.min_distortion_share * reach;
  if (std::abs(change) < least) return "";
  const double given = corner_distortion_px(CameraModel(camera));
  const bool is_better_without =
      std::abs(given) >= least &&
      p_value_of_worse_fit(rough(options, limits), camera, without_distortion(camera), map,
                           limits.min_extra_cost) < limits.significance;
  if (!is_better_without &&
      !is_shown(options, limits, camera, map, distortion_estimate, change, limits.tolerated_change * reach))
    return "";
  const bool looks_rectified = std::abs(given + change) < limits.left_of_rectified * std::abs(given);
  return formatted(
             "the calibration does not fit the images, probably because of its distortion: it is off by %.0f "
             "px at the corners of the image. ",
             std::abs(change)) +
         (looks_rectified ? "The images look rectified already: set rectified to true (--rectified true, "
                            "rectified:=true); otherwise calibrate the camera again"
                          : "Calibrate the camera again for this image size, or try --refine-camera");
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
  // The last map belongs to the camera with which it was tracked, which may be a trial.
  void leave_unsettled(SelfCalibration* result) const {
    const CalibrationSource of_trial = tracked_with_ == start_ ? source_ : CalibrationSource::kGuessed;
    result->source = was_refined_ ? CalibrationSource::kRefined : of_trial;
    result->camera = tracked_with_;
    result->is_near = false;
    result->warnings = {
        "the refinement of the camera was interrupted: its focal length has not converged; let it finish"};
  }

  const Map* track(int max_keyframes) {
    ++runs_;
    tracked_with_ = camera_;
    was_refined_ = is_refined_;
    return track_(camera_, max_keyframes);
  }

  // Stops before another run, which would read no image and lose the last map. A cancellation after all runs
  // has no effect here.
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

  // Approaches the camera with the beginning of the recording. Returns false where no focal length gives a
  // map.
  bool approach() {
    Approach best = approach_from(1);
    // With too long a focal length the map may be depth-reversed, which suggests an even longer one: a
    // diverging focal length is started again from the other side.
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

  // Result of the early runs.
  struct Approach {
    bool has_map = false, is_settled = false, is_refined = false;
    double last_change = 0;  // relative change of the focal length suggested by the last map
    CameraParameters camera;
  };

  Approach approach_from(double factor) {
    camera_ = with_focal(start_, factor);
    is_refined_ = false;
    Approach result;
    for (int i = 0; i < kCalibration.max_early_runs; ++i) {
      const Map* map = track(kCalibration.early_keyframes);
      if (!map) break;
      const CameraRefinement r = refine_camera(options_, camera_, *map);
      const double before = std::exchange(result.last_change, change_asked(r));
      result.has_map = true;
      // Parameters that the first map cannot determine are left to the whole recording.
      result.is_settled =
          std::abs(result.last_change) < kCalibration.near_change || !(r.focal_observable || is_refined_);
      const bool runs_away =
          before * result.last_change > 0 && std::abs(result.last_change) >= std::abs(before);
      if (is_cancelled() || !take(r) || result.is_settled || runs_away) break;
    }
    result.camera = camera_;
    result.is_refined = is_refined_;
    return result;
  }

  // Iterates on the whole recording until the camera converges.
  SelfCalibration finish(bool is_found) {
    SelfCalibration result;
    double last_change = 0;
    for (int i = 0; i < kCalibration.max_runs; ++i) {
      const Map* map = track(0);
      if (!map) {
        if (is_found && !is_cancelled())
          result.warnings = {"the camera could not be refined: the whole recording gives no map"};
        return result;
      }
      result.last = refine_camera(options_, camera_, *map);
      if (is_cancelled()) return result;
      if (!result.last.focal_observable && is_refined_) {
        // The beginning suggested a change that the whole recording does not. (One more run, if this was the
        // last.)
        camera_ = start_;
        is_refined_ = false;
        i = std::min(i, kCalibration.max_runs - 2);
        continue;
      }
      if (!result.last.focal_observable && i + 1 < kCalibration.max_runs && guess_anew(result.last, *map))
        continue;
      if (!result.last.focal_observable) {
        result.warnings.push_back(not_observable(result.last));
        return result;
      }
      is_refined_ = true;
      if (is_settled(result.last) || i + 1 == kCalibration.max_runs) break;
      // With few views the estimate oscillates: a slightly long camera gives a map that suggests a slightly
      // short one, and vice versa.
      const bool turns_back = result.last.focal_change * last_change < 0;
      camera_ = turns_back ? between(camera_, result.last.camera) : result.last.camera;
      last_change = result.last.focal_change;
    }
    result.is_near =
        std::abs(result.last.focal_change) < kCalibration.unsettled_change &&
        result.last.max_shift_px < kCalibration.unsettled_change * std::max(camera_.width, camera_.height);
    if (!is_settled(result.last)) result.warnings.push_back(not_settled(result.last, result.is_near));
    return result;
  }

  // An estimate may be too uncertain for a refinement, and still be better than a guess that the images
  // contradict.
  bool guess_anew(const CameraRefinement& r, const Map& map) {
    if (source_ != CalibrationSource::kGuessed) return false;
    CalibrationDoubtOptions doubt = kCalibration.doubt;
    doubt.significance = kCalibration.guess_significance;
    const double change = contradiction(options_, doubt, camera_, map, r, kCalibration.wrong_guess);
    if (change == 0 || is_cancelled()) return false;
    camera_ = with_focal(camera_, 1 + change);
    return true;
  }

  bool is_settled(const CameraRefinement& r) const {
    return std::abs(r.focal_change) < kCalibration.settled_change &&
           r.max_shift_px < kCalibration.settled_shift_px;
  }

  static std::string not_settled(const CameraRefinement& r, bool is_near) {
    return formatted(
        "%s: one more run would change the focal length by %+.1f %%, and move the image's edge by %.1f px",
        is_near ? "the camera parameters have nearly converged" : "the camera parameters have not converged",
        100 * r.focal_change, r.max_shift_px);
  }

  std::string not_observable(const CameraRefinement& r) const {
    const std::string left = camera_.fx == start_.fx ? "the given value is kept"
                                                     : formatted(
                                                           "the guess of %.0f px contradicts the images; "
                                                           "%.0f px fits them better, but is also a guess",
                                                           start_.fx, camera_.fx);
    const std::string known = std::isfinite(r.focal_sigma)
                                  ? formatted(
                                        " (its standard deviation is %.2f %%; less than %.2f %% is required, "
                                        "with valid camera parameters)",
                                        100 * r.focal_sigma, 100 * kMaxFocalSigma)
                                  : "";
    return "the focal length is not observable in this motion" + known + ": " + left +
           "; record rotations and views from more sides";
  }

  const CameraParameters start_;
  const CalibrationSource source_;
  CameraParameters camera_, tracked_with_;
  const CameraRefinementOptions& options_;
  const TrackWithCamera& track_;
  bool is_refined_ = false;      // by an adjustment of the previous map
  bool was_refined_ = false;     // at the beginning of the last run
  bool is_interrupted_ = false;  // by a cancellation
  int runs_ = 0;
};

}  // namespace

SelfCalibration calibrate_by_tracking(const CameraParameters& start, CalibrationSource source,
                                      const CameraRefinementOptions& options, const TrackWithCamera& track) {
  return Calibrator(start, source, options, track).run();
}

bool exceeds(double change, const std::vector<double>& without_part, double sigma, double tolerated,
             const CalibrationDoubtOptions& limits) {
  const auto count = static_cast<double>(without_part.size());
  if (count < limits.min_parts) return false;
  double mean = 0, squared = 0;
  for (const double estimate : without_part) mean += estimate / count;
  for (const double estimate : without_part) squared += (estimate - mean) * (estimate - mean);
  const double between_parts = std::sqrt((count - 1) / count * squared);
  const double t = (std::abs(change) - tolerated) / std::max(between_parts, sigma);
  return 2 * student_tail(t, static_cast<int>(count) - 1) < limits.significance;
}

std::string doubt_of_calibration(const CameraRefinementOptions& options, const CameraParameters& camera,
                                 const Map& map) {
  const CalibrationDoubtOptions& limits = kCalibration.doubt;
  // Of all parameters together the images may ask for more than of the focal length alone.
  CameraRefinementOptions first = rough(options, limits);
  first.least_focal_change = 0.5 * limits.min_focal_change;
  first.least_distortion_px = limits.min_distortion_share * half_diagonal_px(camera);
  const CameraRefinement r = refine_camera(first, camera, map);
  const std::string doubt = doubt_of_distortion(options, limits, camera, map, r.distortion_asked_px);
  if (!doubt.empty()) return doubt;
  const double change = contradiction(options, limits, camera, map, r, limits.min_focal_change);
  if (change == 0) return "";
  return formatted(
      "the calibration is doubtful: the images fit a focal length of %.0f px better than the %.0f px that "
      "were given (%+.0f %%); calibrate again for this image size, or try --refine-camera. If the "
      "calibration is right, the map is wrong, for example because of moving objects: mask them (--masks)",
      camera.fx * (1 + change), camera.fx, 100 * change);
}

}  // namespace mono_pose_tracker
