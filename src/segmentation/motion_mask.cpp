#include "segmentation/motion_mask.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <opencv2/imgproc.hpp>

#include "background_model.h"
#include "segmentation/object_outline.h"

namespace mono_pose_tracker {
namespace {

cv::Mat texture_of(const cv::Mat& image, const MotionMaskOptions& thresholds) {
  const cv::Mat gray = gray_of(image);
  const cv::Mat window = cv::Mat::ones(thresholds.texture_window, thresholds.texture_window, CV_8U);
  cv::Mat high, low;
  cv::dilate(gray, high, window);
  cv::erode(gray, low, window);
  return high - low > thresholds.min_texture;
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

MotionMask::MotionMask(const SegmentationOptions& options, const MotionMaskOptions& thresholds)
    : options_(options), thresholds_(thresholds), background_(model_options(options)) {}

void MotionMask::reset() { *this = MotionMask(options_, thresholds_); }

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
  background_.learn(small, thresholds_.sigma);
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
  if (path_ > 4 * thresholds_.still_path) background_points_.clear();
}

// 255 where the texture has not changed while the object moved by this distance.
cv::Mat MotionMask::still_texture() const {
  const cv::Mat texture = texture_of(image_, thresholds_);
  const cv::Mat still = texture & (path_ - since_ >= std::min(thresholds_.still_path, path_));
  const cv::Size window(thresholds_.agreement_window, thresholds_.agreement_window);
  cv::Mat share_still, share_textured;
  cv::boxFilter(still, share_still, CV_32F, window);
  cv::boxFilter(texture, share_textured, CV_32F, window);
  return still & (share_still >= thresholds_.min_agreement * share_textured);
}

// Known background without the object.
cv::Mat MotionMask::known_outside() const { return outside_.empty() ? known_ : outside_ & known_; }

cv::Mat MotionMask::nearer_to_object(const cv::Mat& still, const cv::Mat& to_object) const {
  const cv::Mat to_background = distance_to(background_points_, still, image_.size());
  return (to_object < to_background) & (to_object < thresholds_.object_reach);
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
      if (label[x] > 0 && points[label[x]] >= thresholds_.component_share * all) out[x] = 255;
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
  images_lost_ = known > thresholds_.min_known_share * known_.total() && gone > thresholds_.lost_share * known
                     ? images_lost_ + 1
                     : 0;
  if (images_lost_ >= thresholds_.lost_images) {
    images_lost_ = 0;
    begin(image_);
  }
  const cv::Mat foreground = (known_ & differs) | (~known_ & near_object);
  const double min_area = options_.min_area * static_cast<double>(image_.total());
  cv::Mat found = with_object_points(
      clean_mask(foreground, thresholds_.radii.opening, thresholds_.radii.closing, 1 << 20, min_area));
  learn(still, near_object, to_object, found);
  mask_ = enlarged(found, full_size_);
}

void MotionMask::learn(const cv::Mat& still, const cv::Mat& near_object, const cv::Mat& to_object,
                       const cv::Mat& found) {
  outside_ = outside_of(found, thresholds_.radii.motion_blur);
  background_.update(image_, outside_ & known_);
  // Textureless surfaces never change: they are learnt only well away from the object.
  const cv::Mat plain = ~near_object & outside_ & (to_object > thresholds_.object_clear) &
                        (path_ - since_ >= std::min(thresholds_.still_path, path_));
  const cv::Mat fresh = (still | plain) & ~known_;
  // Wrongly learnt, or moved since: pixels that are static for twice as long become background after all.
  const cv::Mat changed = still & known_ & found & (path_ - since_ >= 2 * thresholds_.still_path);
  const cv::Mat learnt = fresh | changed;
  background_.set(image_, learnt);
  known_ |= learnt;
}

cv::Mat MotionMask::mask_of(const cv::Mat& image) const {
  const cv::Mat small = reduced(image);
  if (small.size() != known_.size() || small.type() != unchanged_.type()) return {};
  const cv::Mat foreground = background_.foreground(small, known_) | ~known_;
  return enlarged(clean_mask(foreground, thresholds_.radii.opening, thresholds_.radii.closing,
                             options_.objects, options_.min_area * static_cast<double>(small.total())),
                  image.size());
}

}  // namespace mono_pose_tracker
