#include "background_model.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <opencv2/imgproc.hpp>

namespace mono_pose_tracker {
namespace {

// The upper median of a few values, which are reordered.
float median_of(std::vector<float>* values) {
  const auto middle = values->begin() + static_cast<std::ptrdiff_t>(values->size() / 2);
  std::nth_element(values->begin(), middle, values->end());
  return *middle;
}

}  // namespace

void BackgroundModel::learn(const std::vector<cv::Mat>& images) {
  const int channels = images.front().channels();
  mean_.create(images.front().size(), CV_32FC(channels));
  sigma_.create(mean_.size(), mean_.type());
  std::vector<const std::uint8_t*> rows(images.size());
  std::vector<float> values(images.size());
  for (int y = 0; y < mean_.rows; ++y) {
    for (std::size_t i = 0; i < images.size(); ++i) rows[i] = images[i].ptr<std::uint8_t>(y);
    auto* mean = mean_.ptr<float>(y);
    auto* sigma = sigma_.ptr<float>(y);
    for (int x = 0; x < mean_.cols * channels; ++x) {
      for (std::size_t i = 0; i < images.size(); ++i) values[i] = rows[i][x];
      mean[x] = median_of(&values);
      for (float& v : values) v = std::abs(v - mean[x]);
      const float sigma_of_mad = 1.4826F * median_of(&values);  // of normal noise
      sigma[x] = std::clamp(sigma_of_mad, options_.min_sigma, options_.max_sigma);
    }
  }
  // A dozen values do not determine one pixel's noise, but its neighbours have similar noise.
  cv::blur(sigma_, sigma_, {5, 5});
}

void BackgroundModel::learn(const cv::Mat& image, double sigma) {
  image.convertTo(mean_, CV_32F);
  sigma_ = cv::Mat(mean_.size(), mean_.type(), cv::Scalar::all(std::max<double>(sigma, options_.min_sigma)));
}

// Ratio of the model's to the image's brightness, the median over likely background.
float BackgroundModel::exposure_gain(const cv::Mat& image, const cv::Mat& outside) const {
  const int channels = image.channels();
  std::vector<float> ratios;
  for (int y = 0; y < image.rows; y += options_.exposure_step) {
    for (int x = 0; x < image.cols; x += options_.exposure_step) {
      if (!outside.empty() && outside.at<std::uint8_t>(y, x) == 0) continue;
      float seen = 0, expected = 0;
      for (int c = 0; c < channels; ++c) {
        seen += image.ptr<std::uint8_t>(y)[x * channels + c];
        expected += mean_.ptr<float>(y)[x * channels + c];
      }
      if (std::min(seen, expected) > options_.too_dark * static_cast<float>(channels) &&
          std::max(seen, expected) < options_.clipped * static_cast<float>(channels)) {
        ratios.push_back(expected / seen);
      }
    }
  }
  return ratios.size() < options_.min_exposure_ratios ? 1.f : std::clamp(median_of(&ratios), 0.5f, 2.f);
}

cv::Mat BackgroundModel::foreground(const cv::Mat& image, const cv::Mat& outside) const {
  const float gain = exposure_gain(image, outside);
  const int channels = image.channels();
  const auto sigmas = static_cast<float>(options_.sigmas);
  const auto least = static_cast<float>(options_.min_difference);
  cv::Mat foreground(image.size(), CV_8UC1);
  for (int y = 0; y < image.rows; ++y) {
    const auto* seen = image.ptr<std::uint8_t>(y);
    const float* mean = mean_.ptr<float>(y);
    const float* sigma = sigma_.ptr<float>(y);
    auto* out = foreground.ptr<std::uint8_t>(y);
    for (int x = 0; x < image.cols; ++x) {
      bool differs = false;
      for (int i = x * channels; i < (x + 1) * channels; ++i) {
        differs |= std::abs(gain * seen[i] - mean[i]) > std::max(sigmas * sigma[i], least);
      }
      out[x] = differs ? 255 : 0;
    }
  }
  if (options_.shadow < 1) remove_shadows(image, gain, &foreground);
  return foreground;
}

// Ratio of actual to expected brightness, by windows.
cv::Mat BackgroundModel::brightness_ratio(const cv::Mat& image, float gain) const {
  const cv::Size window(options_.shadow_window, options_.shadow_window);
  const int channels = image.channels();
  cv::Mat seen(image.size(), CV_32FC1), expected(image.size(), CV_32FC1);
  for (int y = 0; y < image.rows; ++y) {
    const auto* pixel = image.ptr<std::uint8_t>(y);
    const float* mean = mean_.ptr<float>(y);
    float* s = seen.ptr<float>(y);
    float* e = expected.ptr<float>(y);
    for (int x = 0; x < image.cols; ++x) {
      s[x] = e[x] = 0;
      for (int i = x * channels; i < (x + 1) * channels; ++i) {
        s[x] += gain * pixel[i];
        e[x] += mean[i];
      }
    }
  }
  cv::boxFilter(seen, seen, CV_32F, window);
  cv::boxFilter(expected, expected, CV_32F, window);
  return seen / cv::max(expected, 1.f);
}

// True when the pixel is background, dimmed like a window around it or next to it. Windows across a shadow's
// edge have the dimming of neither side.
bool BackgroundModel::is_dimmed(const std::uint8_t* pixel, float gain, const cv::Mat& ratio, int y,
                                int x) const {
  const int by = options_.shadow_shift;
  const int shifts[5][2] = {{0, 0}, {-by, -by}, {-by, by}, {by, -by}, {by, by}};
  const int channels = mean_.channels();
  const float* mean = mean_.ptr<float>(y) + x * channels;
  const float* sigma = sigma_.ptr<float>(y) + x * channels;
  const auto sigmas = static_cast<float>(options_.sigmas),
             least = static_cast<float>(options_.min_difference);
  for (const auto& shift : shifts) {
    const int v = std::clamp(y + shift[0], 0, ratio.rows - 1),
              u = std::clamp(x + shift[1], 0, ratio.cols - 1);
    const float r = ratio.at<float>(v, u);
    if (r >= 1 || r < options_.shadow) continue;
    bool fits = true;
    for (int c = 0; c < channels; ++c) {
      fits &= std::abs(gain * pixel[c] - r * mean[c]) <= std::max(sigmas * sigma[c], least);
    }
    if (fits) return true;
  }
  return false;
}

// In a shadow the background keeps its texture and is dimmed by a constant share.
void BackgroundModel::remove_shadows(const cv::Mat& image, float gain, cv::Mat* foreground) const {
  const cv::Size window(options_.shadow_window, options_.shadow_window);
  const cv::Mat ratio = brightness_ratio(image, gain);
  cv::Mat background = ~*foreground;
  for (int y = 0; y < image.rows; ++y) {
    const auto* pixel = image.ptr<std::uint8_t>(y);
    auto* is_background = background.ptr<std::uint8_t>(y);
    for (int x = 0; x < image.cols; ++x) {
      if (!is_background[x] && is_dimmed(pixel + x * image.channels(), gain, ratio, y, x))
        is_background[x] = 255;
    }
  }
  cv::Mat share;
  cv::boxFilter(background, share, CV_32F, window);
  foreground->setTo(0, background & (share >= 255 * options_.min_shadow_share));
}

cv::Mat BackgroundModel::with_exposure_of_model(const cv::Mat& image, const cv::Mat& outside) const {
  const float gain = exposure_gain(image, outside);
  // Below one percent it is noise: the image is unchanged.
  if (std::abs(gain - 1) < 0.01f) return image;
  cv::Mat compensated;
  image.convertTo(compensated, -1, gain);
  return compensated;
}

void BackgroundModel::set(const cv::Mat& image, const cv::Mat& where) {
  cv::Mat values;
  image.convertTo(values, CV_32F);
  values.copyTo(mean_, where);
}

void BackgroundModel::update(const cv::Mat& image, const cv::Mat& outside) {
  if (options_.update_rate <= 0) return;
  const int channels = image.channels();
  // At the exposure of the model, so that pixels behind the object stay comparable.
  const float gain = exposure_gain(image, outside);
  const auto rate = static_cast<float>(options_.update_rate);
  for (int y = 0; y < image.rows; ++y) {
    const auto* seen = image.ptr<std::uint8_t>(y);
    const auto* use = outside.ptr<std::uint8_t>(y);
    float* mean = mean_.ptr<float>(y);
    for (int x = 0; x < image.cols; ++x) {
      if (use[x] == 0) continue;
      for (int i = x * channels; i < (x + 1) * channels; ++i) mean[i] += rate * (gain * seen[i] - mean[i]);
    }
  }
}

cv::Mat reduced(const cv::Mat& image, int working_width) {
  if (image.cols <= working_width) return image;
  const int height =
      std::max(1, static_cast<int>(std::lround(1.0 * image.rows * working_width / image.cols)));
  cv::Mat small;
  cv::resize(image, small, {working_width, height}, 0, 0, cv::INTER_AREA);
  return small;
}

cv::Mat enlarged(const cv::Mat& mask, const cv::Size& size) {
  if (mask.size() == size) return mask;
  cv::Mat large;
  cv::resize(mask, large, size, 0, 0, cv::INTER_LINEAR);
  return large >= 128;
}

cv::Mat outside_of(const cv::Mat& mask, int radius) {
  cv::Mat grown;
  cv::dilate(mask, grown, cv::getStructuringElement(cv::MORPH_RECT, {2 * radius + 1, 2 * radius + 1}));
  return grown == 0;
}

cv::Mat gray_of(const cv::Mat& image) {
  if (image.channels() == 1) return image;
  cv::Mat gray;
  cv::cvtColor(image, gray, cv::COLOR_BGR2GRAY);
  return gray;
}

BackgroundModelOptions model_options(const SegmentationOptions& options) {
  BackgroundModelOptions model;
  model.sigmas = options.background_sigmas;
  model.min_difference = options.background_min_difference;
  model.shadow = options.shadow;
  model.update_rate = options.update_rate;
  return model;
}

}  // namespace mono_pose_tracker
