#include "segmentation/object_outline.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <opencv2/imgproc.hpp>
#include <utility>
#include <vector>

#include "background_model.h"
#include "common/statistics.h"

namespace mono_pose_tracker {
namespace {

cv::Mat disc(int radius) {
  return cv::getStructuringElement(cv::MORPH_ELLIPSE, {2 * radius + 1, 2 * radius + 1});
}

// The largest components, with their holes filled.
cv::Mat largest_filled(const cv::Mat& mask, int objects, double min_area_px) {
  std::vector<std::vector<cv::Point>> contours;
  cv::findContours(mask, contours, cv::RETR_EXTERNAL, cv::CHAIN_APPROX_NONE);
  std::vector<std::pair<double, int>> by_area;
  for (std::size_t i = 0; i < contours.size(); ++i) {
    // A contour runs through the outer pixels' centres: half a pixel is outside it all round.
    const double area = cv::contourArea(contours[i]) + 0.5 * static_cast<double>(contours[i].size()) + 1;
    if (area >= min_area_px) by_area.emplace_back(-area, static_cast<int>(i));
  }
  std::sort(by_area.begin(), by_area.end());
  if (static_cast<int>(by_area.size()) > objects) by_area.resize(objects);
  cv::Mat kept = cv::Mat::zeros(mask.size(), CV_8UC1);
  for (const auto& entry : by_area) cv::drawContours(kept, contours, entry.second, 255, cv::FILLED);
  return kept;
}

}  // namespace

void fill_holes(cv::Mat* mask) {
  std::vector<std::vector<cv::Point>> contours;
  cv::findContours(*mask, contours, cv::RETR_EXTERNAL, cv::CHAIN_APPROX_NONE);
  cv::drawContours(*mask, contours, -1, 255, cv::FILLED);
}

cv::Mat clean_mask(const cv::Mat& raw, int opening_radius, int closing_radius, int objects,
                   double min_area_px) {
  // The border is replicated: objects often extend beyond the image.
  const int pad = std::max(opening_radius, closing_radius) + 1;
  cv::Mat mask;
  cv::copyMakeBorder(raw, mask, pad, pad, pad, pad, cv::BORDER_REPLICATE);
  if (opening_radius > 0) cv::morphologyEx(mask, mask, cv::MORPH_OPEN, disc(opening_radius));
  if (closing_radius > 0) cv::morphologyEx(mask, mask, cv::MORPH_CLOSE, disc(closing_radius));
  mask = mask(cv::Rect(pad, pad, raw.cols, raw.rows)).clone();
  return largest_filled(mask, objects, min_area_px);
}

cv::Mat clearance_of(const cv::Mat& mask, double margin_px, double margin_scales, int scale_steps) {
  cv::Mat distance;
  cv::distanceTransform(mask, distance, cv::DIST_L2, cv::DIST_MASK_3);
  cv::Mat clearance(mask.size(), CV_8UC1);
  const auto steps = static_cast<float>(scale_steps / std::max(margin_scales, 1e-3));
  const auto margin = static_cast<float>(margin_px);
  for (int y = 0; y < mask.rows; ++y) {
    const float* d = distance.ptr<float>(y);
    auto* c = clearance.ptr<std::uint8_t>(y);
    for (int x = 0; x < mask.cols; ++x) {
      const float room = d[x] - margin;  // px; distances count from the centre of the nearest pixel outside
      c[x] = room <= 0 ? 0 : static_cast<std::uint8_t>(std::min(255.f, room * steps + 0.5f));
    }
  }
  return clearance;
}

cv::Mat1f distances_from(const std::vector<cv::Point2f>& points, const cv::Size& size) {
  cv::Mat1b places(size, 255);
  for (const cv::Point2f& p : points) {
    const cv::Point pixel(static_cast<int>(std::lround(p.x)), static_cast<int>(std::lround(p.y)));
    if (cv::Rect(cv::Point(), size).contains(pixel)) places(pixel) = 0;
  }
  if (cv::countNonZero(places) == static_cast<int>(places.total())) {
    return cv::Mat1f(size, static_cast<float>(size.width + size.height));
  }
  cv::Mat1f distance;
  cv::distanceTransform(places, distance, cv::DIST_L2, cv::DIST_MASK_5);
  return distance;
}

float reach_of(const std::vector<cv::Point2f>& points) {
  std::vector<double> x, y, away;
  for (const cv::Point2f& p : points) x.push_back(p.x), y.push_back(p.y);
  const double middle_x = median(std::move(x)), middle_y = median(std::move(y));
  for (const cv::Point2f& p : points) away.push_back(std::hypot(p.x - middle_x, p.y - middle_y));
  return static_cast<float>(median(std::move(away)) / 2);
}

namespace {

std::vector<cv::Point2f> reduced_points(const std::vector<cv::Point2f>& points, const cv::Size& full,
                                        const cv::Size& small) {
  std::vector<cv::Point2f> inside;
  for (const cv::Point2f& p : points) {
    const cv::Point pixel(static_cast<int>(std::floor((p.x + 0.5F) * small.width / full.width)),
                          static_cast<int>(std::floor((p.y + 0.5F) * small.height / full.height)));
    if (cv::Rect(cv::Point(), small).contains(pixel)) inside.emplace_back(pixel);
  }
  return inside;
}

// Initial labels from the points alone: certain and probable pixels.
cv::Mat1b beginning(const std::vector<cv::Point2f>& object, const std::vector<cv::Point2f>& other,
                    const cv::Size& size, const OutlineOptions& options) {
  const cv::Mat1f from_object = distances_from(object, size), from_other = distances_from(other, size);
  const float reach = reach_of(object);
  cv::Mat1b labels(size, cv::GC_PR_BGD);
  labels.setTo(cv::GC_PR_FGD, (from_object <= reach) & (from_object < from_other));
  labels.setTo(cv::GC_BGD, (from_object > 2 * reach) | (from_other < options.of_feature));
  labels.setTo(cv::GC_FGD, (from_object < options.of_feature) & (from_other > options.apart));
  return labels;
}

// Overexposed and drawn images have large areas of one colour, on which OpenCV's graph cut takes very long.
// Adds noise of the given deviation, grey levels.
cv::Mat with_noise(const cv::Mat& image, double sigma) {
  cv::Mat noise(image.size(), CV_16SC3), noisy;
  cv::RNG(0).fill(noise, cv::RNG::NORMAL, 0, sigma);
  cv::Mat color = image;
  if (image.channels() == 1) cv::cvtColor(image, color, cv::COLOR_GRAY2BGR);
  cv::add(color, noise, noisy, cv::noArray(), CV_8U);
  return noisy;
}

// OpenCV initialises the colour clusters at random: with the same seed each time, and without changing the
// caller's random numbers.
bool cut(const cv::Mat& image, const OutlineOptions& options, cv::Mat1b* labels) {
  cv::Mat background, foreground;
  const cv::RNG of_others = cv::theRNG();
  cv::theRNG() = cv::RNG(0);
  bool is_cut = true;
  try {
    cv::grabCut(with_noise(image, options.sigma), *labels, cv::Rect(), background, foreground, options.rounds,
                cv::GC_INIT_WITH_MASK);
  } catch (const cv::Exception&) {
    is_cut = false;  // colours that make no clusters: there is no outline
  }
  cv::theRNG() = of_others;
  return is_cut;
}

bool has_both(const cv::Mat1b& labels) {
  const cv::Mat1b of_object = labels & 1;  // GC_FGD, GC_PR_FGD
  const int count = cv::countNonZero(of_object);
  return count > 0 && count < static_cast<int>(of_object.total());
}

// The pieces with enough points, holes filled; empty if too many points are in none.
cv::Mat pieces_with_points(const cv::Mat1b& of_object, const std::vector<cv::Point2f>& object,
                           const OutlineOptions& options) {
  cv::Mat1i piece;
  std::vector<int> held(cv::connectedComponents(of_object, piece), 0);
  for (const cv::Point2f& p : object) ++held[piece(cv::Point(p))];
  cv::Mat kept = cv::Mat::zeros(of_object.size(), CV_8UC1);
  double all = 0;
  for (std::size_t i = 1; i < held.size(); ++i) {
    if (held[i] < options.min_of_piece * static_cast<double>(object.size())) continue;
    all += held[i];
    kept.setTo(255, piece == static_cast<int>(i));
  }
  if (all < options.min_held * static_cast<double>(object.size())) return {};
  fill_holes(&kept);
  return kept;
}

}  // namespace

cv::Mat outline_object(const cv::Mat& image, const ObjectPoints& points, const OutlineOptions& options) {
  const cv::Mat small = reduced(image);
  const std::vector<cv::Point2f> object = reduced_points(points.object, image.size(), small.size());
  const std::vector<cv::Point2f> other = reduced_points(points.other, image.size(), small.size());
  if (object.size() < options.min_points) return {};
  cv::Mat1b labels = beginning(object, other, small.size(), options);
  if (!has_both(labels) || !cut(small, options, &labels)) return {};
  cv::Mat1b of_object = (labels & 1) * 255;
  cv::morphologyEx(of_object, of_object, cv::MORPH_OPEN, cv::Mat());
  const cv::Mat kept = pieces_with_points(of_object, object, options);
  return kept.empty() ? kept : enlarged(kept, image.size());
}

}  // namespace mono_pose_tracker
