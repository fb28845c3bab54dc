#include "mono_pose_tracker/features/sift.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <memory>
#include <numeric>
#include <opencv2/core.hpp>
#include <opencv2/core/version.hpp>
#include <sstream>
#include <stdexcept>
#include <tuple>
#include <utility>
#include <vector>

#include "common/rotation.h"
#include "common/toolchain.h"
#include "mono_pose_tracker/features/feature_set.h"
#include "sift_descriptor.h"
#include "sift_extrema.h"
#include "sift_scale_space.h"

#ifdef MONO_POSE_TRACKER_WITH_OPENCV_SIFT
#include <opencv2/features2d.hpp>
#endif

namespace mono_pose_tracker {
namespace {

/// Selects the features to keep: the strongest, distributed over the image. The k-th strongest feature of a
/// grid cell counts with response / (1 + k / q)^2, where q is the cell's even share of the budget. Textured
/// cells get more than their share, but not at the cost of all others.
class FeatureBudget {
 public:
  /// Cells along the longer side of the image. 12 are small enough to show where an image is bare, and large
  /// enough to hold a dozen features of a budget of 1,000 to 2,000.
  explicit FeatureBudget(int cells = 12) : cells_(cells) {}

  /// Indices of the chosen features, ordered by falling response, of equal ones the first. budget 0: all.
  /// Valid until the next call.
  const std::vector<int>& choose(const std::vector<Feature>& features, const cv::Size& image, int budget);

 private:
  void score_by_cell(const std::vector<Feature>& features, const cv::Size& image, int budget);

  int cells_;
  std::vector<int> order_;
  std::vector<float> score_;
  std::vector<int> cell_count_;
};

/// By decreasing response; a total order, so that results do not depend on the order of detection.
bool is_stronger(const Feature& a, const Feature& b) {
  return std::make_tuple(-a.response, a.pixel.y(), a.pixel.x(), a.scale, a.angle) <
         std::make_tuple(-b.response, b.pixel.y(), b.pixel.x(), b.scale, b.angle);
}

const std::vector<int>& FeatureBudget::choose(const std::vector<Feature>& features, const cv::Size& image,
                                              int budget) {
  const auto by_response = [&](int a, int b) { return is_stronger(features[a], features[b]); };
  order_.resize(features.size());
  std::iota(order_.begin(), order_.end(), 0);
  std::sort(order_.begin(), order_.end(), by_response);
  const auto is_same = [&](int a, int b) { return !by_response(a, b); };  // of neighbours in that order
  order_.erase(std::unique(order_.begin(), order_.end(), is_same), order_.end());
  if (budget <= 0 || static_cast<int>(order_.size()) <= budget) return order_;

  score_by_cell(features, image, budget);
  const auto by_score = [&](int a, int b) {
    return score_[a] != score_[b] ? score_[a] > score_[b] : by_response(a, b);
  };
  std::nth_element(order_.begin(), order_.begin() + budget, order_.end(), by_score);
  order_.resize(budget);
  std::sort(order_.begin(), order_.end(), by_response);
  return order_;
}

void FeatureBudget::score_by_cell(const std::vector<Feature>& features, const cv::Size& image, int budget) {
  const float cell_size =
      static_cast<float>(std::max(image.width, image.height)) / static_cast<float>(cells_);
  const int columns = static_cast<int>(std::ceil(image.width / cell_size));
  const int rows = static_cast<int>(std::ceil(image.height / cell_size));
  const float share = static_cast<float>(budget) / static_cast<float>(columns * rows);
  cell_count_.assign(static_cast<std::size_t>(columns) * rows, 0);
  score_.resize(features.size());
  for (const int i : order_) {
    const int column = std::clamp(static_cast<int>(features[i].pixel.x() / cell_size), 0, columns - 1);
    const int row = std::clamp(static_cast<int>(features[i].pixel.y() / cell_size), 0, rows - 1);
    const int stronger_in_cell = cell_count_[row * columns + column]++;
    const float crowding = 1.0f + static_cast<float>(stronger_in_cell) / share;
    score_[i] = features[i].response / (crowding * crowding);
  }
}

/// Throws std::invalid_argument when gray is not CV_8UC1, or mask is neither empty nor CV_8UC1 of the same
/// size.
void check_images(const cv::Mat& gray, const cv::Mat& mask) {
  if (!gray.empty() && gray.type() != CV_8UC1) throw std::invalid_argument("gray is not CV_8UC1");
  if (!mask.empty() && (mask.type() != CV_8UC1 || mask.size() != gray.size())) {
    throw std::invalid_argument("mask is not CV_8UC1 of the image's size");
  }
}

/// True where the mask forbids the feature; a pixel beyond the border asks the border. An empty mask hides
/// nothing.
bool is_masked_out(const cv::Mat& mask, const Feature& feature) {
  if (mask.empty()) return false;
  const int x = std::clamp(cvRound(feature.pixel.x()), 0, mask.cols - 1);
  const int y = std::clamp(cvRound(feature.pixel.y()), 0, mask.rows - 1);
  const std::uint8_t room = mask.at<std::uint8_t>(y, x);
  return room == 0 || (room < 255 && feature.scale * kMaskScaleSteps > room);
}

#ifdef MONO_POSE_TRACKER_WITH_OPENCV_SIFT

// cv::SIFT doubles the image with cv::resize, whose pixel x lies at x / 2 - 0.25 of the input, but reports x
// / 2.
Feature feature_of(const cv::KeyPoint& key_point) {
  Feature feature;
  feature.pixel = {key_point.pt.x - 0.25f, key_point.pt.y - 0.25f};
  feature.scale = 0.5f * key_point.size;
  feature.angle = key_point.angle * static_cast<float>(kDegree);
  feature.response = key_point.response;
  return feature;
}

class OpencvSift : public FeatureExtractor {
 public:
  explicit OpencvSift(const SiftOptions& options)
      : options_(options),
        sift_(cv::SIFT::create(0, options.octave_layers, options.contrast_threshold, options.edge_threshold,
                               options.sigma.value_or(1.6f))) {}  // px of the doubled image (Lowe)

