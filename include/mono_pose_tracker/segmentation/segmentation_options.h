#pragma once

#include <string>

namespace mono_pose_tracker {

/// Which pixels belong to the rigid object that is tracked. Lengths "px" are pixels of the input image.
struct SegmentationOptions {
  // auto: a given mask, else motion if there are two motions, else none.
  std::string method = "auto";  // or none, mask, background, threshold, chroma, motion

  // Which of several rigid objects is mapped: that with the most matches, or the one turning in front of the
  // camera.
  std::string body = "largest";  // or turning

  std::string background_image;          // background: an image of it; empty: learnt from the first images
  int learning_frames = 30;              // that the background is learnt from, the object being away
  double background_sigmas = 5;          // of a pixel's own noise: what differs by more is not background
  double background_min_difference = 8;  // grey levels of 255: compression and flicker stay below
  // A shadow dims the background uniformly, at least to this share of its brightness; 1: no shadows.
  double shadow = 0.5;
  double update_rate = 0.02;  // share of each new image in the background, outside the object

  std::string backdrop = "auto";       // threshold: dark, bright, or what the image's border tells
  double level = -1;                   // threshold and chroma: grey level; negative: found (Otsu)
  std::string chroma_color = "green";  // or blue

  int objects = 1;         // components that are kept, the largest
  double min_area = 0.01;  // share of the image: a smaller component is no object
  // Distance of features from the mask's edge: the mask may be wrong by that much, and a descriptor covers
  // some scales around its feature.
  double margin_px = 2;
  double margin_scales = 2;

  // The only place that compares the names of methods and objects.
  bool is_off() const { return method == "none"; }
  bool is_automatic() const { return method == "auto"; }
  bool is_by_motion() const { return method == "motion"; }  // and by nothing else
  bool is_by_background() const { return method == "background"; }
  bool is_by_threshold() const { return method == "threshold"; }
  bool is_by_chroma() const { return method == "chroma"; }
  /// Without a given mask an object may be found by its motion.
  bool may_find_motion() const { return is_automatic() || is_by_motion(); }
  bool wants_turning_object() const { return body == "turning"; }
};

}  // namespace mono_pose_tracker
