#include "io/grey_levels.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <stdexcept>
#include <vector>

#include "common/text.h"

namespace mono_pose_tracker {
namespace {

constexpr int kValues = 65536;

/// Histogram of the colours of an image, without alpha.
std::vector<std::int64_t> histogram(const cv::Mat& image) {
  std::vector<std::int64_t> counts(kValues, 0);
  const int channels = image.channels(), colours = std::min(channels, 3);
  for (int row = 0; row < image.rows; ++row) {
    const auto* pixel = image.ptr<std::uint16_t>(row);
    for (int column = 0; column < image.cols; ++column, pixel += channels) {
      for (int c = 0; c < colours; ++c) ++counts[pixel[c]];
    }
  }
  return counts;
}

/// The value below which this number of pixels lies.
int value_at(const std::vector<std::int64_t>& counts, std::int64_t below) {
  int value = 0;
  for (std::int64_t sum = counts[0]; sum <= below && value + 1 < kValues; sum += counts[++value]) {
  }
  return value;
}

}  // namespace

GreyLevelChoice::GreyLevelChoice(const std::string& setting, const GreyLevelOptions& options)
    : options_(options) {
  if (setting == "auto") return;
  const std::size_t colon = setting.find(':');
  int bits = 0;
  const bool are_levels = colon != std::string::npos &&
                          parse_decimal(setting.substr(0, colon), &levels_.black) &&
                          parse_decimal(setting.substr(colon + 1), &levels_.white) && levels_.black >= 0 &&
                          levels_.white > levels_.black && levels_.white <= kValues;
  if (!are_levels && (!parse_decimal(setting, &bits) || bits < 8 || bits > 16)) {
    throw std::invalid_argument(
        "is '" + setting +
        "': expected auto, a number of bits from 8 to 16, or BLACK:WHITE, such as 7000:9000");
  }
  if (!are_levels) levels_ = {0, std::pow(2.0, bits)};
  reason_ = "as configured";
  is_settled_ = true;
}

bool GreyLevelChoice::look_at(const cv::Mat& image) {
  if (is_settled_ || image.depth() != CV_16U || image.empty()) return false;
  const std::vector<std::int64_t> counts = histogram(image);
  const auto total = static_cast<std::int64_t>(image.total()) * std::min(image.channels(), 3);
  const auto tail = static_cast<std::int64_t>(options_.tail_share * static_cast<double>(total));
  const int brightest = value_at(counts, total - 1);
  if (brightest < options_.least_bright && ++dark_ <= options_.most_dark_images) return false;
  brightest_ = std::max<double>(brightest_, brightest);
  lowest_ = std::min<double>(lowest_, value_at(counts, tail));
  highest_ = std::max<double>(highest_, value_at(counts, total - 1 - tail));
  settle_by_range();
  is_settled_ = ++looked_at_ >= options_.first_images;
  return is_settled_;
}

void GreyLevelChoice::settle_by_range() {
  int bits = 8;
  while (bits < 16 && brightest_ >= std::pow(2.0, bits)) bits += 2;
  const double white = std::pow(2.0, bits), range = highest_ - lowest_;
  const bool is_narrow = range > 0 && range < options_.least_range * white;
  if (is_narrow) {
    levels_.black = std::max(0.0, std::floor(lowest_ - options_.margin * range));
    levels_.white = std::min<double>(kValues, std::ceil(highest_ + options_.margin * range));
    reason_ = formatted("the first images hold values from %.0f to %.0f", lowest_, highest_);
  } else {
    levels_ = {0, white};
    reason_ = formatted("the first images hold values up to %.0f, %d bits", brightest_, bits);
  }
}

std::string GreyLevelChoice::text() const {
  if (reason_.empty()) return "";
  return formatted("16-bit images: %.0f is mapped to black and %.0f to white (%s)", levels_.black,
                   levels_.white, reason_.c_str());
}

}  // namespace mono_pose_tracker