  void prepare(const cv::Mat& gray) override {
    check_images(gray, cv::Mat());
    gray_ = gray;
    key_points_.clear();
    if (!gray.empty()) sift_->detectAndCompute(gray, cv::noArray(), key_points_, descriptors_);
  }

  void find(const cv::Mat& mask, FeatureSet* set) override {
    check_images(gray_, mask);
    set->features.clear();
    set->bearings.clear();
    candidates_.clear();
    source_rows_.clear();
    for (std::size_t i = 0; i < key_points_.size(); ++i) {
      const Feature feature = feature_of(key_points_[i]);
      if (!is_masked_out(mask, feature)) {
        candidates_.push_back(feature);
        source_rows_.push_back(static_cast<int>(i));
      }
    }
    const std::vector<int>& chosen = budget_.choose(candidates_, gray_.size(), options_.max_features);
    set->descriptors.create(static_cast<int>(chosen.size()), kDescriptorSize, CV_8U);
    for (std::size_t i = 0; i < chosen.size(); ++i) {
      set->features.push_back(candidates_[chosen[i]]);
      quantise_descriptor(descriptors_.ptr<float>(source_rows_[chosen[i]]), options_.root_sift,
                          set->descriptors.ptr<std::uint8_t>(static_cast<int>(i)));
    }
  }

 private:
  SiftOptions options_;
  cv::Ptr<cv::SIFT> sift_;
  FeatureBudget budget_;
  cv::Mat gray_;
  std::vector<cv::KeyPoint> key_points_;
  cv::Mat descriptors_;
  std::vector<Feature> candidates_;
  std::vector<int> source_rows_;
};

/// cv::SIFT with the interface of SiftExtractor. Its first octave is always -1; first_octave, min_features
/// and num_threads are ignored.
std::unique_ptr<FeatureExtractor> make_opencv_sift(const SiftOptions& options) {
  return std::make_unique<OpencvSift>(options);
}

/// Whether this was built with an OpenCV that has it (4.4 or later).
bool has_opencv_sift() { return true; }

#else

std::unique_ptr<FeatureExtractor> make_opencv_sift(const SiftOptions&) {
  throw std::invalid_argument("this build uses an OpenCV version without SIFT: OpenCV 4.4 or newer has it");
}

bool has_opencv_sift() { return false; }

#endif

SiftOptions with_threads(SiftOptions options) {
  options.num_threads = std::max(options.num_threads, 1);
  return options;
}

class OwnSift : public FeatureExtractor {
 public:
  explicit OwnSift(const SiftOptions& options)
      : options_(with_threads(options)), space_(options_, SiftScale()), finder_(options_) {}

