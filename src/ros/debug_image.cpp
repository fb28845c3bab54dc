#include "ros/debug_image.h"

#include <algorithm>
#include <array>
#include <opencv2/imgproc.hpp>
#include <string>
#include <utility>
#include <vector>

#include "common/text.h"
#include "tracking/load_governor.h"

namespace mono_pose_tracker {

std::optional<ObjectAxes> project_axes(const CameraModel& camera, const Rigid3& camera_from_axes,
                                       double length) {
  ObjectAxes axes;
  if (!camera.project(camera_from_axes.translation, &axes.origin_px)) return std::nullopt;
  for (int i = 0; i < 3; ++i) {
    const Eigen::Vector3d tip = camera_from_axes * Eigen::Vector3d(length * Eigen::Vector3d::Unit(i));
    if (!camera.project(tip, &axes.tips_px[static_cast<std::size_t>(i)])) return std::nullopt;
  }
  return axes;
}

namespace {

using Fate = SeenFeature::Fate;

// BGR
const cv::Scalar kGreen(80, 220, 80), kRed(60, 60, 240), kBlue(230, 160, 60), kYellow(60, 210, 240),
    kWhite(235, 235, 235), kOutline(240, 200, 60), kAxisX(40, 40, 255), kAxisY(40, 230, 40),
    kAxisZ(255, 90, 40);

// Images over which a feature's tail reaches: a third of a second at 30 Hz.
constexpr std::size_t kTailImages = 10;

// Fixed-point bits of OpenCV's drawing: sixteenths of a pixel.
constexpr int kShift = 4;

cv::Point fixed(float x, float y) { return {cvRound(x * (1 << kShift)), cvRound(y * (1 << kShift))}; }

cv::Scalar color_of(Fate fate) {
  return fate == Fate::kInlier ? kGreen : fate == Fate::kOutlier ? kRed : kBlue;
}

cv::Scalar color_of(State state) {
  return state == State::kTracking ? kGreen : state == State::kLost ? kRed : kYellow;
}

int dot_radius(const cv::Mat& canvas) { return std::max(1, canvas.cols / 320); }

/// Unmatched features first, so that they hide nothing.
void draw_features(const std::vector<SeenFeature>& features, cv::Mat& canvas) {
  for (const Fate fate : {Fate::kUnmatched, Fate::kOutlier, Fate::kInlier}) {
    const int radius = fate == Fate::kUnmatched ? std::max(1, dot_radius(canvas) / 2) : dot_radius(canvas);
    for (const SeenFeature& feature : features) {
      if (feature.fate != fate) continue;
      cv::circle(canvas, fixed(feature.x_px.x(), feature.x_px.y()), radius << kShift, color_of(fate),
                 cv::FILLED, cv::LINE_AA, kShift);
    }
  }
}

void draw_motions(const std::vector<SeenMotion>& motions, cv::Mat& canvas) {
  for (const SeenMotion& motion : motions) {
    cv::line(canvas, fixed(motion.from_px.x(), motion.from_px.y()), fixed(motion.to_px.x(), motion.to_px.y()),
             kYellow, 1, cv::LINE_AA, kShift);
  }
}

/// Words with their colour, side by side.
using Line = std::vector<std::pair<std::string, cv::Scalar>>;

Line counts_line(const FrameReport& report) {
  const auto count = [&](Fate fate) {
    return static_cast<int>(std::count_if(report.seen.begin(), report.seen.end(),
                                          [&](const SeenFeature& f) { return f.fate == fate; }));
  };
  return {{formatted("%d inliers  ", count(Fate::kInlier)), kGreen},
          {formatted("%d outliers  ", count(Fate::kOutlier)), kRed},
          {formatted("%d unmatched", count(Fate::kUnmatched)), kBlue}};
}

bool is_busy(const FrameReport& report) { return report.load_level >= kLittleDrawn; }

std::vector<Line> describe(const FrameReport& report) {
  std::string head = to_string(report.state);
  if (report.reason != Reason::kOk) head += std::string(": ") + to_string(report.reason);
  const std::string advice = what_to_do(report.reason);
  if (!advice.empty()) head += " - " + advice;
  std::vector<Line> lines{{{head, color_of(report.state)}}};
  if (!report.reason_text.empty()) lines.push_back({{report.reason_text, kWhite}});
  lines.push_back(counts_line(report));
  if (is_busy(report)) {
    lines.push_back(
        {{"overloaded: drawn once a second (load level " + std::to_string(report.load_level) + ")",
          kYellow}});
  }
  if (report.map_from_camera) {
    lines.push_back({{formatted("map %u: %d keyframes, %d points; error %.2f px", report.epoch,
                                report.keyframes, report.landmarks, report.reprojection_rms_px),
                      kWhite}});
  }
  return lines;
}

int text_width(const Line& line, double scale) {
  int width = 0;
  for (const auto& words : line) {
    width += cv::getTextSize(words.first, cv::FONT_HERSHEY_SIMPLEX, scale, 1, nullptr).width;
  }
  return width;
}

using Outline = std::vector<std::vector<cv::Point>>;

void draw_outline(const Outline& outline, cv::Mat& canvas) {
  cv::drawContours(canvas, outline, -1, kOutline, std::max(1, canvas.cols / 600), cv::LINE_AA);
}

// What is not the object is dimmed, and its outline drawn.
void draw_mask(const cv::Mat& mask, cv::Mat& canvas) {
  if (mask.size() != canvas.size()) return;
  const cv::Mat dimmed = 0.45 * canvas;
  dimmed.copyTo(canvas, mask == 0);
  Outline outline;
  cv::findContours(mask, outline, cv::RETR_EXTERNAL, cv::CHAIN_APPROX_NONE);
  draw_outline(outline, canvas);
}

/// Outline around the certain features of the object, if there is no mask.
void draw_hull(const std::vector<SeenFeature>& features, cv::Mat& canvas) {
  std::vector<cv::Point> inliers;
  for (const SeenFeature& feature : features) {
    if (feature.fate == Fate::kInlier)
      inliers.emplace_back(cvRound(feature.x_px.x()), cvRound(feature.x_px.y()));
  }
  if (inliers.size() < 3) return;
  Outline hull(1);
  cv::convexHull(inliers, hull[0]);
  draw_outline(hull, canvas);
}

/// Red, green, blue for x, y, z, as rviz has them, with their letters.
void draw_axes(const ObjectAxes& axes, cv::Mat& canvas) {
  const int thickness = std::max(2, canvas.cols / 250);
  const auto point = [](const Eigen::Vector2d& px) {
    return fixed(static_cast<float>(px.x()), static_cast<float>(px.y()));
  };
  // z first: it points away from the camera, at least at first.
  for (const int i : {2, 1, 0}) {
    const cv::Scalar color = std::array{kAxisX, kAxisY, kAxisZ}[static_cast<std::size_t>(i)];
    const Eigen::Vector2d& tip = axes.tips_px[static_cast<std::size_t>(i)];
    cv::line(canvas, point(axes.origin_px), point(tip), color, thickness, cv::LINE_AA, kShift);
    const cv::Point label_origin(cvRound(tip.x()) + 2 * thickness, cvRound(tip.y()));
    cv::putText(canvas, std::string(1, "xyz"[i]), label_origin, cv::FONT_HERSHEY_SIMPLEX,
                std::max(0.4, canvas.cols / 1000.0), color, 1, cv::LINE_AA);
  }
}

void draw_text(const std::vector<Line>& lines, cv::Mat& canvas) {
  // Readable in a small panel of rviz; of a wide image a quarter of the rows is left to it.
  const double lowest = (canvas.rows / 4.0 / static_cast<double>(lines.size()) - 4) / 28;
  const double normal = std::max(0.35, std::min(canvas.cols / 800.0, lowest));
  const int height = cvRound(28 * normal) + 4;  // px
  const int margin = 6;                         // px
  cv::Mat band = canvas.rowRange(0, std::min(canvas.rows, height * static_cast<int>(lines.size()) + margin));
  band *= 0.35;  // dark enough for the text to be read on any image
  for (std::size_t i = 0; i < lines.size(); ++i) {
    // A line that is too long is set smaller.
    const double fit =
        static_cast<double>(canvas.cols - 2 * margin) / std::max(1, text_width(lines[i], normal));
    const double scale = normal * std::min(1.0, fit);
    cv::Point at(margin, height * static_cast<int>(i + 1) - 4);
    for (const auto& [words, color] : lines[i]) {
      cv::putText(canvas, words, at, cv::FONT_HERSHEY_SIMPLEX, scale, color, scale > 0.8 ? 2 : 1,
                  cv::LINE_AA);
      at.x += cv::getTextSize(words, cv::FONT_HERSHEY_SIMPLEX, scale, 1, nullptr).width;
    }
  }
}

}  // namespace

const char* what_to_do(Reason reason) {
  switch (reason) {
    case Reason::kNoCameraInfo:
      return "publish camera_info, or set ~camera_info_url";
    case Reason::kUncalibrated:
      return "calibrate the camera, or set ~camera_info_url";
    case Reason::kImageSizeMismatch:
      return "calibrate at this image size";
    case Reason::kCalibrationChanged:
      return "use a calibration file: ~camera_info_source file";
    case Reason::kUnsupportedEncoding:
      return "convert the images";
    case Reason::kTooFewFeatures:
      return "more light, more texture, a steadier hand";
    case Reason::kFirstFrame:
    case Reason::kLowParallax:
    case Reason::kRotationOnly:
      return "move the camera sideways";
    case Reason::kTooFewMatches:
    case Reason::kRelocalising:
      return "move slowly; go back to the mapped scene";
    case Reason::kAwaitingConfirmation:
      return "keep moving";
    case Reason::kAmbiguousPose:
      return "move in another direction";
    case Reason::kTooFewInliers:
      return "mask moving objects";
    case Reason::kPaused:
      return "call ~resume";
    default:
      return "";
  }
}

bool DebugImage::is_due(const FrameReport& report) const {
  constexpr std::int64_t kSecond = 1'000'000'000;  // ns
  // Stamps that jump back are another recording's.
  return !is_busy(report) || report.stamp_ns < drawn_ns_ || report.stamp_ns - kSecond >= drawn_ns_;
}

void DebugImage::grow_tails(const FrameReport& report) {
  const bool is_new_map = report.epoch != std::exchange(epoch_, report.epoch);
  if (is_new_map || is_busy(report)) tails_.clear();  // what is a second old is nobody's tail
  std::map<std::int64_t, Tail> grown;
  for (const SeenFeature& feature : report.seen) {
    if (feature.fate != Fate::kInlier) continue;
    const auto old = tails_.find(feature.landmark);
    Tail tail = old == tails_.end() ? Tail() : std::move(old->second);
    tail.emplace_back(feature.x_px.x(), feature.x_px.y());
    if (tail.size() > kTailImages) tail.pop_front();
    grown.emplace(feature.landmark, std::move(tail));
  }
  tails_ = std::move(grown);  // what is not seen any more has no tail
}

void DebugImage::draw_tails(cv::Mat& canvas) const {
  for (const auto& entry : tails_) {
    const Tail& tail = entry.second;
    for (std::size_t i = 1; i < tail.size(); ++i) {
      const double age = static_cast<double>(tail.size() - i) / kTailImages;  // old parts are darker
      cv::line(canvas, fixed(tail[i - 1].x, tail[i - 1].y), fixed(tail[i].x, tail[i].y),
               kGreen * (1 - 0.6 * age), 1, cv::LINE_AA, kShift);
    }
  }
}

cv::Mat DebugImage::draw(const cv::Mat& image, const FrameReport& report,
                         const std::optional<ObjectAxes>& object) {
  cv::Mat canvas;
  if (image.channels() == 1) {
    cv::cvtColor(image, canvas, cv::COLOR_GRAY2BGR);
  } else {
    canvas = image.clone();
  }
  drawn_ns_ = report.stamp_ns;
  draw_mask(report.mask, canvas);
  grow_tails(report);
  draw_tails(canvas);
  draw_motions(report.motions, canvas);
  draw_features(report.seen, canvas);
  if (object && report.mask.empty()) draw_hull(report.seen, canvas);
  if (object) draw_axes(*object, canvas);
  draw_text(describe(report), canvas);
  return canvas;
}

}  // namespace mono_pose_tracker
