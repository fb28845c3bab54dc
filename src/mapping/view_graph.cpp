#include "mapping/view_graph.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <set>

#include "common/threads.h"
#include "geometry/essential.h"
#include "mono_pose_tracker/camera/camera_model.h"
#include "mono_pose_tracker/robust/relative_pose.h"
#include "robust/ransac.h"

namespace mono_pose_tracker {

namespace {

// Bearings of the matches without a motion, and their indices.
struct Unexplained {
  std::vector<Eigen::Vector3d> first, second;
  std::vector<float> quality;
  std::vector<std::size_t> match;
};

Unexplained unexplained(const TwoViewGeometry& geometry, const FeatureSet& first, const FeatureSet& second) {
  Unexplained rest;
  for (std::size_t i = 0; i < geometry.matches.size(); ++i) {
    if (geometry.motion_of_match[i] != 0) continue;
    const Match& m = geometry.matches[i];
    rest.first.push_back(first.bearings[m.first]);
    rest.second.push_back(second.bearings[m.second]);
    rest.quality.push_back(m.ratio);
    rest.match.push_back(i);
  }
  return rest;
}

}  // namespace

bool have_same_features(const ImageFeatures& a, const ImageFeatures& b) {
  if (&a == &b) return true;
  if (a.size() != b.size()) return false;
  for (int f = 0; f < a.size(); ++f) {
    if (a.set.features[f].pixel != b.set.features[f].pixel) return false;
    if (!std::equal(a.set.descriptor(f), a.set.descriptor(f) + a.set.descriptors.cols, b.set.descriptor(f)))
      return false;
  }
  return true;
}

const char* to_string(TwoViewType type) {
  constexpr std::array<const char*, 6> kNames = {"degenerate", "static",     "panoramic",
                                                 "planar",     "calibrated", "multiple"};
  return kNames.at(static_cast<std::size_t>(type));
}

ViewGraphOptions view_graph_options(const MapperOptions& options) {
  ViewGraphOptions graph;
  graph.matching = options.matching;
  graph.ransac = options.ransac;
  graph.threads = options.threads;
  return graph;
}

int TwoViewGeometry::inliers(int motion) const {
  return static_cast<int>(std::count(motion_of_match.begin(), motion_of_match.end(), motion));
}

int ViewGraph::add(std::int64_t frame_index, const ImageFeaturesPtr& image) {
  const int known = node_of(frame_index, image);
  if (known >= 0) return known;
  const auto node = static_cast<int>(nodes_.size());
  nodes_.push_back({frame_index, image});
  nodes_of_frame_[frame_index].push_back(node);
  return node;
}

int ViewGraph::node_of(std::int64_t frame_index, const ImageFeaturesPtr& image) const {
  const auto of_frame = nodes_of_frame_.find(frame_index);
  if (of_frame == nodes_of_frame_.end()) return -1;
  const auto same = std::find_if(of_frame->second.begin(), of_frame->second.end(),
                                 [&](int node) { return have_same_features(*nodes_[node].image, *image); });
  return same == of_frame->second.end() ? -1 : *same;
}

void ViewGraph::connect(const std::vector<Pair>& pairs) {
  std::set<Pair> missing;
  for (const Pair& pair : pairs) {
    const Pair ordered = std::minmax(pair.first, pair.second);
    if (pair.first != pair.second && !edges_.count(ordered)) missing.insert(ordered);
  }
  const std::vector<Pair> unknown(missing.begin(), missing.end());
  std::vector<TwoViewGeometry> computed(unknown.size());
  parallel_for(static_cast<int>(unknown.size()), options_.threads,
               [&](int i) { computed[i] = compute(unknown[i]); });
  for (std::size_t i = 0; i < unknown.size(); ++i) edges_.emplace(unknown[i], std::move(computed[i]));
}

const TwoViewGeometry* ViewGraph::edge(int first, int second) const {
  const auto found = edges_.find({first, second});
  return found == edges_.end() ? nullptr : &found->second;
}

std::vector<VerifiedMatch> ViewGraph::verified_matches(int first, int second) const {
  std::vector<VerifiedMatch> verified;
  for (int f = 0; first == second && f < nodes_[first].image->size(); ++f) verified.push_back({f, f});
  const TwoViewGeometry* geometry = edge(std::min(first, second), std::max(first, second));
  for (std::size_t i = 0; geometry && i < geometry->matches.size(); ++i) {
    const Match& m = geometry->matches[i];
    const int motion = geometry->motion_of_match[i];
    if (motion == 0) continue;
    verified.push_back(first < second ? VerifiedMatch{m.first, m.second, motion, i}
                                      : VerifiedMatch{m.second, m.first, motion, i});
  }
  return verified;
}

double ViewGraph::max_error_rad(const Pair& pair) const {
  const auto of_camera = [&](const CameraModel& camera) {
    return options_.max_error_px * std::max(1.0, longer_side(camera) / options_.longer_side_px) /
           camera.focal();
  };
  return std::max(of_camera(nodes_[pair.first].image->camera), of_camera(nodes_[pair.second].image->camera));
}

std::vector<char> ViewGraph::explained_by(const Pair& pair, const Rigid3& second_from_first) const {
  if (pair.first > pair.second) return explained_by({pair.second, pair.first}, second_from_first.inverse());
  const FeatureSet &first = nodes_[pair.first].image->set, &second = nodes_[pair.second].image->set;
  const std::vector<Match>& matches = edges_.at(pair).matches;
  const double limit = max_error_rad(pair);
  const bool has_translation = second_from_first.translation.norm() > 0;
  const Eigen::Matrix3d essential =
      has_translation ? essential_matrix(second_from_first) : Eigen::Matrix3d::Zero();
  std::vector<char> explained;
  explained.reserve(matches.size());
  for (const Match& m : matches) {
    const Eigen::Vector3d &x1 = first.bearings[m.first], &x2 = second.bearings[m.second];
    const double error = has_translation ? std::abs(sampson_error(essential, x1, x2))
                                         : (second_from_first.rotation * x1).cross(x2).norm();
    explained.push_back(error < limit);
  }
  return explained;
}

// Assigns a motion to the matches without one where enough of them agree on it.
bool ViewGraph::fit_motion(const Pair& pair, int motion, TwoViewGeometry* geometry) const {
  const FeatureSet &first = nodes_[pair.first].image->set, &second = nodes_[pair.second].image->set;
  const Unexplained rest = unexplained(*geometry, first, second);
  const auto count = static_cast<int>(rest.match.size());
  if (count < options_.min_inliers) return false;
  const int least =
      motion == 1 ? options_.min_inliers
                  : std::max(options_.min_inliers, static_cast<int>(options_.least_second_motion * count));
  RelativePoseOptions pose;
  pose.ransac = options_.ransac;
  pose.ransac.threshold = max_error_rad(pair);
  pose.ransac.seed += static_cast<std::uint64_t>(nodes_[pair.first].frame_index);
  pose.max_hypotheses = motion == 1 ? 2 : 1;
  // A motion of fewer matches makes no edge. Samples are of five.
  const double needed = ransac_iterations_needed(least, count, 5, pose.ransac.confidence);
  pose.ransac.max_iterations = static_cast<int>(
      std::clamp<double>(std::ceil(needed), pose.ransac.min_iterations, pose.ransac.max_iterations));
  pose.quality = rest.quality;
  const RelativePoseReport report = estimate_relative_pose(rest.first, rest.second, pose);
  if (!report.success) return false;
  const RelativePoseHypothesis& best = report.hypotheses.front();
  if (best.num_inliers < least) return false;
  for (std::size_t i = 0; i < rest.match.size(); ++i) {
    if (best.inliers[i]) geometry->motion_of_match[rest.match[i]] = static_cast<std::uint8_t>(motion);
  }
  if (motion > 1) return true;
  const double enough = options_.explained_by_simpler * best.num_inliers;
  const bool turns =
      report.rotation_only.angularDistance(Eigen::Quaterniond::Identity()) > pose.ransac.threshold;
  geometry->type =
      report.rotation_only_inliers < enough
          ? (report.plane_inliers >= enough && report.hypotheses.size() > 1 ? TwoViewType::kPlanar
                                                                            : TwoViewType::kCalibrated)
          : (turns ? TwoViewType::kPanoramic : TwoViewType::kStatic);
  return true;
}

TwoViewGeometry ViewGraph::compute(const Pair& pair) const {
  TwoViewGeometry geometry;
  geometry.matches = match_descriptors(nodes_[pair.first].image->set.descriptors,
                                       nodes_[pair.second].image->set.descriptors, options_.matching);
  geometry.motion_of_match.assign(geometry.matches.size(), 0);
  if (fit_motion(pair, 1, &geometry) && fit_motion(pair, 2, &geometry))
    geometry.type = TwoViewType::kMultiple;
  return geometry;
}

std::vector<Match> raw_matches(const ViewGraph* graph, const SeenImage& first, const SeenImage& second,
                               const MatchOptions& matching) {
  if (graph) {
    const int a = graph->node_of(first.frame_index, first.image),
              b = graph->node_of(second.frame_index, second.image);
    const TwoViewGeometry* edge =
        a >= 0 && b >= 0 && a != b ? graph->edge(std::min(a, b), std::max(a, b)) : nullptr;
    if (edge) return a < b ? edge->matches : turned_round(edge->matches);
  }
  return match_descriptors(first.image->set.descriptors, second.image->set.descriptors, matching);
}

}  // namespace mono_pose_tracker
