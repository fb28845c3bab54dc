#include "sift_own.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <utility>

#include "sift_budget.h"
#include "sift_descriptor.h"
#include "sift_extrema.h"
#include "sift_normalisation.h"
#include "sift_orientation.h"
#include "sift_parallel.h"
#include "sift_scale_space.h"

namespace mono_pose_tracker {
namespace {

// How far the contrast threshold is lowered at most for min_features: further down, 8-bit noise makes key
// points.
constexpr float kLowestContrastShare = 0.25f;

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
    if (scale != space_.scale()) space_ = ScaleSpace(options_, scale);
    finder_.begin(weak_were_needed_ ? lowered_threshold() : options_.contrast_threshold);
    const auto look = [&](int octave, int begin, int end) { finder_.look_at(space_, octave, begin, end); };
    space_.build(gray_, std::ref(look));  // without a copy, which would be allocated
    finder_.refine(space_, options_.contrast_threshold, &all_extrema_);
    weak_are_known_ = false;
  }

  float lowered_threshold() const { return kLowestContrastShare * options_.contrast_threshold; }

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
  std::vector<std::array<float, kMaxOrientations>> angles_;
  std::vector<int> angle_counts_;
  std::vector<int> sources_;  // [candidate] in chosen_
};

}  // namespace

std::unique_ptr<FeatureExtractor> make_own_sift(const SiftOptions& options) {
  return std::make_unique<OwnSift>(options);
}

}  // namespace mono_pose_tracker
