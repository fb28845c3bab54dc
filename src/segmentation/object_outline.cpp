#include "segmentation/object_outline.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <opencv2/imgproc.hpp>

#include "reduced_image.h"
#include "segmentation/mask_cleaning.h"

namespace mono_pose_tracker {

namespace {

// Fewest points of the object that make a sample of its colours.
constexpr std::size_t kFewest = 20;
// px of the reduced image: the texture within kOfFeature of a feature belongs to the object if no other
// feature is within kApart.
constexpr float kOfFeature = 2, kApart = 4;
// The colours settle in two rounds; further ones move the outline by a pixel.
constexpr int kRounds = 2;
// Share of the object's points that the outline must hold. Some landmarks lie at its rim, where the outline
// may run. Single pieces (a tag that hangs from it) hold smaller shares.
constexpr double kMinHeld = 0.8, kMinOfPiece = 0.05;

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
                    const cv::Size& size) {
  const cv::Mat1f from_object = distances_from(object, size), from_other = distances_from(other, size);
  const float reach = reach_of(object);
  cv::Mat1b labels(size, cv::GC_PR_BGD);
  labels.setTo(cv::GC_PR_FGD, (from_object <= reach) & (from_object < from_other));
  labels.setTo(cv::GC_BGD, (from_object > 2 * reach) | (from_other < kOfFeature));
  labels.setTo(cv::GC_FGD, (from_object < kOfFeature) & (from_other > kApart));
  return labels;
}

// Overexposed and drawn images have large areas of one colour, on which OpenCV's graph cut takes very long.
// Adds as much noise as any camera has.
cv::Mat with_noise(const cv::Mat& image) {
  constexpr double kSigma = 2;  // grey levels
  cv::Mat noise(image.size(), CV_16SC3), noisy;
  cv::RNG(0).fill(noise, cv::RNG::NORMAL, 0, kSigma);
  cv::Mat color = image;
  if (image.channels() == 1) cv::cvtColor(image, color, cv::COLOR_GRAY2BGR);
  cv::add(color, noise, noisy, cv::noArray(), CV_8U);
  return noisy;
}

// OpenCV initialises the colour clusters at random: with the same seed each time, and without changing the
// caller's random numbers.
bool cut(const cv::Mat& image, cv::Mat1b* labels) {
  cv::Mat background, foreground;
  const cv::RNG of_others = cv::theRNG();
  cv::theRNG() = cv::RNG(0);
  bool is_cut = true;
  try {
    cv::grabCut(with_noise(image), *labels, cv::Rect(), background, foreground, kRounds,
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
cv::Mat pieces_with_points(const cv::Mat1b& of_object, const std::vector<cv::Point2f>& object) {
  cv::Mat1i piece;
  std::vector<int> held(cv::connectedComponents(of_object, piece), 0);
  for (const cv::Point2f& p : object) ++held[piece(cv::Point(p))];
  cv::Mat kept = cv::Mat::zeros(of_object.size(), CV_8UC1);
  double all = 0;
  for (std::size_t i = 1; i < held.size(); ++i) {
    if (held[i] < kMinOfPiece * static_cast<double>(object.size())) continue;
    all += held[i];
    kept.setTo(255, piece == static_cast<int>(i));
  }
  if (all < kMinHeld * static_cast<double>(object.size())) return {};
  fill_holes(&kept);
  return kept;
}

}  // namespace

cv::Mat outline_object(const cv::Mat& image, const ObjectPoints& points) {
  const cv::Mat small = reduced(image);
  const std::vector<cv::Point2f> object = reduced_points(points.object, image.size(), small.size());
  const std::vector<cv::Point2f> other = reduced_points(points.other, image.size(), small.size());
  if (object.size() < kFewest) return {};
  cv::Mat1b labels = beginning(object, other, small.size());
  if (!has_both(labels) || !cut(small, &labels)) return {};
  cv::Mat1b of_object = (labels & 1) * 255;
  cv::morphologyEx(of_object, of_object, cv::MORPH_OPEN, cv::Mat());
  const cv::Mat kept = pieces_with_points(of_object, object);
  return kept.empty() ? kept : enlarged(kept, image.size());
}

}  // namespace mono_pose_tracker
