#include "segmentation/segmenter.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <opencv2/imgproc.hpp>

#include "background_model.h"
#include "segmentation/object_outline.h"

namespace mono_pose_tracker {
namespace {

using Histogram = std::array<double, 256>;

Histogram histogram_of(const cv::Mat& gray) {
  Histogram histogram{};
  for (int y = 0; y < gray.rows; ++y) {
    const auto* row = gray.ptr<std::uint8_t>(y);
    for (int x = 0; x < gray.cols; ++x) ++histogram[row[x]];
  }
  return histogram;
}

// Share of the pixels of the image's border up to a level; objects touch one side of it, rarely two.
double border_share_up_to(const cv::Mat& gray, int level) {
  double below = 0, all = 0;
  for (int y = 0; y < gray.rows; ++y) {
    const bool whole_row = y == 0 || y == gray.rows - 1;
    for (int x = 0; x < gray.cols; x += whole_row ? 1 : std::max(gray.cols - 1, 1)) {
      below += gray.at<std::uint8_t>(y, x) <= level;
      ++all;
    }
  }
  return below / all;
}

// Level above a dark backdrop. An object with dark and bright parts makes three classes, and Otsu's cut may
// separate the wrong two: the lower class is split again as long as it has two classes and the darker one
// covers most of the border.
int level_above_dark(const cv::Mat& gray, const BackdropOptions& limits) {
  Histogram histogram = histogram_of(gray);
  int level = otsu_cut(histogram).level;
  for (int i = 0; i < 2; ++i) {
    std::fill(histogram.begin() + level + 1, histogram.end(), 0.0);
    const OtsuCut next = otsu_cut(histogram);
    const double between = std::accumulate(histogram.begin() + next.level + 1, histogram.end(), 0.0);
    if (next.separation < limits.two_classes ||
        between < limits.min_class_share * static_cast<double>(gray.total()) ||
        border_share_up_to(gray, next.level) < limits.most_of_border) {
      break;
    }
    level = next.level;
  }
  return level;
}

// Smoothed: noise would widen the classes, and specks do not affect the level.
cv::Mat smoothed(const cv::Mat& gray) {
  cv::Mat smooth;
  cv::GaussianBlur(gray, smooth, {5, 5}, 0);
  return smooth;
}

}  // namespace

OtsuCut otsu_cut(const std::array<double, 256>& histogram) {
  double count = 0, sum = 0, square_sum = 0;
  for (int i = 0; i < 256; ++i) {
    count += histogram[i];
    sum += i * histogram[i];
    square_sum += static_cast<double>(i) * i * histogram[i];
  }
  OtsuCut cut;
  if (count == 0) return cut;
  const double variance = square_sum / count - (sum / count) * (sum / count);
  double below = 0, below_sum = 0;
  for (int i = 0; i < 255; ++i) {
    below += histogram[i];
    below_sum += i * histogram[i];
    const double above = count - below;
    if (below == 0 || above == 0) continue;
    const double apart = below_sum / below - (sum - below_sum) / above;
    const double between = below * above * apart * apart / (count * count);
    if (variance > 0 && between / variance > cut.separation) cut = {i, between / variance};
  }
  return cut;
}

cv::Mat threshold_foreground(const cv::Mat& image, Backdrop backdrop, double level,
                             const BackdropOptions& limits) {
  const cv::Mat gray = smoothed(gray_of(image));
  if (backdrop == Backdrop::kAuto) {
    const int cut = level >= 0 ? static_cast<int>(level) : otsu_cut(histogram_of(gray)).level;
    backdrop = border_share_up_to(gray, cut) >= limits.most_of_border ? Backdrop::kDark : Backdrop::kBright;
  }
  if (backdrop == Backdrop::kDark) return gray > (level >= 0 ? level : level_above_dark(gray, limits));
  if (level >= 0) return gray <= level;
  const cv::Mat inverted = 255 - gray;
  return inverted > level_above_dark(inverted, limits);
}

cv::Mat chroma_foreground(const cv::Mat& image, Chroma chroma, double level) {
  if (image.channels() != 3) return cv::Mat(image.size(), CV_8UC1, cv::Scalar(255));
  cv::Mat bgr[3];
  cv::split(image, bgr);
  const int backdrop = chroma == Chroma::kBlue ? 0 : 1;
  cv::Mat others, excess;
  cv::max(bgr[1 - backdrop], bgr[2], others);
  cv::subtract(bgr[backdrop], others, excess);  // saturates at 0
  excess = smoothed(excess);
  return excess <= (level >= 0 ? level : otsu_cut(histogram_of(excess)).level);
}

namespace {

std::string text(const cv::Size& size) {
  return std::to_string(size.width) + "x" + std::to_string(size.height);
}

}  // namespace

Segmenter::Segmenter(const SegmentationOptions& options, const cv::Mat& background_image,
                     const SegmenterLimits& limits)
    : options_(options), limits_(limits), background_image_(background_image) {
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
    outside_ = outside_of(result.mask, limits_.radii.motion_blur);
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
    background_.learn(image, limits_.given_image_sigma);
    return true;
  }
  if (learn) {
    const int step = (options_.learning_frames + limits_.learning_images - 1) / limits_.learning_images;
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
  return clean_mask(raw, limits_.radii.opening, limits_.radii.closing, options_.objects,
                    options_.min_area * raw.total());
}

}  // namespace mono_pose_tracker