  void prepare(const cv::Mat& gray) override {
    check_images(gray, cv::Mat());
    gray_ = gray;
    build(choose_sift_scale(options_, gray.size()));
  }

  void find(const cv::Mat& mask, FeatureSet* set) override {
    check_images(gray_, mask);
    const SiftScale scale = scale_for(mask);
    if (scale != space_.scale()) build(scale);
    set->features.clear();
    set->bearings.clear();
    find_extrema(mask);
    spend_budget(gray_.size());
    assign_orientations();
    describe(gray_.size(), set);
  }

 private:
  void build(const SiftScale& scale) {
    if (scale != space_.scale()) space_.set_scale(scale);
    finder_.begin(weak_were_needed_ ? lowered_threshold() : options_.contrast_threshold);
    const auto look = [&](int octave, int begin, int end) { finder_.look_at(space_, octave, begin, end); };
    space_.build(gray_, std::ref(look));  // without a copy, which would be allocated
    finder_.refine(space_, options_.contrast_threshold, &all_extrema_);
    weak_are_known_ = false;
  }

  float lowered_threshold() const { return options_.min_contrast_share * options_.contrast_threshold; }

  void find_weak_extrema() {
    if (std::exchange(weak_are_known_, true)) return;
    if (finder_.contrast_threshold() > lowered_threshold()) {
      finder_.begin(lowered_threshold());
      for (int octave = 0; octave < space_.octaves(); ++octave) {
        finder_.look_at(space_, octave, 0, space_.gaussian(octave, 0).height());
      }
    }
    finder_.refine(space_, lowered_threshold(), &weak_extrema_);
  }

  SiftScale scale_for(const cv::Mat& mask) const {
    const SiftScale usual = choose_sift_scale(options_, gray_.size());
    if (!options_.finer_for_small_objects || mask.empty()) return usual;
    const double object_px = std::sqrt(static_cast<double>(cv::countNonZero(mask)));
    return is_small_object(object_px, usual) ? finer(usual) : usual;
  }

  void find_extrema(const cv::Mat& mask) {
    exclude_masked(all_extrema_, mask);
    weak_were_needed_ = static_cast<int>(extrema_.size()) < options_.min_features;
    if (!weak_were_needed_) return;
    find_weak_extrema();
    exclude_masked(weak_extrema_, mask);
    if (static_cast<int>(extrema_.size()) <= options_.min_features) return;
    const auto last = extrema_.begin() + options_.min_features;
    std::nth_element(extrema_.begin(), last, extrema_.end(),
                     [](const Extremum& a, const Extremum& b) { return is_stronger(a.feature, b.feature); });
    extrema_.erase(last, extrema_.end());
  }

  void exclude_masked(const std::vector<Extremum>& from, const cv::Mat& mask) {
    extrema_.clear();
    for (const Extremum& extremum : from) {
      if (!is_masked_out(mask, extremum.feature)) extrema_.push_back(extremum);
    }
  }

  // Before orientation and descriptors, which are the larger part of the work.
  void spend_budget(const cv::Size& image) {
    candidates_.clear();
    for (const Extremum& extremum : extrema_) candidates_.push_back(extremum.feature);
    const std::vector<int>& chosen = budget_.choose(candidates_, image, options_.max_features);
    chosen_.clear();
    for (const int i : chosen) chosen_.push_back(extrema_[i]);
  }

