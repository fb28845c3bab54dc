#pragma once

#include <vector>

#include "feature_tracks.h"

namespace mono_pose_tracker {

// Votes of image pairs for and against a label of their features, summed over the features' tracks.
class TrackVotes {
 public:
  struct Count {
    int pro = 0, contra = 0;
    Count operator+(const Count& other) const { return {pro + other.pro, contra + other.contra}; }
  };

  // Images in the order of time, with member `image`.
  template <typename Image>
  explicit TrackVotes(const std::vector<Image>& images) : tracks_(feature_counts(images)) {
    for (const int features : feature_counts(images)) of_feature_.emplace_back(features);
  }

  void join(int image1, int feature1, int image2, int feature2) {
    tracks_.join(image1, feature1, image2, feature2);
  }
  void add(int image, int feature, const Count& count) {
    of_feature_[image][feature] = of_feature_[image][feature] + count;
  }

  // After it, of() is the sum over the feature's track.
  void sum_over_tracks() {
    for (const FeatureTrack& track : tracks_.all()) {
      Count sum;
      for (const auto& [image, feature] : track) sum = sum + of_feature_[image][feature];
      for (const auto& [image, feature] : track) of_feature_[image][feature] = sum;
    }
  }

  const Count& of(int image, int feature) const { return of_feature_[image][feature]; }

 private:
  FeatureTracks tracks_;
  std::vector<std::vector<Count>> of_feature_;
};

}  // namespace mono_pose_tracker
