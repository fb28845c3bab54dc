#pragma once

#include <algorithm>
#include <cstddef>
#include <iterator>
#include <utility>
#include <vector>

namespace mono_pose_tracker {

// The track of one point: (image, feature) pairs, images counted in time.
using FeatureTrack = std::vector<std::pair<int, int>>;

// Number of features in each of the images.
template <typename Image>
std::vector<int> feature_counts(const std::vector<Image>& images) {
  std::vector<int> features;
  features.reserve(images.size());
  for (const Image& image : images) features.push_back(image.image->size());
  return features;
}

// Joins matched features to tracks (disjoint-set forest).
class FeatureTracks {
 public:
  // features: number of features in each of the images.
  explicit FeatureTracks(const std::vector<int>& features) {
    for (std::size_t k = 0; k < features.size(); ++k) {
      first_.push_back(parent_.size());
      for (int f = 0; f < features[k]; ++f) {
        parent_.push_back(parent_.size());
        tracks_.push_back({{static_cast<int>(k), f}});
      }
    }
  }

  // Joins two tracks, unless an image would then observe the point twice: in that case one of the matches is
  // wrong, and the earlier one is kept.
  void join(int image1, int feature1, int image2, int feature2) {
    const std::size_t a = root(first_[image1] + feature1), b = root(first_[image2] + feature2);
    if (a == b) return;
    FeatureTrack both;
    std::merge(tracks_[a].begin(), tracks_[a].end(), tracks_[b].begin(), tracks_[b].end(),
               std::back_inserter(both));
    const auto twice = std::adjacent_find(both.begin(), both.end(),
                                          [](const auto& x, const auto& y) { return x.first == y.first; });
    if (twice != both.end()) return;
    tracks_[a] = std::move(both);
    tracks_[b].clear();
    parent_[b] = a;
  }

  const std::vector<FeatureTrack>& all() const { return tracks_; }  // some are empty

 private:
  std::size_t root(std::size_t feature) {
    while (parent_[feature] != feature) feature = parent_[feature] = parent_[parent_[feature]];
    return feature;
  }

  std::vector<std::size_t> first_;  // index of each image's first feature
  std::vector<std::size_t> parent_;
  std::vector<FeatureTrack> tracks_;  // indexed by the root feature
};

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
