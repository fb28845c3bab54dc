#include "mono_pose_tracker/quality/quality_report.h"

#include "mapping/graph_consistency.h"
#include "mapping/view_graph.h"
#include "mono_pose_tracker/map/map.h"
#include "quality/path_precision.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "common/text.h"

namespace mono_pose_tracker {

namespace {

std::string image_text(std::int64_t frame_index) {
  return is_of_earlier_run(frame_index) ? "an image of the loaded map"
                                        : "image " + std::to_string(frame_index);
}

std::string in_map(const MapEvidence& evidence) { return evidence.name.empty() ? "" : evidence.name + ": "; }

// Test 1: segments of images whose matches with the other images the map does not support.
void test_consistency(const MapEvidence& evidence, const QualityOptions& options, QualityReport* report) {
  if (!evidence.graph) return;
  GraphConsistencyOptions consistency;
  consistency.significance = options.significance;
  const std::vector<EdgeConsistency> edges = edge_consistency(*evidence.map, *evidence.graph, consistency);
  for (const InconsistentSegment& segment : inconsistent_segments(*evidence.map, edges, consistency)) {
    const SegmentPlacement place = other_place(*evidence.map, *evidence.graph, segment, consistency);
    if (place.confirms_map(consistency)) continue;
    std::vector<std::int64_t> images;
    for (const KeyframeId id : segment.keyframes) images.push_back(evidence.map->keyframe(id)->frame_index);
    const std::string first = image_text(images.front()), last = image_text(images.back());
    const int contradicting = segment.matches - segment.supported;
    Finding& finding = report->add(
        FindingKind::kInconsistentSegment,
        in_map(evidence) + (first == last ? first : first + " to " + last) +
            formatted(
                ": %d of %d verified matches with the other images contradict the map. Few near points, "
                "repeated structure or moving objects: record more overlap there, or mask the objects "
                "(--masks).",
                contradicting, segment.matches));
    finding.images = std::move(images);
    finding.k = contradicting;
    finding.n = segment.matches;
    finding.p_value = segment.p_value;
  }
}

// Test 2, lengths.
void test_scale(const MapEvidence& evidence, const QualityOptions& options, QualityReport* report) {
  const ScaleCut& cut = evidence.path->weakest_cut;
  if (cut.path_sigma() <= options.max_path_sigma) return;
  Finding& finding = report->add(
      FindingKind::kUncertainScale,
      in_map(evidence) +
          formatted("The scale of the path from %s on depends on only %d landmarks shared with the path "
                    "before: %s. Record more overlap there.",
                    image_text(cut.frame_index).c_str(), cut.landmarks,
                    std::isfinite(cut.log_scale_sigma)
                        ? formatted("its standard deviation is %.0f %%", 100 * cut.log_scale_sigma).c_str()
                        : "it is unknown"));
  finding.images = {cut.frame_index};
  finding.k = cut.landmarks;
}

// Test 2, positions.
void test_path(const MapEvidence& evidence, const QualityOptions& options, QualityReport* report) {
  const PathPrecision& path = *evidence.path;
  const bool is_known = path.length > 0 && path.sigma <= options.max_path_sigma * path.length &&
                        path.sigma <= options.max_extent_sigma * path.extent;
  if (is_known) return;
  report->add(
      FindingKind::kUncertainPath,
      in_map(evidence) +
          (std::isfinite(path.share())
               ? formatted(
                     "The images determine the camera's positions to %.1f %% of the path only (standard "
                     "deviation).",
                     100 * path.share())
               : std::string("The images do not determine the camera's positions.")) +
          " The camera moves little compared with the distance of the scene, or landmarks are few: move "
          "farther, come nearer, or give more images of the same scene.");
}

void test_alternatives(const MapEvidence& evidence, const QualityOptions& options, QualityReport* report) {
  if (evidence.reversal_p_value > options.significance) {
    Finding& finding = report->add(
        FindingKind::kDepthReversal,
        in_map(evidence) +
            "The depth-reversed map explains the images about as well (bas-relief ambiguity of a narrow "
            "view): turn farther, come nearer, or mask independently moving objects (--masks).");
    finding.p_value = evidence.reversal_p_value;
  }
  if (evidence.planar_p_value > options.significance) {
    Finding& finding = report->add(
        FindingKind::kPlanarAmbiguity,
        in_map(evidence) +
            "The scene is nearly planar, and the second motion of the same homography explains the images "
            "about as well: move round the scene, or record objects outside the plane.");
    finding.p_value = evidence.planar_p_value;
  }
}

void test_images(const MapEvidence& evidence, const QualityOptions& options, QualityReport* report) {
  if (evidence.rests_on_two_views) {
    Finding& finding =
        report->add(FindingKind::kTwoViews,
                    in_map(evidence) + "The map rests on two images: a third is needed to confirm it.");
    finding.n = 2;
  }
  const auto registered = static_cast<double>(evidence.registered),
             images = static_cast<double>(evidence.images);
  if (evidence.is_first && !evidence.is_loaded && !evidence.is_object &&
      registered < options.min_registered * images) {
    const auto k = static_cast<int>(evidence.registered), n = static_cast<int>(evidence.images);
    Finding& finding = report->add(
        FindingKind::kFewImages,
        formatted(
            "Only %d of %d images are in the first map. What interrupted it may have distorted it, too: no "
            "map is confirmed. Record more overlap.",
            k, n));
    finding.k = k, finding.n = n;
  }
}

}  // namespace

const char* to_string(FindingKind kind) {
  constexpr std::array<const char*, 13> kNames = {
      "inconsistent_segment", "uncertain_scale",   "uncertain_path", "depth_reversal", "planar_ambiguity",
      "other_object",         "static_background", "two_views",      "few_images",     "several_maps",
      "unregistered_images",  "uncertain_images",  "calibration"};
  return kNames.at(static_cast<std::size_t>(kind));
}

Finding& QualityReport::add(FindingKind kind, std::string text) {
  findings_.emplace_back();
  findings_.back().kind = kind;
  findings_.back().text = std::move(text);
  return findings_.back();
}

bool QualityReport::confirmed() const {
  return std::none_of(findings_.begin(), findings_.end(),
                      [](const Finding& finding) { return finding.is_disqualifying; });
}

bool QualityReport::has(FindingKind kind) const {
  return std::any_of(findings_.begin(), findings_.end(), [&](const Finding& f) { return f.kind == kind; });
}

QualityReport assess(const MapEvidence& evidence, const QualityOptions& options) {
  QualityReport report;
  test_images(evidence, options, &report);
  test_consistency(evidence, options, &report);
  test_alternatives(evidence, options, &report);
  // Two views, and a path of another run, have no information on this path.
  if (!evidence.path || evidence.rests_on_two_views || evidence.is_loaded) return report;
  test_scale(evidence, options, &report);
  test_path(evidence, options, &report);
  return report;
}

ExplainedMatches explained_matches(const Map& map, const ViewGraph& graph) {
  ExplainedMatches matches;
  for (const EdgeConsistency& edge : edge_consistency(map, graph, {})) {
    matches.all += edge.matches;
    matches.explained += edge.explained;
    ++matches.edges;
  }
  return matches;
}

}  // namespace mono_pose_tracker
