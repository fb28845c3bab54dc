#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <unordered_map>
#include <utility>
#include <vector>

#include "mono_pose_tracker/common/rigid3.h"
#include "mono_pose_tracker/features/matching.h"
#include "mono_pose_tracker/map/image_features.h"
#include "mono_pose_tracker/mapping/mapper_options.h"
#include "mono_pose_tracker/robust/ransac_options.h"

namespace mono_pose_tracker {

/// An image of a recording.
struct SeenImage {
  std::int64_t frame_index = 0;
  ImageFeaturesPtr image;
};

/// Whether both images have the same pixels and descriptors: not where they were masked differently.
bool have_same_features(const ImageFeatures& a, const ImageFeatures& b);

/// Type of a two-view geometry, estimated without a map (COLMAP, scene/two_view_geometry.h).
enum class TwoViewType {
  kDegenerate,  // fewer verified matches than ViewGraphOptions::min_inliers
  kStatic,      // the features have not moved in the image: a camera at rest, or a static overlay
  kPanoramic,   // a rotation explains the matches: the direction of the translation is unknown
  kPlanar,      // a homography explains the matches, which has a second motion (two-fold ambiguity)
  kCalibrated,  // an essential matrix
  kMultiple,    // more than one rigid motion, separated by `motion_of_match`
};
const char* to_string(TwoViewType type);

/// An edge of the view graph: verified matches of two images.
struct TwoViewGeometry {
  TwoViewType type = TwoViewType::kDegenerate;
  std::vector<Match> matches;                 // feature of the first image, of the second
  std::vector<std::uint8_t> motion_of_match;  // 0: outlier, 1: the dominant motion, 2: the next

  /// Matches of a motion.
  int inliers(int motion = 1) const;
};

/// A verified match of two nodes in the order in which they were asked for.
struct VerifiedMatch {
  int first = -1, second = -1;  // features
  int motion = 1;
  std::size_t index = 0;  // in TwoViewGeometry::matches
};

struct ViewGraphOptions {
  MatchOptions matching;
  RansacOptions ransac;     // its threshold is replaced by max_error_px
  double max_error_px = 3;  // Sampson error of a verified match, in px of an image 1,000 px long; at least
                            // this. Five sigma of a SIFT feature's 0.6 px: poses may be a little off as well
  double longer_side_px = 1000;  // of the image in which max_error_px holds
  int min_inliers = 25;  // verified matches of an edge: 5 are fitted, and accidental ones agree by chance
  double explained_by_simpler = 0.9;  // share of the inliers that a rotation, a plane or no motion must
                                      // explain for the edge to be of that type; in (0, 1]
  double least_second_motion = 0.4;   // share of the other matches that must agree on a second motion
  int threads = 1;                    // the result is the same for any number
};
ViewGraphOptions view_graph_options(const MapperOptions& options);

/// Two-view geometries of a recording's images: computed once, kept, independent of any map. Keyframes and
/// images of a finished map are matched only here and by raw_matches; the Bootstrapper and the ObjectFollower
/// match live images by themselves. Append-only. One thread.
///
///     ViewGraph graph(options);
///     const int a = graph.add(7, features_of_frame_7), b = graph.add(9, features_of_frame_9);
///     graph.connect({{a, b}});
///     const TwoViewGeometry* edge = graph.edge(a, b);
class ViewGraph {
 public:
  /// Two nodes, the lower one first.
  using Pair = std::pair<int, int>;

  explicit ViewGraph(const ViewGraphOptions& options) : options_(options) {}

  /// The node of these features of the frame; new where they are not known yet. Equal features are the same
  /// node, also if they were extracted again.
  int add(std::int64_t frame_index, const ImageFeaturesPtr& image);
  /// -1: unknown image.
  int node_of(std::int64_t frame_index, const ImageFeaturesPtr& image) const;
  /// Computes the missing edges. Pairs of a node with itself are ignored.
  void connect(const std::vector<Pair>& pairs);

  const std::vector<SeenImage>& nodes() const { return nodes_; }
  const std::map<Pair, TwoViewGeometry>& edges() const { return edges_; }
  /// Null where the edge was not computed. first < second.
  const TwoViewGeometry* edge(int first, int second) const;
  /// The matches of the edge between two nodes that have a motion; none where it was not computed. A node
  /// matches itself feature by feature.
  std::vector<VerifiedMatch> verified_matches(int first, int second) const;
  const ViewGraphOptions& options() const { return options_; }

  /// Sampson error, rad, within which a match of the edge is explained by a relative pose.
  double max_error_rad(const Pair& pair) const;
  /// Which matches of the edge a relative pose explains: within max_error_rad of their epipolar lines. The
  /// nodes may be in either order.
  std::vector<char> explained_by(const Pair& pair, const Rigid3& second_from_first) const;

 private:
  TwoViewGeometry compute(const Pair& pair) const;
  bool fit_motion(const Pair& pair, int motion, TwoViewGeometry* geometry) const;

  ViewGraphOptions options_;
  std::vector<SeenImage> nodes_;
  std::unordered_map<std::int64_t, std::vector<int>> nodes_of_frame_;  // by mask: one, rarely more
  std::map<Pair, TwoViewGeometry> edges_;
};

/// Raw matches of two images: of the graph's edge where it has one, otherwise computed. graph may be null.
std::vector<Match> raw_matches(const ViewGraph* graph, const SeenImage& first, const SeenImage& second,
                               const MatchOptions& matching);

}  // namespace mono_pose_tracker
