#include "report.h"

#include <cmath>
#include <limits>
#include <opencv2/imgcodecs.hpp>
#include <optional>
#include <utility>

#include "../json.h"
#include "io/files.h"

namespace mono_pose_tracker {

void MaskRecord::add(std::int64_t index, const FrameReport& report) {
  methods_[index] = report.segmentation;
  if (!report.mask.empty()) replace(index, report.mask);
}

void MaskRecord::replace(std::int64_t index, const cv::Mat& mask) {
  shares_[index] = cv::countNonZero(mask) / static_cast<double>(mask.total());
  if (keep_) cv::imencode(".png", mask, packed_[index]);
}

cv::Mat MaskRecord::mask(std::int64_t index) const {
  const auto packed = packed_.find(index);
  return packed == packed_.end() ? cv::Mat() : cv::imdecode(packed->second, cv::IMREAD_GRAYSCALE);
}

Json MaskRecord::summary() const {
  std::map<std::string, int> frames;
  for (const auto& [index, name] : methods_) ++frames[name];
  std::string method = "none";  // that most frames with a mask had
  int most = 0;
  for (const auto& [name, count] : frames) {
    if (name != "none" && count > most) method = name, most = count;
  }
  double sum = 0;
  for (const auto& [index, share] : shares_) sum += share;
  const auto count = static_cast<double>(shares_.size());
  return {{"method", method},
          {"frames", shares_.size()},
          {"mean_foreground_share", shares_.empty() ? 1.0 : sum / count}};
}

namespace {

struct MapStatistics {
  double mean_track_length = 0;
  double reprojection_rms_px = 0;
};

MapStatistics map_statistics(const Map& map) {
  double observations = 0, sum = 0;
  for (const auto& [id, landmark] : map.landmarks()) {
    for (const Observation& o : landmark.observations) {
      const Keyframe& keyframe = *map.keyframe(o.keyframe);
      sum += reprojection_error(*keyframe.image, o.feature, keyframe.camera_from_map * landmark.x_in_map)
                 .squaredNorm();
      ++observations;
    }
  }
  if (observations == 0) return {};
  return {observations / map.landmarks().size(), std::sqrt(sum / observations)};
}

// Null where nothing tells it.
Json path_share(const PathPrecision& precision) {
  const double share = precision.share();
  return std::isfinite(share) ? Json(share) : Json();
}

Json findings_summary(const RecordingResult& result) {
  Json findings = Json::array();
  if (!result.tracked) return findings;
  for (const Finding& finding : result.maps.front().quality.findings()) {
    findings.push_back({{"kind", to_string(finding.kind)},
                        {"images", finding.images},
                        {"k", finding.k},
                        {"n", finding.n},
                        {"p_value", finding.p_value ? Json(*finding.p_value) : Json()},
                        {"disqualifying", finding.is_disqualifying},
                        {"text", finding.text}});
  }
  return findings;
}

Json maps_summary(const RecordingResult& result) {
  Json maps = Json::array();
  for (const FinishedMap& map : result.maps) {
    maps.push_back({{"frames", map.trajectory.size()},
                    {"keyframes", map.map.keyframes().size()},
                    {"points", map.map.landmarks().size()},
                    {"weakest_seam_points", map.precision.weakest_cut.landmarks},
                    {"path_uncertainty_share", path_share(map.precision)},
                    {"contradicting_share", 1 - map.explained.share()},
                    {"verified_matches", map.explained.all},
                    {"confirmed", map.confirmed()}});
  }
  return maps;
}

Json loops_summary(const RecordingResult& result) {
  Json loops = Json::array();
  for (const ClosedLoop& loop : result.loops) {
    loops.push_back({{"images", {loop.from_frame, loop.to_frame}},
                     {"drift_percent", 100 * loop.drift},
                     {"scale_drift", loop.scale_drift}});
  }
  return loops;
}

Json camera_summary(const SelfCalibration& calibration) {
  const CameraParameters& p = calibration.camera;
  const CameraRefinement& r = calibration.last;
  Json refined = Json::array(), open = refined;
  for (const auto& [name, observable] : {std::pair("focal_length", r.focal_observable),
                                         {"principal_point", r.center_observable},
                                         {"distortion", r.distortion_observable}}) {
    (observable ? refined : open).push_back(name);
  }
  return {{"fx", p.fx},
          {"fy", p.fy},
          {"cx", p.cx},
          {"cy", p.cy},
          {"distortion", p.distortion},
          {"refined", refined},
          {"not_observable", open},
          {"focal_length_sigma", std::isfinite(r.focal_sigma) ? r.focal_sigma * p.fx : -1.0},
          {"runs", calibration.runs}};
}

}  // namespace

void write_report(const std::string& path, const RecordingResult& result, const Map& map,
                  const MaskRecord& masks, const Calibration& calibration, const Json& alignment,
                  std::uint64_t seed, double wall_seconds) {
  const MapStatistics statistics = map_statistics(map);
  Json json = {{"tracked", result.tracked},
               {"confirmed", is_confirmed(result)},
               {"reason", rests_on_two_views(result) ? "two views only: unconfirmed" : result.reason},
               {"frames_total", result.frames_total},
               {"frames_posed", result.trajectory.size()},
               {"frames_posed_live", result.frames_posed_live},
               {"frames_doubtful", doubtful_frames(result).size()},
               {"failed_adjustments", result.failed_adjustments},
               {"keyframes", map.keyframes().size()},
               {"points", map.landmarks().size()},
               {"mean_track_length", statistics.mean_track_length},
               {"reprojection_rms_px", statistics.reprojection_rms_px},
               {"scale", to_string(map.scale_source())},
               {"calibration", to_string(calibration.source)},
               {"wall_seconds", wall_seconds},
               {"seed", seed},
               {"segmentation", masks.summary()},
               {"stages", time_statistics(result.stage_ms)},
               {"warnings", result.warnings},
               {"findings", findings_summary(result)},
               {"maps", maps_summary(result)},
               {"loops", loops_summary(result)},
               {"problems", result.problems}};
  if (!alignment.is_null()) json["alignment"] = alignment;
  if (calibration.rectification) {
    json["rectified"] = calibration.rectification->is_rectified;
    json["rectified_reason"] = calibration.rectification->reason;
  }
  if (calibration.refined) json["camera"] = camera_summary(*calibration.refined);
  write_file_atomically(path, [&](std::ostream& out) {
    out << json.dump(2, ' ', false, Json::error_handler_t::replace) << '\n';
  });
}

}  // namespace mono_pose_tracker
