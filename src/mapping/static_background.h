#pragma once

#include <map>
#include <opencv2/core.hpp>
#include <utility>
#include <vector>

#include "map/tracking_map.h"
#include "mapping/motion_segmentation.h"
#include "mapping/view_graph.h"
#include "mono_pose_tracker/camera/camera_model.h"

namespace mono_pose_tracker {

/// Features that keep their pixel in the images of a recording while other features move: the room behind a
/// head that rotates in front of a fixed camera. The moving object is then the one to be mapped.
struct StaticBackground {
  bool exists = false;
  bool reaches_round = false;  // around the moving features in most images: it is no ego-vehicle structure
  std::vector<MotionTrack> tracks;  // between consecutive images; is_other: of the moving object
  std::vector<std::vector<FeatureMotion>> sides;  // of each image's features; kTurns: moving object
};

/// Labels features as static in the image or moving, by voting along their tracks. Live, images are added as
/// they come; two images are matched once.
///
///     StaticSegmentation segmentation(options, &graph);
///     for (const SeenImage& image : images) segmentation.add(image);
///     if (segmentation.find(options.plainly_static, false).exists) ...
class StaticSegmentation {
 public:
  /// graph: where it has edges of the images, their matches are used; may be null. It must outlive this
  /// object.
  explicit StaticSegmentation(MotionSegmentationOptions options = {}, const ViewGraph* graph = nullptr)
      : options_(std::move(options)), graph_(graph) {}

  /// Images in the order of time.
  void add(const SeenImage& image) { images_.push_back(image); }
  int size() const { return static_cast<int>(images_.size()); }

  /// Each image is compared with near and distant ones. Ego-vehicle features are no background: the view
  /// reaches around them (not tested where object_turns: the object is known to be in front of the camera).
  StaticBackground find(const LeastStill& least, bool object_turns);

 private:
  class Votes;

  void match(int apart);
  bool may_exist(const LeastStill& least) const;
  StaticBackground classify(const Votes& votes, const LeastStill& least, bool object_turns) const;

  MotionSegmentationOptions options_;
  const ViewGraph* graph_;
  std::vector<SeenImage> images_;
  std::map<std::pair<int, int>, std::vector<Match>> matches_;  // of two images by their positions
};

/// A point set reaches a side of the image that has enough of its points there, and more than of the other
/// set.
struct ImageSidesOptions {
  double side = 1.0 / 8;  // share of the image's width or height
  int min_features = 3;   // at a side
};

/// Whether the first of two point sets reaches more of the image's four sides (an eighth of the image each)
/// than the second. A background reaches the sides around the object in front of it; a view reaches them
/// around ego-vehicle features.
bool reaches_round(const std::vector<cv::Point2f>& first, const std::vector<cv::Point2f>& second,
                   const CameraModel& camera);

/// The images of the map's keyframes, in the order of time.
std::vector<SeenImage> images_in_time(const Map& map);

}  // namespace mono_pose_tracker
