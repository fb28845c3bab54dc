#include "segmentation/motion_mask.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <opencv2/imgproc.hpp>

#include "background_model.h"
#include "segmentation/object_outline.h"

namespace mono_pose_tracker {
namespace {

// px of the reduced image: after this displacement most pixels of a fine texture have changed.
constexpr float kStillPath = 3;
// Grey levels within a window of the reduced image: three times what counts as a change.
constexpr int kTextureWindow = 5;
constexpr double kMinTexture = 24;
// An edge along its own direction of motion looks static: most of the texture around a static pixel must be
// static too.
constexpr int kAgreeWindow = 9;
constexpr float kMinAgree = 0.7f;
// px of the reduced image around a feature of the object; pixels beyond are background.
constexpr float kObjectReach = 24;
// px of the reduced image: minimal distance from the object's features at which background is learnt,
// textured or not.
constexpr float kObjectClear = 10;
// The camera has moved when more than this share of the known background vanishes within a few images; an
// approaching object takes longer to hide as much.
constexpr double kLostShare = 0.7;
constexpr int kLostImages = 5;
// Smallest share of the object's features in a component of the foreground that belongs to the object.
constexpr double kComponentShare = 0.1;
// Grey levels: noise of a webcam at half its size.
constexpr double kSigma = 1.6;

cv::Mat texture_of(const cv::Mat& image) {
  const cv::Mat gray = gray_of(image), window = cv::Mat::ones(kTextureWindow, kTextureWindow, CV_8U);
  cv::Mat high, low;
  cv::dilate(gray, high, window);
  cv::erode(gray, low, window);
  return high - low > kMinTexture;
}

cv::Mat distance_to(const std::vector<cv::Point>& points, const cv::Mat& pixels, const cv::Size& size) {
  cv::Mat away(size, CV_8UC1, cv::Scalar(255));
  if (!pixels.empty()) away.setTo(0, pixels);
  for (const cv::Point& p : points) away.at<std::uint8_t>(p) = 0;
  cv::Mat distance;
  cv::distanceTransform(away, distance, cv::DIST_L2, cv::DIST_MASK_3);
  return distance;
}

}  // namespace

MotionMask::MotionMask(const SegmentationOptions& options)
    : options_(options), background_(model_options(options)) {}

void MotionMask::reset() { *this = MotionMask(options_); }

cv::Point MotionMask::reduced_point(const cv::Point2f& point) const {
  const float scale = static_cast<float>(image_.cols) / static_cast<float>(full_size_.width);
  return {std::clamp(cvRound((point.x + 0.5f) * scale - 0.5f), 0, image_.cols - 1),
          std::clamp(cvRound((point.y + 0.5f) * scale - 0.5f), 0, image_.rows - 1)};
}

void MotionMask::begin(const cv::Mat& small) {
  unchanged_ = small.clone();
  since_ = cv::Mat(small.size(), CV_32FC1, cv::Scalar(path_));
  known_ = cv::Mat::zeros(small.size(), CV_8UC1);
  background_ = BackgroundModel(model_options(options_));
  background_.learn(small, kSigma);
  outside_ = cv::Mat();
}

void MotionMask::watch(const cv::Mat& image) {
  full_size_ = image.size();
  const cv::Mat small = reduced(image);
  if (unchanged_.empty() || unchanged_.size() != small.size() || unchanged_.type() != small.type())
    begin(small);
  image_ = background_.with_exposure_of_model(small, started_ ? known_outside() : outside_);
  if (image_.data == image.data) image_ = image_.clone();  // the caller's own, who may free it
  note_changes();
  if (started_) {
    find_object();
  } else {
    ++path_;
  }
}

void MotionMask::note_changes() {
  const int channels = image_.channels();
  const int threshold = cvRound(options_.background_min_difference);
  for (int y = 0; y < image_.rows; ++y) {
    const auto* seen = image_.ptr<std::uint8_t>(y);
    auto* before = unchanged_.ptr<std::uint8_t>(y);
    float* since = since_.ptr<float>(y);
    for (int x = 0; x < image_.cols; ++x) {
      int most = 0;
      for (int i = x * channels; i < (x + 1) * channels; ++i)
        most = std::max(most, std::abs(seen[i] - before[i]));
      if (most <= threshold) continue;
      since[x] = path_;
      for (int i = x * channels; i < (x + 1) * channels; ++i) before[i] = seen[i];
    }
  }
}

float MotionMask::reduced_length(double px) const {
  return static_cast<float>(px * image_.cols / full_size_.width);
}

void MotionMask::start(const std::vector<cv::Point2f>& object, const std::vector<cv::Point2f>& background,
                       int images_ago, double moved_px) {
  if (image_.empty()) return;  // nothing has been watched
  started_ = true;
  // From images to px: the object moved evenly since, and what was before tells no more.
  const float then =
      path_ - static_cast<float>(images_ago) - 1;  // path_ has been counted on past the last image
  const float moved = reduced_length(moved_px);
  since_ = cv::max((since_ - then) * (moved / static_cast<float>(std::max(images_ago, 1))), 0);
  path_ = moved;
  background_points_.clear();
  for (const cv::Point2f& p : background) background_points_.push_back(reduced_point(p));
  observe(object, 0);
  find_object();
}

void MotionMask::observe(const std::vector<cv::Point2f>& object, double moved_px) {
  path_ += reduced_length(moved_px);
  object_points_.clear();
  for (const cv::Point2f& p : object) object_points_.push_back(reduced_point(p));
  // The first image's background features have said their part once the still texture speaks.
  if (path_ > 4 * kStillPath) background_points_.clear();
}

// 255 where the texture has not changed while the object moved by this distance.
cv::Mat MotionMask::still_texture() const {
  const cv::Mat texture = texture_of(image_);
  const cv::Mat still = texture & (path_ - since_ >= std::min(kStillPath, path_));
  cv::Mat share_still, share_textured;
  cv::boxFilter(still, share_still, CV_32F, {kAgreeWindow, kAgreeWindow});
  cv::boxFilter(texture, share_textured, CV_32F, {kAgreeWindow, kAgreeWindow});
  return still & (share_still >= kMinAgree * share_textured);
}

// Known background without the object.
cv::Mat MotionMask::known_outside() const { return outside_.empty() ? known_ : outside_ & known_; }

cv::Mat MotionMask::nearer_to_object(const cv::Mat& still, const cv::Mat& to_object) const {
  const cv::Mat to_background = distance_to(background_points_, still, image_.size());
  return (to_object < to_background) & (to_object < kObjectReach);
}

// The components with features of the object.
cv::Mat MotionMask::with_object_points(const cv::Mat& cleaned) const {
  cv::Mat labels;
  const int count = cv::connectedComponents(cleaned, labels, 8, CV_32S);
  std::vector<int> points(count, 0);
  int all = 0;
  for (const cv::Point& p : object_points_) {
    const int label = labels.at<int>(p);
    if (label == 0) continue;
    ++points[label];
    ++all;
  }
  cv::Mat kept = cv::Mat::zeros(cleaned.size(), CV_8UC1);
  for (int y = 0; y < kept.rows; ++y) {
    const int* label = labels.ptr<int>(y);
    auto* out = kept.ptr<std::uint8_t>(y);
    for (int x = 0; x < kept.cols; ++x) {
      if (label[x] > 0 && points[label[x]] >= kComponentShare * all) out[x] = 255;
    }
  }
  return kept;
}

void MotionMask::find_object() {
  const cv::Mat still = still_texture();
  const cv::Mat to_object = distance_to(object_points_, cv::Mat(), image_.size());
  const cv::Mat near_object = nearer_to_object(still, to_object);
  const cv::Mat differs = background_.foreground(image_, known_outside());
  const double known = cv::countNonZero(known_), gone = cv::countNonZero(known_ & differs);
  images_lost_ = known > 0.2 * known_.total() && gone > kLostShare * known ? images_lost_ + 1 : 0;
  if (images_lost_ >= kLostImages) {
    images_lost_ = 0;
    begin(image_);
  }
  const cv::Mat foreground = (known_ & differs) | (~known_ & near_object);
  const double min_area = options_.min_area * static_cast<double>(image_.total());
  cv::Mat found =
      with_object_points(clean_mask(foreground, kOpeningRadius, kClosingRadius, 1 << 20, min_area));
  learn(still, near_object, to_object, found);
  mask_ = enlarged(found, full_size_);
}

void MotionMask::learn(const cv::Mat& still, const cv::Mat& near_object, const cv::Mat& to_object,
                       const cv::Mat& found) {
  outside_ = outside_of(found, kUpdateRadius);
  background_.update(image_, outside_ & known_);
  // Textureless surfaces never change: they are learnt only well away from the object.
  const cv::Mat plain =
      ~near_object & outside_ & (to_object > kObjectClear) & (path_ - since_ >= std::min(kStillPath, path_));
  const cv::Mat fresh = (still | plain) & ~known_;
  // Wrongly learnt, or moved since: pixels that are static for twice as long become background after all.
  const cv::Mat changed = still & known_ & found & (path_ - since_ >= 2 * kStillPath);
  const cv::Mat learnt = fresh | changed;
  background_.set(image_, learnt);
  known_ |= learnt;
}

cv::Mat MotionMask::mask_of(const cv::Mat& image) const {
  const cv::Mat small = reduced(image);
  if (small.size() != known_.size() || small.type() != unchanged_.type()) return {};
  const cv::Mat foreground = background_.foreground(small, known_) | ~known_;
  return enlarged(clean_mask(foreground, kOpeningRadius, kClosingRadius, options_.objects,
                             options_.min_area * static_cast<double>(small.total())),
                  image.size());
}

}  // namespace mono_pose_tracker
