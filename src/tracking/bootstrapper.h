#pragma once

#include <deque>
#include <optional>
#include <string>
#include <vector>

#include "common/rotation.h"
#include "map/frame.h"
#include "mapping/mapper_input.h"
#include "mono_pose_tracker/camera/camera_model.h"
#include "mono_pose_tracker/common/status.h"
#include "mono_pose_tracker/tracking/frame_report.h"
#include "mono_pose_tracker/tracking/tracker_options.h"
#include "tracking/two_motions.h"

namespace mono_pose_tracker {

struct ViewSet;

struct BootstrapReport {
  Reason reason = Reason::kFirstFrame;
  std::string text = "first frame: the reference for the map to come";
  int matches = 0;
  int inliers = 0;
  double median_parallax_deg = 0;
  std::optional<InitialMap> map;
  bool is_begun = false;            // the mapper has begun the map; the report no longer holds it
  std::vector<SeenMotion> motions;  // from the reference to the frame added

  /// Where a static background is behind a moving object: pixels of its features, and the frame since which
  /// the object has moved by moved_px (median).
  std::vector<cv::Point2f> static_background;
  std::int64_t reference_index = 0;
  double moved_px = 0;
};

/// Thresholds of the Bootstrapper in addition to the user's BootstrapOptions.
struct BootstrapperLimits {
  int two_motions_frames = 3;  // consecutive frames that must show an object in front of a static background:
                               // one may do so by chance
  double still_camera = 0.9;   // share of static matches when the camera is at rest and nothing large moves
  int left_reference = 4;      // the reference has left the view where the previous image has this many times
                               // as many moving matches

  // Differences between two runs that converge to one minimum, rad.
  double same_rotation = 0.5 * kDegree, same_translation = 5 * kDegree;

  // Minimum evidence against the runner-up, in observations of average cost and in outliers; the smaller of
  // the two counts: the first with little noise, the second with much. Systematic errors (rolling shutter,
  // calibration, a few wrong matches) are shared by many observations and fit either geometry by chance. Of
  // maps begun with less evidence, of a phone's recording and a head's before a room, four in ten had the
  // wrong geometry, with more one in seventy.
  double min_evidence = 80, min_evidence_outliers = 8;
};
inline constexpr BootstrapperLimits kBootstrapper{};

/// Makes the first map (paper, step 3): 5-point RANSAC between a reference frame and the newest one. A
/// two-view geometry may have an alternative that fits as well (planar two-fold ambiguity, narrow views). All
/// of them are kept until a third view decides.
class Bootstrapper {
 public:
  Bootstrapper(const TrackerOptions& options, const CameraModel& camera)
      : options_(options), camera_(camera) {}

  /// The reason is kOk when the report holds a map.
  BootstrapReport add(const Frame& frame);

  /// The two-view result of the first and the last frame, where there is no third. Without a map where there
  /// is none.
  BootstrapReport unconfirmed() const;

  void set_options(const TrackerOptions& options) { options_ = options; }
  void reset();

  /// Matches from the reference frame to the newest, for drawings.
  std::vector<SeenMotion> motions() const;

 private:
  struct Candidate {
    Frame frame;
    std::vector<int> feature_of_reference;  // match of each of the reference's features, -1: none
    int matches = 0;
  };

  int match_to_reference(Candidate* candidate) const;
  bool has_left_reference() const;
  bool replace_reference();
  void thin_out();
  std::vector<int> third_views(std::size_t second) const;
  bool separate_motions(std::vector<char>* fixed, BootstrapReport* report);
  bool is_one_motion(const TwoMotions& motions, BootstrapReport* report) const;
  std::vector<char> moved_between() const;
  void begin_separation(const TwoMotions& motions);
  void separate_newest();
  void keep_masked_features(const std::vector<int>& moved_of_reference, Candidate* candidate) const;
  void forget_motions();
  void report_motions(BootstrapReport* report) const;
  void find_map(const std::vector<int>& used, const std::vector<char>& fixed, const TrackerOptions& options,
                BootstrapReport* report) const;
  ViewSet collect(const std::vector<int>& used, const std::vector<char>& fixed,
                  std::vector<Frame>* frames) const;

  TrackerOptions options_;
  CameraModel camera_;
  std::deque<Candidate> candidates_;  // the reference first
  int two_motions_seen_ = 0;          // consecutive frames
  bool view_reached_round_ = false;   // around the static features: they are ego-vehicle features
  bool camera_is_still_ = false;      // and there is hardly any motion in front of it
  std::vector<cv::Point2f> still_;    // pixels of the static background, once two motions are certain
};

}  // namespace mono_pose_tracker