  // An extremum becomes a feature for each of its orientations.
  void assign_orientations() {
    const int count = static_cast<int>(chosen_.size());
    angles_.resize(count);
    angle_counts_.assign(count, 0);  // of one that is not reached any more, too
    for_parts(count, options_.num_threads, [&](int, int begin, int end) {
      for (int i = begin; i < end && !is_set(options_.cancelled); ++i) {
        const Extremum& e = chosen_[i];
        angle_counts_[i] =
            find_orientations(space_.gaussian(e.octave, e.level), e.x, e.y, e.sigma, &angles_[i]);
      }
    });
    candidates_.clear();
    sources_.clear();
    for (int i = 0; i < count; ++i) {
      for (int k = 0; k < angle_counts_[i]; ++k) {
        candidates_.push_back(chosen_[i].feature);
        candidates_.back().angle = angles_[i][k];
        sources_.push_back(i);
      }
    }
  }

  void describe(const cv::Size& image, FeatureSet* set) {
    const std::vector<int>& kept = budget_.choose(candidates_, image, options_.max_features);
    const int count = static_cast<int>(kept.size());
    set->descriptors.create(count, kDescriptorSize, CV_8U);
    set->features.reserve(kept.size());
    for (const int i : kept) set->features.push_back(candidates_[i]);
    for_parts(count, options_.num_threads, [&](int, int begin, int end) {
      for (int i = begin; i < end && !is_set(options_.cancelled); ++i) {
        const Extremum& e = chosen_[sources_[kept[i]]];
        float histogram[kDescriptorSize];
        compute_histogram(space_.gaussian(e.octave, e.level), e.x, e.y, e.sigma, set->features[i].angle,
                          histogram);
        quantise_descriptor(histogram, options_.root_sift, set->descriptors.ptr<std::uint8_t>(i));
      }
    });
  }

  SiftOptions options_;
  ScaleSpace space_;
  ExtremaFinder finder_;
  FeatureBudget budget_;
  cv::Mat gray_;
  std::vector<Extremum> all_extrema_;   // whatever the mask
  std::vector<Extremum> weak_extrema_;  // the same with the lowered threshold, once they were needed
  bool weak_are_known_ = false;
  bool weak_were_needed_ = false;  // for the last image: the next is likely to need them as well
  std::vector<Extremum> extrema_;
  std::vector<Extremum> chosen_;
  std::vector<Feature> candidates_;
  std::vector<std::array<float, kMaxOrientations> > angles_;
  std::vector<int> angle_counts_;
  std::vector<int> sources_;  // [candidate] in chosen_
};

std::unique_ptr<FeatureExtractor> make_own_sift(const SiftOptions& options) {
  return std::make_unique<OwnSift>(options);
}

template <typename T>
void check_range(const char* key, T value, T low, T high) {
  if (value >= low && value <= high) return;  // false for NaN as well
  std::ostringstream text;
  text << key << " is " << value << ", expected " << low << " to " << high;
  throw std::invalid_argument(text.str());
}

}  // namespace

void SiftOptions::validate() const {
  if (implementation != "own" && implementation != "opencv") {
    throw std::invalid_argument("implementation is '" + implementation + "', expected own or opencv");
  }
  if (implementation == "opencv" && !has_opencv_sift()) {
    throw std::invalid_argument("implementation is 'opencv', expected own: this build uses OpenCV " CV_VERSION
                                ", which has no SIFT; OpenCV 4.4 or newer has it");
  }
  if (first_octave) check_range("first_octave", *first_octave, kFinestOctave, kCoarsestOctave);
  check_range("reduction", reduction, 1, 1000);
  check_range("max_features", max_features, 0, kMostFeatures);
  check_range("contrast_threshold", contrast_threshold, 0.0f, 1.0f);
  check_range("edge_threshold", edge_threshold, 1.0f, 1000.0f);
  check_range("octave_layers", octave_layers, 1, 10);
  if (sigma) check_range("sigma", *sigma, 0.6f, 10.0f);
  check_range("min_features", min_features, 0, kMostFeatures);
  check_range("min_contrast_share", min_contrast_share, 0.0f, 1.0f);
  check_range("num_threads", num_threads, 0, 64);
}

std::unique_ptr<FeatureExtractor> make_sift_extractor(const SiftOptions& options) {
  options.validate();
  return options.implementation == "opencv" ? make_opencv_sift(options) : make_own_sift(options);
}

}  // namespace mono_pose_tracker
