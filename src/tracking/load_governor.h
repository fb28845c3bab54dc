#pragma once

namespace mono_pose_tracker {

/// What is left out for lack of time; each level leaves out what those before it do.
enum LoadLevel : int {
  kTimeToSpare = -1,  // an object is searched one octave finer than usual: slow cameras, small images
  kFullWork = 0,
  kLittleDrawn = 1,    // a debug image a second: nobody is posed worse for it
  kLessMapped = 2,     // smaller windows, fewer keyframes matched
  kFewerFeatures = 3,  // half of them
  kCoarserOctave = 4,  // the image at half the size; not where the octave was chosen explicitly
};

/// Keeps the latency of live images below the time between two of them, by doing less, and goes back up.
/// Knows no clock: times are told.
class LoadGovernor {
 public:
  /// An image is done, latency_ms after it came; period_ms: between two that come (FramePeriod), 0: unknown;
  /// overtaken: whether the next had come before it was done. Who sends each image when the one before is
  /// answered is never kept waiting, whatever an image takes. Returns the LoadLevel for the next.
  int observe(double period_ms, double latency_ms, bool overtaken);
  int level() const { return level_; }

 private:
  void do_less();
  void change_level(int level);

  int level_ = kTimeToSpare;    // a map is begun in the first images: until the period says otherwise
  double mean_ms_ = 0;          // latency, of the last ten images or so
  int since_change_ = 0;        // images
  int since_overtaken_ = 1000;  // images; long ago
  int calm_ = 0;                // images in a row that leave time to spare
  int calm_needed_ = 90;        // before more is done again: three seconds at 30 Hz
  bool went_back_up_ = false;   // the last change was towards more
};

}  // namespace mono_pose_tracker
