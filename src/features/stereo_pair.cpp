#include "features/stereo_pair.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

namespace mono_pose_tracker {
namespace {

// Reduced, without the slow variations.
cv::Mat details_of(const cv::Mat& half, const StereoPairOptions& options) {
  const int width = options.compared_width;
  const int height = std::max(options.min_compared_height, width * half.rows / half.cols);
  cv::Mat small, slow;
  cv::resize(half, small, {width, height}, 0, 0, cv::INTER_AREA);
  small.convertTo(small, CV_32F);
  cv::GaussianBlur(small, slow, {0, 0}, options.slow_sigma);
  return small - slow;
}

// Of the first half within the second, at the best shift along a row.
double correlation(const cv::Mat& first, const cv::Mat& second, const StereoPairOptions& options) {
  const int rows = options.max_row_shift;
  const cv::Mat a = details_of(first, options), b = details_of(second, options);
  const int margin = static_cast<int>(std::ceil(options.max_disparity * a.cols));
  const cv::Mat part = a(cv::Range(2 * rows, a.rows - 2 * rows), cv::Range(margin, a.cols - margin));
  cv::Scalar mean, deviation;
  cv::meanStdDev(part, mean, deviation);
  if (deviation[0] < 1) return 0;  // grey level: nothing to compare
  cv::Mat scores;
  cv::matchTemplate(b(cv::Range(rows, b.rows - rows), cv::Range::all()), part, scores, cv::TM_CCOEFF_NORMED);
  double best = 0;
  cv::minMaxLoc(scores, nullptr, &best);
  return best;
}

}  // namespace

std::string stereo_pair_text(const cv::Mat& image, const StereoPairOptions& options) {
  if (image.empty()) return "";
  const bool is_wide = image.cols >= options.min_aspect * image.rows;
  if (!is_wide && image.rows < options.min_aspect * image.cols) return "";
  cv::Mat grey = image;
  if (image.channels() == 3) cv::cvtColor(image, grey, cv::COLOR_BGR2GRAY);
  const int w = is_wide ? grey.cols / 2 : grey.cols, h = is_wide ? grey.rows : grey.rows / 2;
  if (std::min(w, h) < options.min_side) return "";
  const cv::Mat first = grey(cv::Rect(0, 0, w, h));
  const cv::Mat second = grey(cv::Rect(grey.cols - w, grey.rows - h, w, h));
  if (correlation(first, second, options) < options.min_correlation) return "";
  return std::string("the images look like stereo pairs (") +
         (is_wide ? "left and right halves" : "upper and lower halves") +
         " show the same): one camera is expected, and path and map are wrong otherwise. Crop the images of "
         "one camera";
}

}  // namespace mono_pose_tracker
