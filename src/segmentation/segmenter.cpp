#include "segmentation/segmenter.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "reduced_image.h"
#include "segmentation/backdrop.h"
#include "segmentation/mask_cleaning.h"

namespace mono_pose_tracker {

namespace {

// Number of images to learn from: enough for median and spread of a pixel; more would only use memory.
constexpr int kLearningImages = 15;

std::string text(const cv::Size& size) {
  return std::to_string(size.width) + "x" + std::to_string(size.height);
}

}  // namespace

Segmenter::Segmenter(const SegmentationOptions& options, const cv::Mat& background_image)
    : options_(options), background_image_(background_image) {
  forget();
}

void Segmenter::forget() {
  background_ = BackgroundModel(model_options(options_));
  learning_.clear();
  learning_seen_ = 0;
  outside_ = cv::Mat();
}

Segmentation Segmenter::segment(const cv::Mat& image, const cv::Mat& given) {
  return find(image, given, true);
}

Segmentation Segmenter::segment_again(const cv::Mat& image, const cv::Mat& given) {
  return find(image, given, false);
}

Segmentation Segmenter::find(const cv::Mat& image, const cv::Mat& given, bool learn) {
  if (options_.is_off()) return {};
  if (!background_image_.empty() && background_image_.size() != image.size()) {
    // Scaling would make it another view.
    Segmentation refused;
    refused.reason = Reason::kImageSizeMismatch;
    refused.text = "segmentation/background_image is " + text(background_image_.size()) + ", the image " +
                   text(image.size());
    return refused;
  }
  Segmentation result = find_unaided(image, learn);
  if (!result.mask.empty()) {
    result.mask = enlarged(result.mask, image.size());
    result.method = options_.method;
  } else if (!given.empty()) {
    result.method = Segmentation::kGivenMask;
  }
  if (!given.empty()) result.mask = result.mask.empty() ? given != 0 : (given != 0) & result.mask;
  return result;
}

Segmentation Segmenter::find_unaided(const cv::Mat& image, bool learn) {
  Segmentation result;
  if (options_.is_by_background()) {
    result = by_background(reduced(image), learn);
  } else if (options_.is_by_threshold()) {
    const Backdrop backdrop = options_.backdrop == "dark"     ? Backdrop::kDark
                              : options_.backdrop == "bright" ? Backdrop::kBright
                                                              : Backdrop::kAuto;
    result.mask = clean(threshold_foreground(reduced(image), backdrop, options_.level));
  } else if (options_.is_by_chroma()) {
    const Chroma chroma = options_.chroma_color == "blue" ? Chroma::kBlue : Chroma::kGreen;
    result.mask = clean(chroma_foreground(reduced(image), chroma, options_.level));
  }
  return result;
}

Segmentation Segmenter::by_background(const cv::Mat& small, bool learn) {
  // Another camera or encoding: everything learnt so far is invalid.
  const auto is_of_another = [&](const auto& model) {
    return model.size() != small.size() || model.channels() != small.channels();
  };
  if ((!background_.empty() && is_of_another(background_)) ||
      (!learning_.empty() && is_of_another(learning_.front()))) {
    forget();
  }
  Segmentation result;
  if (background_.empty() && !learn_background(small, learn, &result)) return result;
  result.mask = clean(background_.foreground(small, outside_));
  if (learn) {
    outside_ = outside_of(result.mask, kUpdateRadius);
    background_.update(small, outside_);
  }
  return result;
}

// True if there is a background model. Otherwise the result has the reason, and its mask is empty.
bool Segmenter::learn_background(const cv::Mat& small, bool learn, Segmentation* result) {
  if (!background_image_.empty()) {
    cv::Mat image;
    cv::resize(background_image_, image, small.size(), 0, 0, cv::INTER_AREA);
    if (small.channels() == 1) cv::cvtColor(image, image, cv::COLOR_BGR2GRAY);
    constexpr double kSigma = 2;  // grey levels: noise of a webcam at half its size
    background_.learn(image, kSigma);
    return true;
  }
  if (learn) {
    const int step = (options_.learning_frames + kLearningImages - 1) / kLearningImages;
    if (learning_seen_ % step == 0) learning_.push_back(small.clone());
    if (++learning_seen_ >= options_.learning_frames) {
      background_.learn(learning_);
      learning_.clear();
    }
  }
  result->mask = cv::Mat::zeros(small.size(), CV_8UC1);
  result->reason = Reason::kLearningBackground;
  result->text = "learning the background: image " + std::to_string(learning_seen_) + " of " +
                 std::to_string(options_.learning_frames);
  return false;
}

cv::Mat Segmenter::clean(const cv::Mat& raw) const {
  return clean_mask(raw, kOpeningRadius, kClosingRadius, options_.objects, options_.min_area * raw.total());
}

}  // namespace mono_pose_tracker
